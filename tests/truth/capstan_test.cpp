#include <gtest/gtest.h>

#include <cmath>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;

struct BeltResult {
  double ratio = 0;      ///< of the tensions at the two ends
  double law_error = 0;  ///< largest relative error of one rod's discrete law
};

/// Draws the belt over the drum until it slips on every rod, then ever slower. A bar on a rod turns the belt by b1 before and b2 after it.
/// Along and across that bar, T2 cos b2 - T1 cos b1 = mu N and T1 sin b1 + T2 sin b2 = N give the discrete law
/// T2/T1 = (cos b1 + mu sin b1)/(cos b2 - mu sin b2), with b1 = b2 the law of numerics' table.
BeltResult draw(const BeltSpec& spec) {
  Scene scene = belt_on_drum(spec);
  scene.model.damping = 4e3;
  scene.model.axial_damping = 0.1;
  weave::Engine engine = scene.engine();
  weave::Drive drive = at_rest(scene.model);
  const double reach = 2 * scene.model.types[0].radius;
  const auto pull = [&](double speed, double time) {
    drive.held_velocity = -speed * Vec3(std::cos(spec.wrap), std::sin(spec.wrap), 0);
    const double end = engine.state().time + time;
    while (engine.state().time < end) {
      const weave::StepReport report = engine.step(drive);
      ASSERT_EQ(report.status, weave::StepStatus::ok) << report.message;
    }
  };
  pull(0, 5e-3);
  pull(15 * reach, 1e-2);  // by 0.15 of the reach; the springs give way after a fortieth
  pull(1 * reach, 5e-3);
  pull(0.02 * reach, 5e-3);

  const weave::Model& m = engine.model();
  const auto belt = static_cast<std::uint32_t>(m.fibers() - 1);
  const std::uint32_t first = m.first[belt];
  const auto& x = engine.state().x;
  const auto direction = [&](std::uint32_t bar) {
    const Vec3 r = x[bar + 1] - x[bar];
    return std::atan2(r.y(), r.x());
  };
  BeltResult result;
  for (int k = 0; k < spec.rods; ++k) {
    const std::uint32_t on_rod = first + 1 + 2 * k;
    const double tight = engine.tension()[on_rod - 1], slack = engine.tension()[on_rod + 1];
    const double at_tight = direction(on_rod - 1) - direction(on_rod), at_slack = direction(on_rod) - direction(on_rod + 1);
    const double mu = spec.friction;
    const double law = (std::cos(at_slack) + mu * std::sin(at_slack)) / (std::cos(at_tight) - mu * std::sin(at_tight));
    result.law_error = std::max(result.law_error, std::abs(tight / slack / law - 1));
  }
  result.ratio = engine.tension()[first] / engine.tension()[m.last(belt) - 1];
  return result;
}

TEST(capstan, each_rod_keeps_the_discrete_law_and_the_drum_converges_to_the_exponential) {
  BeltSpec spec;
  const double truth = std::exp(spec.friction * spec.wrap);
  double error[3];
  for (int i = 0; i < 3; ++i) {
    spec.rods = 4 << i;
    spec.rod_over_bar = 0.02 / (1 << i);  // so that the rods' thickness, a first-order error, vanishes too
    const BeltResult result = draw(spec);
    // The samples of a crossing push along the fiber by up to 0.01 of the normal force, as measured in friction_path_test.
    EXPECT_LT(result.law_error, 0.01 * spec.wrap / spec.rods) << spec.rods;
    error[i] = std::abs(result.ratio / truth - 1);
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 2, 0.3);
  EXPECT_NEAR(std::log2(error[1] / error[2]), 2, 0.3);
  EXPECT_LT(error[2], 2e-3);
}

}  // namespace
