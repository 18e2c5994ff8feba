#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "relax/minimize.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

constexpr double d = 1e-4;  ///< fiber diameter [m]

TEST(relax_minimum, crossing_fibers_balance_their_tensions) {
  // Plain weave of single fibers: certified, and the force between the yarns is that of the tensions.
  const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns());
  EXPECT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
  EXPECT_LT(r.certificate.pin_force_max, 0.02);  // what is left of the axis' discreteness along the fibers
  EXPECT_LT(r.contacts.overlap_max, 0.2);
  const std::vector<double> tension = relax::bar_tensions(p.cell, relax::Unknowns(p.cell), r.q);
  for (const double t : tension) EXPECT_NEAR(t / 0.2, 1, 0.05);
}

TEST(relax_minimum, certificate_refuses_an_unfinished_state) {
  const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  const relax::Certificate c = relax::certify(p.cell, p.unknowns());
  EXPECT_FALSE(c.converged);
  EXPECT_THAT(c.blocked_by, testing::HasSubstr(fmt::format("gradient of {:.2e} of the reference tension", c.gradient_max)));
}

TEST(relax_minimum, certificate_refuses_a_saddle) {
  // A warp that stands exactly on another one between platens: all forces balance, but it would roll off to either side.
  relax::Cell cell = empty_cell(8 * d, 8 * d);
  cell.pressure = 1e4;
  std::vector<Vec3> x;
  relax::add_fiber(cell, straight_fiber(cell, false, {0, 4 * d, 0}, 4, 0, 0.1), x);
  relax::add_fiber(cell, straight_fiber(cell, false, {0, 4 * d, 0.97 * d}, 4, 1, 0.1), x);
  relax::MinimizeOptions options;
  options.first_order_max = 0;  // round-off would carry it off the saddle
  options.leave_saddles = false;
  const relax::MinimizeResult saddle = relax::minimize(cell, relax::unknowns_at(cell, x), options);
  EXPECT_LT(saddle.certificate.gradient_max, 1e-8);
  EXPECT_FALSE(saddle.certificate.positive_definite);
  EXPECT_FALSE(saddle.certificate.converged);
  EXPECT_THAT(saddle.certificate.blocked_by, testing::HasSubstr("positive definite"));
  const relax::MinimizeResult below = relax::minimize(cell, saddle.q);
  EXPECT_LT(below.energy.sum(), saddle.energy.sum() - 1e4 * 64 * d * d * 0.5 * d);  // it came down by about a radius at least
}

/// A warp at a strain of 0.01, and far above it a straight weft whose bars have another one and that nothing touches: no node feels a
/// force.
relax::Certificate certificate_of_free_weft(double strain) {
  relax::Cell cell = empty_cell(8 * d, 8 * d);
  cell.types[0].compression_factor = 1;
  std::vector<Vec3> x;
  for (const bool weft : {false, true}) {
    relax::CellFiber fiber = straight_fiber(cell, weft, {0, 0, weft ? 5 * d : 0}, 4, weft ? 7 : 3, 0);
    for (double& l : fiber.rest_length) l /= 1 + (weft ? strain : 0.01);
    relax::add_fiber(cell, fiber, x);
  }
  return relax::certify(cell, relax::unknowns_at(cell, x));
}

TEST(relax_minimum, certificate_names_a_slack_fiber) {
  // Across a straight chain of tension T only T / l holds a node. With E A = 6.4 N and l = 2 d that is -3e-5 N/m at a strain of -1e-9, and
  // 6e-4 N/m are the millionth of the warp's tension over d by which a Hessian may miss being positive definite.
  const relax::Certificate slack = certificate_of_free_weft(-1e-9);
  EXPECT_LT(slack.gradient_max, 1e-8);
  EXPECT_FALSE(slack.converged);
  EXPECT_TRUE(slack.neutral);
  EXPECT_THAT(slack.blocked_by, testing::AllOf(testing::HasSubstr("slack"), testing::HasSubstr("yarn 7")));
  // Pushed as hard as the warp is pulled, the chain buckles.
  const relax::Certificate pushed = certificate_of_free_weft(-0.01);
  EXPECT_LT(pushed.gradient_max, 1e-8);
  EXPECT_FALSE(pushed.converged);
  EXPECT_FALSE(pushed.neutral);
  EXPECT_THAT(pushed.blocked_by, testing::HasSubstr("not positive definite"));
}

