#include "weave/bar_tensions.hpp"

#include <algorithm>

namespace weave {
namespace {

/// Solves for the state (taut or slack) of the bars: enough for a wave of slack to settle; a bar still undecided keeps its last state.
constexpr int bar_state_rounds = 4;

}  // namespace

BarTensions::BarTensions(std::size_t nodes) : slack_(nodes) {
  for (auto* a : {&rate_, &diagonal_, &inverse_, &upper_, &multiplier_, &corner_}) a->resize(nodes);
}

void BarTensions::pull(const BarChain& chain, double dt, double kick, std::span<Vec3> change, std::span<double> tension) {
  const auto bars = static_cast<std::uint32_t>(chain.tangent.size());
  const auto own_node = [&](std::uint32_t p) { return p == bars && chain.closed ? 0 : p; };
  const auto inverse_mass = [&](std::uint32_t p) { return chain.inverse_mass[own_node(p)]; };
  const double per_dt = 1 / dt;
  for (std::uint32_t s = 0; s < bars; ++s) {
    const Vec3 u = chain.v[s + 1] - chain.v[s] + change[s + 1] - change[s];
    const double rate = u.dot(chain.tangent[s]);
    const double stretch = chain.length[s] - chain.rest_length[s];
    rate_[s] = rate + stretch * per_dt + 0.5 * dt * (u.squaredNorm() - rate * rate) * chain.inverse_length[s];
    slack_[s] = stretch < 0;
    upper_[s] = s + 1 < bars ? -chain.tangent[s].dot(chain.tangent[s + 1]) * inverse_mass(s + 1) : 0;
  }
  const double seam = chain.closed && bars > 2 ? -chain.tangent[bars - 1].dot(chain.tangent[0]) * inverse_mass(0) : 0;
  // 1/(dt h k) of a bar over its rest length.
  const double taut = 1 / (dt * kick * chain.axial_stiffness), slack = taut / std::max(chain.compression_factor, 1e-12);
  for (int round = 0; round < bar_state_rounds; ++round) {
    for (std::uint32_t s = 0; s < bars; ++s) {
      diagonal_[s] = chain.rest_length[s] * (slack_[s] ? slack : taut) + inverse_mass(s) + inverse_mass(s + 1);
      multiplier_[s] = rate_[s];
    }
    solve(bars, seam);
    bool changed = false;
    for (std::uint32_t s = 0; s < bars; ++s) {
      const bool is_slack = multiplier_[s] < 0;
      changed = changed || is_slack != (slack_[s] != 0);
      slack_[s] = is_slack;
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
  // From both ends to the middle and back, so that two chains of divisions, each waiting for the one before, go on side by side.
  const std::uint32_t middle = bars / 2, behind = bars - 1 - middle;
  const auto eliminate = [&](std::uint32_t from, std::uint32_t into, double coupling) {
    inverse_[from] = 1 / diagonal_[from];
    const double factor = coupling * inverse_[from];
    diagonal_[into] -= factor * coupling;
    multiplier_[into] -= factor * multiplier_[from];
    if (seam != 0) corner_[into] -= factor * corner_[from];
  };
  for (std::uint32_t k = 0; k < middle; ++k) {
    eliminate(k, k + 1, upper_[k]);
    if (k < behind) eliminate(bars - 1 - k, bars - 2 - k, upper_[bars - 2 - k]);
  }
  multiplier_[middle] /= diagonal_[middle];
  if (seam != 0) corner_[middle] /= diagonal_[middle];
  const auto substitute = [&](std::uint32_t at, std::uint32_t known, double coupling) {
    multiplier_[at] = (multiplier_[at] - coupling * multiplier_[known]) * inverse_[at];
    if (seam != 0) corner_[at] = (corner_[at] - coupling * corner_[known]) * inverse_[at];
  };
  for (std::uint32_t k = middle; k-- > 0;) {
    substitute(k, k + 1, upper_[k]);
    if (k < behind) substitute(bars - 1 - k, bars - 2 - k, upper_[bars - 2 - k]);
  }
  if (seam == 0) return;
  const double ratio = seam / gamma;
  const double scale = (multiplier_[0] + ratio * multiplier_[bars - 1]) / (1 + corner_[0] + ratio * corner_[bars - 1]);
  for (std::uint32_t s = 0; s < bars; ++s) multiplier_[s] -= scale * corner_[s];
}

}  // namespace weave
