#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <numbers>

#include "scenes/scenes.hpp"
#include "weave/case.hpp"
#include "weave/fiber_path.hpp"
#include "weave/loom.hpp"

namespace {

using namespace scenes;
using testing::HasSubstr;
using weave::StepReport;
using weave::StepStatus;

/// Steps until something is wrong.
StepReport run_until_failure(const Scene& scene, int steps) {
  weave::Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  for (int i = 0; i < steps; ++i) {
    StepReport report = engine.step(drive);
    if (report.status != StepStatus::ok) return report;
  }
  return {};
}

Scene two_yarns(const weave::FiberType& type, double speed) {
  const double d = 2 * type.radius;
  Scene scene = crossing_pair(type, std::numbers::pi / 2, 6 * d, 6, 1.5 * d);
  scene.model.role[1] = weave::Role::weft;
  scene.model.yarn = {4, 17};
  scene.model.place = {2, 5};
  for (std::size_t p = 7; p < 14; ++p) scene.state.v[p].z() = -speed;
  return scene;
}

TEST(guard, pushing_through_a_soft_fiber_names_both_yarns) {
  weave::FiberType type = glass_fiber();
  type.transverse_modulus = 1e3;
  const StepReport report = run_until_failure(two_yarns(type, 5), 5000);
  EXPECT_EQ(report.status, StepStatus::overlap_too_deep);
  EXPECT_THAT(report.message, HasSubstr("warp yarn 4, fiber 2"));
  EXPECT_THAT(report.message, HasSubstr("weft yarn 17, fiber 5"));
}

TEST(guard, pushing_through_at_speed_names_both_yarns) {
  const auto type = glass_fiber();
  Scene scene = two_yarns(type, 3000);
  scene.options.time_step_max = 0.1 * 2 * type.radius / 3000;  // a tenth of a diameter a step
  const StepReport report = run_until_failure(scene, 100);
  EXPECT_EQ(report.status, StepStatus::overlap_too_deep);
  EXPECT_THAT(report.message, HasSubstr("warp yarn 4, fiber 2"));
  EXPECT_THAT(report.message, HasSubstr("weft yarn 17, fiber 5"));
}

TEST(guard, prescribed_time_step_above_the_limit_names_the_limit_and_the_yarn) {
  Scene scene = two_yarns(glass_fiber(), 1);
  weave::Engine engine = scene.engine();
  engine.step(at_rest(scene.model));
  scene.options.time_step = 0.99 * engine.step_limit();
  EXPECT_EQ(run_until_failure(scene, 1).status, StepStatus::ok);
  scene.options.time_step = 1.01 * engine.step_limit();
  const StepReport report = run_until_failure(scene, 1);
  EXPECT_EQ(report.status, StepStatus::time_step_too_long);
  EXPECT_THAT(report.message, HasSubstr(fmt::format("time step of {:.4g} s", scene.options.time_step)));
  EXPECT_THAT(report.message, HasSubstr(fmt::format("limit of {:.4g} s", engine.step_limit())));
  EXPECT_THAT(report.message, HasSubstr("yarn "));
}

TEST(guard, motion_that_is_not_finite_names_node_and_yarn) {
  for (const bool implicit_axial : {false, true}) {
    for (const bool position : {false, true}) {
      Scene scene = two_yarns(glass_fiber(), 1);
      scene.model.implicit_axial = implicit_axial;
      scene.options.time_step = 1e-9;
      weave::Engine first = scene.engine();
      first.step(at_rest(scene.model));
      scene.state = first.state();
      (position ? scene.state.x : scene.state.v)[10].y() = std::numeric_limits<double>::quiet_NaN();
      const StepReport report = run_until_failure(scene, 1);
      EXPECT_EQ(report.status, StepStatus::non_finite);
      EXPECT_THAT(report.message, HasSubstr("weft yarn 17, fiber 5"));
      EXPECT_THAT(report.message, HasSubstr("node "));
      if (!implicit_axial) {  // the axial solve spreads it along the fiber
        EXPECT_THAT(report.message, testing::AnyOf(HasSubstr("node 2 "), HasSubstr("node 3 ")));
      }
    }
  }
}

TEST(guard, position_that_is_not_a_number_at_the_start_is_caught) {
  Scene scene = two_yarns(glass_fiber(), 1);
  scene.state.x[10].y() = std::numeric_limits<double>::quiet_NaN();
  const StepReport report = run_until_failure(scene, 1);
  EXPECT_EQ(report.status, StepStatus::non_finite);
  EXPECT_THAT(report.message, HasSubstr("weft yarn 17, fiber 5"));
}

TEST(guard, weft_on_the_wrong_side_of_a_warp_is_found) {
  const weave::Case c = weave::load_case(std::string(HEDDLE_CASES_DIR) + "/three_warp/case.toml");
  const weave::LoomLayout layout = lay_out(c);
  weave::EngineOptions options;
  options.skin = 0.3 * layout.fiber_diameter;
  auto [start, at_start] = set_up_loom(c, layout);
  auto [model, state] = weave::Engine(std::move(start), std::move(at_start), options).release();
  insert_weft(c, layout, 0, model, state);
  EXPECT_EQ(check_order(c, layout, model, state).violations, 0);
  for (std::size_t p = 0; p < model.nodes(); ++p) {
    if (model.role[model.fiber_of[p]] == weave::Role::weft) state.x[p].z() += c.loom.height;  // over the raised warp
  }
  const weave::OrderCheck swapped = check_order(c, layout, model, state);
  EXPECT_EQ(swapped.violations, 1);  // the first row raises one of the three warps
  EXPECT_THAT(swapped.first, HasSubstr("warp 1 lies under weft 1"));
}

TEST(guard, warp_that_doubles_back_passes_over_what_lies_inside_its_bend) {
  // A binder beaten up beyond its own ascent: from the lower left it rises leaning back and goes on to the right.
  Scene scene = empty_scene(glass_fiber());
  add(scene, chain_through({Vec3(-5, 0, -1), Vec3(1, 0, -1), Vec3(-1, 0, 1), Vec3(5, 0, 1)}));
  const auto side = [&](double x, double z) { return passes_over(scene.model, scene.state.x, 0, Vec3(x, 0, z)); };
  EXPECT_EQ(side(-0.5, 0), -1);  // left of the ascent, between the two bends
  EXPECT_EQ(side(0.5, 0), 1);    // right of it
  EXPECT_EQ(side(0, 2), -1);
  EXPECT_EQ(side(0, -2), 1);
  EXPECT_EQ(side(6, 0), 0);  // beyond the fiber's end
}

}  // namespace
