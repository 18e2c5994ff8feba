#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "relax/minimize.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

constexpr double d = 1e-4;  ///< fiber diameter [m]

/// A warp that turns by about 100 degrees at one node, on the inside of the turn a straight weft that touches it.
struct SharpTurn {
  relax::Cell cell = empty_cell(16 * d, 16 * d);
  std::vector<Vec3> x;

  explicit SharpTurn(double weft_x) {
    relax::CellFiber warp = straight_fiber(cell, false, {0, 0, 0}, 8, 0, 0);
    const double rise = 1.55 * d;  // a node is 2 d along x from the next, those beside the turn lie closer
    warp.x[3] = {7 * d, 0, 0};
    warp.x[4] = {8 * d, 0, rise};
    warp.x[5] = {9 * d, 0, 0};
    relax::add_fiber(cell, warp, x);
    relax::add_fiber(cell, straight_fiber(cell, true, {weft_x, 0, -0.02 * d}, 8, 1, 0), x);
  }
  [[nodiscard]] double force_on_weft() const {
    const Eigen::VectorXd q = relax::unknowns_at(cell, x);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
    relax::contact_energy(cell, relax::find_contacts(cell, q, 0.3 * d), q, {&gradient, nullptr, false});
    double force = 0;
    for (std::uint32_t i = cell.first[1]; i < cell.first[2]; ++i) force -= gradient[3 * Eigen::Index{i}];
    return force;
  }
};

TEST(relax_bend, force_passes_steadily_through_the_inside_of_a_sharp_turn) {
  // By symmetry the force along x passes through zero at the middle. Points of the weft would see the one flank closest, then the other.
  constexpr int steps = 41;
  const double h = 0.005 * d;
  double largest = 0, jump = 0, before = 0;
  for (int k = 0; k < steps; ++k) {
    const double force = SharpTurn(8 * d + (k - steps / 2) * h).force_on_weft();
    largest = std::max(largest, std::abs(force));
    if (k > 0) jump = std::max(jump, std::abs(force - before));
    before = force;
  }
  EXPECT_GT(largest, 0);
  EXPECT_LT(jump, 0.1 * largest);  // forty steps from one end to the other: twice the mean change
  EXPECT_NEAR(SharpTurn(8 * d).force_on_weft() / largest, 0, 1e-9);
}

}  // namespace
