#include <gtest/gtest.h>

#include <numbers>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;
using weave::Touch;

TEST(spared_overlap, is_what_motion_does_not_explain) {
  Touch touch;
  touch.note(0.1, 0.2);
  EXPECT_FLOAT_EQ(touch.overlap, 0.1F);
  EXPECT_EQ(touch.spared, 0);
  touch.note(0.5, 0.2);  // another place: what has pushed so far goes on to
  EXPECT_FLOAT_EQ(touch.overlap - touch.spared, 0.1F);
  touch.note(0.6, 0.65);
  EXPECT_FLOAT_EQ(touch.overlap - touch.spared, 0.2F);
  touch.note(0.3, 0.65);  // drawn out
  EXPECT_FLOAT_EQ(touch.spared, 0.3F);
  touch.note(0.35, 0.4);
  EXPECT_NEAR(touch.overlap - touch.spared, 0.05, 1e-7);
  touch.note(-0.1, 0.4);
  EXPECT_FALSE(touch.is_held());
  EXPECT_EQ(touch.spared, 0);
}

/// The upper of two crossing fibers is found inside the lower one, where no motion has brought it, and then thrown further down.
TEST(spared_overlap, makes_no_energy) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius, speed = 1, found = 0.25 * d;
  for (const double friction : {0.0, 0.3}) {
    SCOPED_TRACE(friction);
    Scene scene = crossing_pair(type, std::numbers::pi / 2, 6 * d, 6, 1.05 * d);
    scene.model.friction = friction;
    scene.options.time_step = 2e-9;
    const weave::Drive drive = at_rest(scene.model);
    weave::Engine apart = scene.engine();
    ASSERT_EQ(apart.step(drive).status, weave::StepStatus::ok);
    scene.state = apart.state();
    const std::size_t upper = scene.model.first[1], end = scene.model.first[2];
    for (std::size_t p = upper; p < end; ++p) scene.state.x[p].z() -= found + 0.05 * d;

    weave::Engine inside = scene.engine();
    weave::Ledger ledger;
    ASSERT_EQ(inside.step(drive, &ledger).status, weave::StepStatus::ok);
    EXPECT_EQ(ledger.contact, 0);
    for (const Vec3& force : inside.force()) EXPECT_EQ(force.norm(), 0);

    scene.state = inside.state();
    for (std::size_t p = upper; p < end; ++p) scene.state.v[p].z() = -speed;
    weave::Engine thrown = scene.engine();
    thrown.step(drive, &ledger);
    const double energy = ledger.balance();
    EXPECT_GT(energy, 0);
    double pushed = 0, overlap = 0;
    const auto height = [&] { return thrown.state().x[upper + 3].z() - thrown.state().x[3].z(); };
    for (int i = 0; i < 100000 && height() < 1.05 * d; ++i) {
      const weave::StepReport report = thrown.step(drive, &ledger);
      ASSERT_EQ(report.status, weave::StepStatus::ok) << report.message;
      pushed = std::max(pushed, ledger.contact);
      overlap = std::max(overlap, report.overlap_max);
      EXPECT_NEAR(ledger.balance(), energy, 1e-2 * energy);
      if (HasFailure()) return;
    }
    EXPECT_GT(height(), d) << "the fibers are meant to part";
    EXPECT_GT(pushed, 0.05 * energy);
    EXPECT_GT(overlap, found / d);
  }
}

}  // namespace
