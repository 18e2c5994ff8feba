#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "contact_samples.hpp"
#include "relax/minimize.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

constexpr double d = 1e-4;  ///< fiber diameter [m]

/// Force of contact along x on the second fiber of a cell [N].
double force_on_weft_of(const relax::Cell& cell, const std::vector<Vec3>& x) {
  const Eigen::VectorXd q = relax::unknowns_at(cell, x);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  relax::contact_energy(cell, relax::find_contacts(cell, q, 0.3 * d), q, {&gradient, nullptr, false});
  double force = 0;
  for (std::uint32_t i = cell.first[1]; i < cell.first[2]; ++i) force -= gradient[3 * Eigen::Index{i}];
  return force;
}

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
  [[nodiscard]] double force_on_weft() const { return force_on_weft_of(cell, x); }
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

/// Force along x on a straight weft between the two legs of a warp that turns around high above it, legs `apart` from the middle at 8 d.
double force_between_legs(double apart, double weft_x) {
  relax::Cell cell = empty_cell(16 * d, 16 * d);
  relax::CellFiber warp;
  const double left = 8 * d - apart, right = 8 * d + apart;
  for (int k = 0; k < 4; ++k) warp.x.push_back({k * 0.25 * left, 0, 0});
  for (int k = 0; k <= 8; ++k) warp.x.push_back({left, 0, k * d});
  warp.x.push_back({8 * d, 0, 8 * d + apart});
  for (int k = 8; k >= 0; --k) warp.x.push_back({right, 0, k * d});
  for (int k = 1; k < 4; ++k) warp.x.push_back({right + k * 0.25 * (16 * d - right), 0, 0});
  for (std::size_t k = 0; k < warp.x.size(); ++k) {
    const Vec3 next = k + 1 < warp.x.size() ? warp.x[k + 1] : Vec3(warp.x[0] + Vec3(16 * d, 0, 0));
    warp.rest_length.push_back((next - warp.x[k]).norm());
  }
  std::vector<Vec3> x;
  relax::add_fiber(cell, warp, x);
  relax::add_fiber(cell, straight_fiber(cell, true, {weft_x, 0, 4.3 * d}, 8, 1, 0), x);
  return force_on_weft_of(cell, x);
}

TEST(relax_bend, fiber_between_two_legs_of_another_touches_both) {
  const auto by_one_leg = [](double overlap) { return force_between_legs(2 * d, 8 * d - 2 * d + d - overlap); };
  const double one = by_one_leg(0.02 * d);
  ASSERT_GT(one, 0);
  for (const double aside : {-0.01, -0.003, 0.0, 0.004, 0.01}) {
    SCOPED_TRACE(aside);
    const double both = by_one_leg((0.02 - aside) * d) - by_one_leg((0.02 + aside) * d);
    EXPECT_NEAR(force_between_legs(0.98 * d, (8 + aside) * d) / one, both / one, 1e-9);
  }
}

TEST(relax_bend, hessian_has_room_for_a_point_that_runs_around_a_bend) {
  // A warp in short spans around a radius of d, and close to its center a weft that is askew: from one point of the weft's span to the next
  // the closest point of the warp runs on by more than one of the warp's spans.
  relax::Cell cell = empty_cell(16 * d, 16 * d);
  relax::CellFiber warp, weft = straight_fiber(cell, true, {8 * d, 0, 0.2 * d}, 8, 1, 0);
  warp.x = {{0, 8 * d, -1.3 * d}, {3 * d, 8 * d, -1.3 * d}, {6 * d, 8 * d, -1.3 * d}};
  for (int k = -10; k <= 10; ++k) warp.x.emplace_back(8 * d + d * std::sin(0.1 * k), 8 * d, d * std::cos(0.1 * k));
  warp.x.insert(warp.x.end(), {{10 * d, 8 * d, -1.3 * d}, {13 * d, 8 * d, -1.3 * d}});
  for (std::size_t k = 0; k < warp.x.size(); ++k) {
    const Vec3 next = k + 1 < warp.x.size() ? warp.x[k + 1] : Vec3(warp.x[0] + Vec3(cell.length_x, 0, 0));
    warp.rest_length.push_back((next - warp.x[k]).norm());
  }
  weft.x[3].x() -= 0.4 * d;
  weft.x[5].x() += 0.4 * d;
  std::vector<Vec3> x;
  relax::add_fiber(cell, warp, x);
  relax::add_fiber(cell, weft, x);
  const Eigen::VectorXd q = relax::unknowns_at(cell, x);
  relax::ContactList list = relax::find_contacts(cell, q, 0.3 * d);
  std::erase_if(list.contacts, [&](const relax::SpanContact& c) { return cell.fiber_of[c.span] == 0; });  // the warp's make room too
  relax::number_samples(cell, list);
  list.gap.assign(list.first_sample.back(), -1);
  relax::SparseHessian hessian = relax::hessian_for(cell, list, q);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  relax::ContactState state;
  relax::contact_energy(cell, list, q, {&gradient, &hessian, false}, &state);
  EXPECT_GT(state.touching, 5U);  // more than the list is probed at, wherever the points are
  EXPECT_TRUE(hessian.complete());
}

}  // namespace
