#include "relax/perturb.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <stdexcept>

namespace relax {

void perturb(const Cell& cell, double size, std::uint64_t seed, std::vector<Vec3>& x) {
  if (!(size >= 0 && size < 0.5)) throw std::invalid_argument("perturb: size must be >= 0 and < 0.5 diameters");
  std::mt19937_64 random(seed);
  // From the generator's own numbers, which are the same with every standard library.
  const auto share = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  std::vector<std::uint8_t> moved(cell.fibers(), 0);
  for (std::uint32_t first = 0; first < cell.fibers(); ++first) {
    if (moved[first]) continue;
    const double reach = size * 2 * cell.type_of(first).radius;
    const auto anywhere = [&](double radius) {
      const double r = radius * std::sqrt(share()), angle = 2 * std::numbers::pi * share();
      return cell.weft[first] ? Vec3(r * std::cos(angle), 0, r * std::sin(angle)) : Vec3(0, r * std::cos(angle), r * std::sin(angle));
    };
    const Vec3 constant = anywhere(0.5 * reach), wave = anywhere(0.5 * reach);
    const double phase = 2 * std::numbers::pi * share();
    for (std::uint32_t f = first; !moved[f]; f = cell.next[f]) {
      moved[f] = 1;
      for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) {
        const double along = static_cast<double>(i - cell.first[f]) / cell.nodes_of(f);
        x[i] += constant + wave * std::cos(2 * std::numbers::pi * along + phase);
      }
    }
  }
}

}  // namespace relax
