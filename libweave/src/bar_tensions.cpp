#include "weave/bar_tensions.hpp"

#include <algorithm>

namespace weave {
namespace {

/// Solves for the state (taut or slack) of the bars: enough for a wave of slack to settle; a bar still undecided keeps its last state.
constexpr int bar_state_rounds = 4;

}  // namespace

BarTensions::BarTensions(std::size_t nodes) : slack_(nodes) {
  for (auto* a : {&rate_, &diagonal_, &upper_, &multiplier_, &corner_}) a->resize(nodes);
}

void BarTensions::pull(const BarChain& chain, double dt, double kick, std::span<Vec3> change, std::span<double> tension) {
  const auto bars = static_cast<std::uint32_t>(chain.tangent.size());
  const auto own_node = [&](std::uint32_t p) { return p == bars && chain.closed ? 0 : p; };
  const auto inverse_mass = [&](std::uint32_t p) { return chain.inverse_mass[own_node(p)]; };
  for (std::uint32_t s = 0; s < bars; ++s) {
    const Vec3 u = chain.v[s + 1] - chain.v[s] + change[s + 1] - change[s];
    const double rate = u.dot(chain.tangent[s]);
    const double stretch = chain.length[s] - chain.rest_length[s];
    rate_[s] = rate + stretch / dt + 0.5 * dt * (u.squaredNorm() - rate * rate) / chain.length[s];
    slack_[s] = stretch < 0;
    upper_[s] = s + 1 < bars ? -chain.tangent[s].dot(chain.tangent[s + 1]) * inverse_mass(s + 1) : 0;
  }
  const double seam = chain.closed && bars > 2 ? -chain.tangent[bars - 1].dot(chain.tangent[0]) * inverse_mass(0) : 0;
  for (int round = 0; round < bar_state_rounds; ++round) {
    for (std::uint32_t s = 0; s < bars; ++s) {
      const double k = chain.axial_stiffness / chain.rest_length[s] * (slack_[s] ? std::max(chain.compression_factor, 1e-12) : 1);
      diagonal_[s] = 1 / (dt * kick * k) + inverse_mass(s) + inverse_mass(s + 1);
      multiplier_[s] = rate_[s];
    }
    solve(bars, seam);
    bool changed = false;
    for (std::uint32_t s = 0; s < bars; ++s) {
      const bool slack = multiplier_[s] < 0;
      changed = changed || slack != (slack_[s] != 0);
      slack_[s] = slack;
    }
    if (!changed) break;
  }
  for (std::uint32_t s = 0; s < bars; ++s) {
    tension[s] = multiplier_[s] / kick;
    const Vec3 impulse = multiplier_[s] * chain.tangent[s];
    change[s] += inverse_mass(s) * impulse;
    change[own_node(s + 1)] -= inverse_mass(s + 1) * impulse;
  }
  if (chain.closed) change[bars] = change[0];
}

/// Symmetric tridiagonal solve in place, diagonal_ and upper_ the matrix, multiplier_ the right-hand side; with `seam` the corner
/// coefficient of a closed chain (Sherman & Morrison 1950).
void BarTensions::solve(std::uint32_t bars, double seam) {
  const double gamma = -diagonal_[0];
  if (seam != 0) {
    std::fill_n(corner_.begin(), bars, 0);
    corner_[0] = gamma;
    corner_[bars - 1] = seam;
    diagonal_[0] -= gamma;
    diagonal_[bars - 1] -= seam * seam / gamma;
  }
  for (std::uint32_t s = 1; s < bars; ++s) {
    const double factor = upper_[s - 1] / diagonal_[s - 1];
    diagonal_[s] -= factor * upper_[s - 1];
    multiplier_[s] -= factor * multiplier_[s - 1];
    if (seam != 0) corner_[s] -= factor * corner_[s - 1];
  }
  for (std::uint32_t s = bars; s-- > 0;) {
    const double inverse = 1 / diagonal_[s];
    const bool end_bar = s + 1 == bars;
    multiplier_[s] = (multiplier_[s] - (end_bar ? 0 : upper_[s] * multiplier_[s + 1])) * inverse;
    if (seam != 0) corner_[s] = (corner_[s] - (end_bar ? 0 : upper_[s] * corner_[s + 1])) * inverse;
  }
  if (seam == 0) return;
  const double ratio = seam / gamma;
  const double scale = (multiplier_[0] + ratio * multiplier_[bars - 1]) / (1 + corner_[0] + ratio * corner_[bars - 1]);
  for (std::uint32_t s = 0; s < bars; ++s) multiplier_[s] -= scale * corner_[s];
}

}  // namespace weave
