#include "relax/perturb.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "scenes/cells.hpp"

namespace relax {
namespace {

TEST(Perturb, MovesEachFiberAcrossItsPeriodAndNoFartherThanAsked) {
  const scenes::PosedCell p = scenes::plain_weave_cell({.fibers = 7, .pitch = 1e-3}, 0.5, 1.4);
  std::vector<Vec3> x = p.x, again = p.x, other = p.x;
  perturb(p.cell, 0.3, 1, x);
  perturb(p.cell, 0.3, 1, again);
  perturb(p.cell, 0.3, 2, other);
  EXPECT_EQ(x, again);
  double least = 1e300, difference = 0;
  for (std::size_t f = 0; f < p.cell.fibers(); ++f) {
    double way = 0;
    for (std::uint32_t i = p.cell.first[f]; i < p.cell.first[f + 1]; ++i) {
      const Vec3 moved = x[i] - p.x[i];
      EXPECT_EQ(moved[p.cell.axis_of(f)], 0);
      way = std::max(way, moved.norm());
      difference = std::max(difference, (x[i] - other[i]).norm());
    }
    EXPECT_LE(way, 0.3 * 2 * p.cell.type_of(f).radius);
    least = std::min(least, way);
  }
  EXPECT_GT(least, 0);
  EXPECT_GT(difference, 0.1 * 2 * p.cell.types[0].radius);
  EXPECT_THROW(perturb(p.cell, 0.5, 1, x), std::invalid_argument);
}

TEST(Perturb, FibersThatGoOnInOneAnotherMoveAlike) {
  scenes::PosedCell p = scenes::plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.5, 1.4);
  std::vector<std::uint32_t> next(p.cell.fibers());
  for (std::uint32_t f = 0; f < next.size(); ++f) next[f] = f;
  std::swap(next[0], next[1]);
  close_fibers(p.cell, next);
  std::vector<Vec3> x = p.x;
  perturb(p.cell, 0.3, 1, x);
  const auto moved = [&](std::uint32_t fiber) { return Vec3(x[p.cell.first[fiber]] - p.x[p.cell.first[fiber]]); };
  EXPECT_LT((moved(0) - moved(1)).norm(), 1e-12);
  EXPECT_GT((moved(0) - moved(2)).norm(), 1e-7);
}

}  // namespace
}  // namespace relax