TEST(relax_minimum, a_fiber_that_touches_nothing_may_lie_anywhere) {
  // Taut, the weft is held by its own tension but for its place.
  const relax::Certificate taut = certificate_of_free_weft(0.01);
  EXPECT_TRUE(taut.converged) << taut.blocked_by;
  EXPECT_TRUE(taut.positive_definite);
  EXPECT_EQ(taut.free_fibers, 2);  // the warp touches nothing either
}

TEST(relax_minimum, newton_is_of_higher_than_first_order_near_the_end) {
  const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  relax::MinimizeOptions newton;
  newton.method = relax::MinimizeMethod::newton;
  Eigen::VectorXd q = p.unknowns();
  shake(q, 0.02 * d, 6);  // as it is, the start is so near that there are too few steps to tell
  const relax::MinimizeResult r = relax::minimize(p.cell, q, newton);
  ASSERT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
  // The law is like delta^1.5 at touch: order 1.5 is expected while contact points open and close, 2 at the very end.
  double order = 0;
  for (std::size_t k = 2; k < r.history.size(); ++k) {
    const double a = r.history[k - 2].gradient_max, b = r.history[k - 1].gradient_max, c = r.history[k].gradient_max;
    if (a < 1e-2 && c > 1e-11 && b < a && c < b) order = std::max(order, std::log(c / b) / std::log(b / a));
  }
  EXPECT_GT(order, 1.4);
}

TEST(relax_minimum, same_energy_for_a_doubled_cell) {
  const auto energy = [](int repeat_x, int repeat_y) {
    const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4, .repeat_x = repeat_x, .repeat_y = repeat_y}, 0.2, 1);
    const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns());
    EXPECT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
    return r.energy.sum();
  };
  const double single = energy(1, 1);
  EXPECT_NEAR(energy(2, 1) / single, 2, 1e-9);
  EXPECT_NEAR(energy(1, 2) / single, 2, 1e-9);
}

TEST(relax_minimum, energy_is_independent_of_where_elements_are_cut) {
  // Bars are chords, of second order in the length of an element: a quadratic B-spline through the same path has its energy to a like
  // order, wherever its nodes lie. Yarns stiff enough to be round where they bend, with a radius of several elements.
  std::vector<double> energy, cut;
  for (const double element_length : {2.0, 1.0, 0.5}) {
    PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 8 * d}, 0.01, element_length);
    p.cell.types[0].bending_stiffness = 1e-9;
    const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns());
    ASSERT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
    energy.push_back(r.energy.sum());
    cut.push_back(0);
    for (const double shift : {0.25, 0.5}) {
      // A span runs from the middle of one bar to the middle of the next: at one half of it the axis is next to its node.
      std::vector<Vec3> x;
      for (std::uint32_t i = 0; i < p.cell.nodes(); ++i) x.push_back(relax::axis_point(p.cell, r.q, i, std::fmod(0.5 + shift, 1.0)));
      const relax::MinimizeResult shifted = relax::minimize(p.cell, relax::unknowns_at(p.cell, x));
      ASSERT_TRUE(shifted.certificate.converged) << shifted.certificate.blocked_by;
      cut.back() = std::max(cut.back(), std::abs(shifted.energy.sum() - r.energy.sum()));
    }
  }
  const double coarse = energy[0] - energy[1], fine = energy[1] - energy[2];
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.2);
  EXPECT_LT(std::abs(fine), 0.02 * energy[2]);
  // The cut moves the energy by less than halving the elements does, and that falls with their square at least.
  for (std::size_t k = 0; k < 2; ++k) EXPECT_LT(cut[k], 0.5 * (energy[k] - energy[k + 1]));
  EXPECT_GT(std::log2(cut[0] / cut[2]), 2 * 2 - 0.2);
  EXPECT_LT(cut[2], 1e-3 * energy[2]);
}

