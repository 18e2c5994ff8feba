#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "regression/busy_tangle.hpp"

namespace {

using namespace scenes;

std::vector<std::uint64_t> bits_of(const weave::State& s) {
  std::vector<std::uint64_t> bits;
  const auto add_all = [&](const std::vector<Vec3>& a) {
    for (const Vec3& x : a) {
      for (int i = 0; i < 3; ++i) bits.push_back(std::bit_cast<std::uint64_t>(x[i]));
    }
  };
  add_all(s.x);
  add_all(s.v);
  for (const weave::ActiveContacts* contacts : {&s.contacts.active, &s.contacts.on_reed}) {
    for (const weave::Touch& t : contacts->touch) {
      for (const double force : {t.along, t.across}) bits.push_back(std::bit_cast<std::uint64_t>(force));
    }
  }
  for (const double d : {s.dt, s.time, s.flows.slip, s.flows.damping}) bits.push_back(std::bit_cast<std::uint64_t>(d));
  return bits;
}

std::vector<std::uint64_t> bits_after(const Scene& scene, int threads, int steps, const Vec3& reed_velocity = Vec3::Zero()) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(threads);
  weave::Engine engine = scene.engine();
  weave::Drive drive = at_rest(scene.model);
  drive.reed_velocity = reed_velocity;
  for (int i = 0; i < steps; ++i) {
    const weave::StepReport report = engine.step(drive);
    EXPECT_EQ(report.status, weave::StepStatus::ok) << report.message;
    if (report.status != weave::StepStatus::ok) break;
  }
  omp_set_num_threads(before);
  const auto& on_reed = engine.state().contacts.on_reed.touch;
  if (reed_velocity.isZero()) {
    EXPECT_GT(engine.state().searches, 2);
  } else {
    EXPECT_TRUE(std::ranges::any_of(on_reed, &weave::Touch::is_held));
  }
  return bits_of(engine.state());
}

/// A yarn of seven along y is pushed by a reed bar along a yarn of seven along x, which it lies on.
Scene pushed_yarn(const weave::FiberType& type) {
  const double d = 2 * type.radius;
  Scene scene = empty_scene(type);
  scene.model.friction = 0.3;
  scene.options.time_step_max = 1e-7;
  weave::FiberSpec bar = chain(Vec3(-3.2 * d, 4 * d, -6 * d), Vec3(-3.2 * d, 4 * d, 6 * d), 1);
  bar.role = weave::Role::reed;
  add(scene, bar);
  for (int yarn = 0; yarn < 2; ++yarn) {
    for (int k = 0; k < 7; ++k) {
      const double angle = k * std::numbers::pi / 3, r = k == 6 ? 0 : 0.98 * d;
      const double side = r * std::cos(angle), up = r * std::sin(angle) + (yarn == 0 ? 0 : 2.71 * d), half = 8 * d;
      weave::FiberSpec fiber = yarn == 0 ? chain(Vec3(-half, side, up), Vec3(half, side, up), 12, 0, yarn)
                                         : chain(Vec3(side, -half, up), Vec3(side, half, up), 12, 0, yarn);
      fiber.place = k;
      if (yarn == 1) fiber.role = weave::Role::weft;
      add(scene, fiber);
    }
  }
  return scene;
}

TEST(determinism, bits_do_not_depend_on_the_number_of_threads) {
  const Scene scene = busy_tangle();
  const auto one = bits_after(scene, 1, 500);
  EXPECT_EQ(one, bits_after(scene, 2, 500));
  EXPECT_EQ(one, bits_after(scene, 8, 500));
}

TEST(determinism, nor_do_those_of_yarns_and_reed) {
  const Scene scene = pushed_yarn(glass_fiber());
  const Vec3 reed_velocity(3, 0, 0);
  const auto one = bits_after(scene, 1, 600, reed_velocity);
  EXPECT_EQ(one, bits_after(scene, 2, 600, reed_velocity));
  EXPECT_EQ(one, bits_after(scene, 8, 600, reed_velocity));
  // Within a parallel region the engine gets one thread, for the shares of all.
  std::vector<std::uint64_t> inside;
#pragma omp parallel num_threads(2)
#pragma omp single
  inside = bits_after(scene, 8, 600, reed_velocity);
  EXPECT_EQ(one, inside);
}

TEST(determinism, nothing_to_touch_is_no_error) {
  const Scene nothing = empty_scene(glass_fiber());
  Scene reed = nothing;
  weave::FiberSpec bar = chain(Vec3(0, 0, -1e-3), Vec3(0, 0, 1e-3), 1);
  bar.role = weave::Role::reed;
  add(reed, bar);
  for (const Scene& scene : {nothing, reed}) {
    weave::Engine engine = scene.engine();
    weave::Drive drive = at_rest(scene.model);
    drive.reed_velocity = Vec3(1, 0, 0);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(engine.step(drive).status, weave::StepStatus::ok);
  }
}

}  // namespace
