#include <gtest/gtest.h>

#include <cmath>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;
using weave::Engine;
using weave::Ledger;

class momentum_of_a_tangle : public testing::TestWithParam<bool> {};

TEST_P(momentum_of_a_tangle, is_kept_with_contact_and_friction) {
  weave::FiberType type = glass_fiber();
  type.bending_stiffness = 1e-10;
  Scene scene = tangle(type, {.fibers = 10, .bars = 8, .box = 8, .speed = 8, .spin = 3000});
  scene.model.friction = 0.4;
  scene.model.axial_damping = 0.05;
  scene.model.implicit_axial = GetParam();
  scene.options.time_step = GetParam() ? 3e-8 : 8e-9;
  Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  const Momentum before = momentum(engine);
  bool touched = false;
  const double end = 6e-5;
  while (engine.state().time < end) {
    const weave::StepReport report = engine.step(drive);
    ASSERT_EQ(report.status, weave::StepStatus::ok) << report.message;
    touched = touched || report.overlap_max > 1e-3;
  }
  EXPECT_TRUE(touched);
  EXPECT_GT(engine.state().flows.slip, 0);
  const Momentum after = momentum(engine);
  // Every force has its reaction: only round-off, which grows with the root of the number of steps.
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear_scale);
  EXPECT_LT((after.angular - before.angular).norm(), 1e-12 * before.angular_scale);
}

INSTANTIATE_TEST_SUITE_P(integrators, momentum_of_a_tangle, testing::Values(false, true),
                         [](const auto& test) { return test.param ? "imex" : "explicit_axial"; });

struct LedgerCase {
  const char* name;
  bool implicit_axial;
  double friction;
  double time_step;
};

/// Largest change of the ledger's balance over the kinetic energy at the start.
double ledger_error(const LedgerCase& c, double time_step) {
  weave::FiberType type = glass_fiber();
  type.bending_stiffness = 1e-10;
  Scene scene = colliding_layers(type, 3, 4);
  scene.model.friction = c.friction;
  scene.model.implicit_axial = c.implicit_axial;
  scene.options.time_step = time_step;
  Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  Ledger ledger;
  engine.step(drive, &ledger);
  const double start = ledger.balance(), scale = ledger.kinetic;
  double error = 0;
  while (engine.state().time < 2.5e-5) {
    engine.step(drive, &ledger);
    error = std::max(error, std::abs(ledger.balance() - start));
  }
  EXPECT_GT(ledger.flows.slip + (c.friction == 0), 0);
  return error / scale;
}

class ledger_of_a_collision : public testing::TestWithParam<LedgerCase> {};

TEST_P(ledger_of_a_collision, closes_at_second_order) {
  const LedgerCase c = GetParam();
  const double coarse = ledger_error(c, c.time_step), fine = ledger_error(c, c.time_step / 4);
  const double order = std::log2(coarse / fine) / 2;
  RecordProperty("order", std::to_string(order));
  EXPECT_LT(fine, 1e-4);
  EXPECT_GT(order, 1.6);  // 2 but for touching and parting, where the force is not smooth
}

INSTANTIATE_TEST_SUITE_P(cases, ledger_of_a_collision,
                         testing::Values(LedgerCase{"explicit_smooth", false, 0, 8e-9}, LedgerCase{"imex_smooth", true, 0, 2e-8},
                                         LedgerCase{"explicit_friction", false, 0.3, 8e-9}, LedgerCase{"imex_friction", true, 0.3, 2e-8}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