TEST(relax_minimum, same_with_and_without_the_first_order_phase) {
  const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  relax::MinimizeOptions newton;
  newton.method = relax::MinimizeMethod::newton;
  const relax::MinimizeResult a = relax::minimize(p.cell, p.unknowns()), b = relax::minimize(p.cell, p.unknowns(), newton);
  EXPECT_TRUE(a.certificate.converged) << a.certificate.blocked_by;
  EXPECT_TRUE(b.certificate.converged) << b.certificate.blocked_by;
  EXPECT_NEAR(a.energy.sum() / b.energy.sum(), 1, 1e-9);
}

TEST(relax_minimum, damped_motion_alone_reaches_newtons_minimum) {
  const PosedCell p = plain_weave_cell({.fibers = 3, .pitch = 8e-4}, 0.2, 1);
  relax::MinimizeOptions newton;
  newton.method = relax::MinimizeMethod::newton;
  relax::MinimizeOptions dynamic;
  dynamic.method = relax::MinimizeMethod::dynamic;
  const relax::MinimizeResult a = relax::minimize(p.cell, p.unknowns(), newton), b = relax::minimize(p.cell, p.unknowns(), dynamic);
  ASSERT_TRUE(a.certificate.converged) << a.certificate.blocked_by;
  ASSERT_TRUE(b.certificate.converged) << b.certificate.blocked_by;
  const auto steps = [](const relax::MinimizeResult& r) {
    return std::count_if(r.history.begin(), r.history.end(), [](const relax::MinimizeProgress& i) { return i.first_order; });
  };
  EXPECT_EQ(steps(a), 0);
  EXPECT_GT(steps(b), 100);
  EXPECT_NEAR(b.energy.sum() / a.energy.sum(), 1, 1e-9);
  EXPECT_LT((a.q - b.q).cwiseAbs().maxCoeff(), 1e-7 * d);  // of either's Newton step, and what the contacts' shares differ by
}

TEST(relax_minimum, certificate_holds_to_its_bounds_whatever_the_tolerance) {
  const PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  for (const auto method : {relax::MinimizeMethod::automatic, relax::MinimizeMethod::dynamic, relax::MinimizeMethod::newton}) {
    SCOPED_TRACE(static_cast<int>(method));
    relax::MinimizeOptions options;
    options.method = method;
    options.gradient_tolerance = options.step_tolerance = 1e-3;
    const relax::MinimizeResult early = relax::minimize(p.cell, p.unknowns(), options);
    EXPECT_LE(early.certificate.gradient_max, 1e-3);
    EXPECT_GT(early.certificate.gradient_max, 1e-8);
    EXPECT_FALSE(early.certificate.converged);
    options.gradient_tolerance = options.step_tolerance = 1e-10;
    const relax::MinimizeResult late = relax::minimize(p.cell, p.unknowns(), options);
    EXPECT_TRUE(late.certificate.converged) << late.certificate.blocked_by;
    EXPECT_LE(late.certificate.gradient_max, 1e-10);
    EXPECT_LE(late.certificate.newton_step_max, 1e-10);
  }
}

TEST(relax_minimum, damped_motion_alone_moves_no_free_length) {
  PosedCell p = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  p.cell.load_x = 0.1;
  relax::MinimizeOptions dynamic;
  dynamic.method = relax::MinimizeMethod::dynamic;
  EXPECT_THROW(relax::minimize(p.cell, p.unknowns(), dynamic), std::invalid_argument);
}

}  // namespace
