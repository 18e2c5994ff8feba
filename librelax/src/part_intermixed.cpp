#include "part_intermixed.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "box_grid.hpp"

namespace relax {
namespace {

constexpr double kernel_reach = 1.5;     ///< how far a fiber is spread out [its diameters]
constexpr double sample_distance = 0.5;  ///< along a fiber [its diameters]
constexpr double near = 3;               ///< from a place [diameters of the fibers there]
constexpr double step_max = 0.1;         ///< of a point [diameters of the yarn's fibers]
constexpr double converged = 1e-3;       ///< the same, of all points
constexpr double smoothing = 0.5;        ///< share of the mean of its neighbors' way in a point's
constexpr int steps_max = 100;

/// A piece of fiber, spread out over the space around it by (1 - (r / reach)^2)^3.
struct Sample {
  Vec3 x;
  std::uint32_t yarn;  ///< index in the list of yarns
  int beside;          ///< image of the yarn across its period
  double weight;       ///< of the density in its middle: solid volume over that of the kernel's ball
};

class Density {
 public:
  Density(const std::vector<YarnFibers>& yarns, const std::vector<YarnSide>& sides, const Lattice& lattice) {
    Box all;
    for (const YarnSide& side : sides)
      for (const Vec3& x : side.x) all.extend(x);
    for (const YarnSide& side : sides) reach_ = std::max(reach_, kernel_reach * side.diameter);
    const Box wide(Vec3(all.min() - Vec3::Constant(reach_)), Vec3(all.max() + Vec3::Constant(reach_)));
    std::vector<Box> boxes;
    for (std::uint32_t y = 0; y < yarns.size(); ++y) {
      const YarnFibers& yarn = yarns[y];
      for (std::size_t f = 0; f < yarn.size(); ++f) {
        const double spacing = sample_distance * 2 * yarn.radius[f];
        const auto count = static_cast<int>(std::ceil(yarn.length[f] / spacing));
        const double weight = yarn.area[f] * yarn.length[f] / count / (reach_ * reach_ * reach_);
        for (int k = 0; k < count; ++k) {
          const Vec3 x = yarn.at(f, static_cast<double>(k) / count);
          for (int i = -2; i <= 2; ++i)
            for (int j = -2; j <= 2; ++j) {
              const Vec3 image = x + Vec3(i * lattice.length_x, j * lattice.length_y, 0);
              if (!wide.contains(image)) continue;
              samples_.push_back({image, y, yarn.weft ? i : j, weight});
              boxes.emplace_back(image);
            }
        }
      }
    }
    grid_.emplace(std::move(boxes), reach_);
  }

  /// How much denser a yarn is at a point than the densest other one, and the gradient of that [1/m].
  struct Excess {
    double value = 0;
    Vec3 gradient = Vec3::Zero();
  };
  [[nodiscard]] Excess excess_of(std::uint32_t yarn, const Vec3& x) {
    grid_->find(Box(Vec3(x - Vec3::Constant(reach_)), Vec3(x + Vec3::Constant(reach_))), found_);
    Excess own;
    others_.clear();
    for (const std::uint32_t i : found_) {
      const Sample& s = samples_[i];
      const Vec3 r = x - s.x;
      const double left = 1 - r.squaredNorm() / (reach_ * reach_);
      if (left <= 0) continue;
      const double value = s.weight * left * left * left;
      const Vec3 gradient = -6 * s.weight * left * left / (reach_ * reach_) * r;
      Excess& of = s.yarn == yarn && s.beside == 0 ? own : other(s.yarn, s.beside);
      of.value += value;
      of.gradient += gradient;
    }
    const auto densest = std::ranges::max_element(others_, {}, [](const Other& o) { return o.density.value; });
    if (densest == others_.end()) return own;
    return {own.value - densest->density.value, own.gradient - densest->density.gradient};
  }

 private:
  struct Other {
    std::uint32_t yarn;
    int beside;
    Excess density;
  };
  Excess& other(std::uint32_t yarn, int beside) {
    for (Other& o : others_)
      if (o.yarn == yarn && o.beside == beside) return o.density;
    return others_.emplace_back(yarn, beside, Excess{}).density;
  }

  double reach_ = 0;  ///< [m]
  std::vector<Sample> samples_;
  std::optional<BoxGrid> grid_;
  std::vector<std::uint32_t> found_;
  std::vector<Other> others_;
};

/// A side while its points are being moved.
class MovingSide {
 public:
  MovingSide(YarnSide& side, std::uint32_t number, const std::vector<Vec3>& places)
      : side_(side), number_(number), start_(side.x), moved_(side.x.size(), Vec3::Zero()) {
    const double reach = near * side.diameter;
    for (std::size_t p = 0; p < side.x.size(); ++p)
      if (std::ranges::any_of(places, [&](const Vec3& place) { return (side.x[p] - place).squaredNorm() < reach * reach; }))
        points_.push_back(p);
  }

  /// One step of points toward where both yarns are as dense, spread over their neighbors. Returns the longest step [m].
  double step(Density& density) {
    double longest = 0;
    const double limit = step_max * side_.diameter;
    for (const std::size_t p : points_) {
      Density::Excess excess = density.excess_of(number_, side_.x[p]);
      hold(p, excess.gradient);
      const double slope2 = excess.gradient.squaredNorm();
      if (excess.value >= 0 || slope2 == 0) continue;
      Vec3 by = -excess.value / slope2 * excess.gradient;
      if (by.norm() > limit) by *= limit / by.norm();
      moved_[p] += by;
      longest = std::max(longest, by.norm());
    }
    const std::vector<Vec3> before = moved_;
    for (const std::size_t p : points_) {
      Vec3 mean = Vec3::Zero();
      for (const std::size_t n : neighbors(p)) mean += 0.25 * before[n];
      moved_[p] += smoothing * (mean - before[p]);
      hold(p, moved_[p]);
      side_.x[p] = start_[p] + moved_[p];
    }
    return longest;
  }

 private:
  /// Points of the first ring stay on their face.
  void hold(std::size_t p, Vec3& move) const {
    if (p < side_.points) move[side_.axis()] = 0;
  }

  /// Beside a point in its ring and in those before and after it.
  [[nodiscard]] std::array<std::size_t, 4> neighbors(std::size_t p) const {
    const std::size_t count = side_.points, ring = p / count, j = p % count;
    const std::size_t before = ring > 0 ? p - count : (side_.rings - 1) * count + (j + count - side_.turn) % count;
    return {ring * count + (j + 1) % count, ring * count + (j + count - 1) % count, before, side_.own(p + count)};
  }

  YarnSide& side_;
  std::uint32_t number_;
  std::vector<Vec3> start_, moved_;
  std::vector<std::size_t> points_;
};

}  // namespace

void part_intermixed(const std::vector<YarnFibers>& yarns, std::vector<YarnSide>& sides, const Lattice& lattice,
                     const std::vector<Intrusion>& places) {
  std::vector<std::vector<Vec3>> near_side(sides.size());
  for (const Intrusion& i : places) {
    for (const double periods : {-1, 0, 1}) {
      near_side[i.side_a].push_back(i.x + periods * sides[i.side_a].period);
      near_side[i.side_b].push_back(i.x - i.shift + periods * sides[i.side_b].period);
    }
  }
  Density density(yarns, sides, lattice);
  for (std::uint32_t s = 0; s < sides.size(); ++s) {
    if (near_side[s].empty()) continue;
    MovingSide side(sides[s], s, near_side[s]);
    for (int step = 0; step < steps_max && side.step(density) > converged * sides[s].diameter; ++step) continue;
  }
}

}  // namespace relax
