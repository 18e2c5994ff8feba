#include <gtest/gtest.h>
#include <omp.h>

#include <bit>
#include <cstdint>

#include "scenes/scenes.hpp"

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
  for (const weave::FrictionSpring& f : s.contacts.active.spring) bits.push_back(std::bit_cast<std::uint64_t>(f.along));
  for (const double d : {s.dt, s.time, s.flows.slip, s.flows.damping}) bits.push_back(std::bit_cast<std::uint64_t>(d));
  return bits;
}

std::vector<std::uint64_t> bits_after(const Scene& scene, int threads, int steps) {
  const int before = omp_get_max_threads();
  omp_set_num_threads(threads);
  weave::Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  for (int i = 0; i < steps; ++i) engine.step(drive);
  omp_set_num_threads(before);
  EXPECT_GT(engine.state().searches, 2);
  return bits_of(engine.state());
}

TEST(determinism, bits_do_not_depend_on_the_number_of_threads) {
  weave::FiberType type = glass_fiber();
  type.bending_stiffness = 1e-10;
  Scene scene = tangle(type, {.fibers = 30, .bars = 10, .box = 12, .speed = 20, .spin = 3000});
  scene.model.friction = 0.3;
  scene.model.axial_damping = 0.05;
  scene.options.time_step_max = 1e-7;
  const auto one = bits_after(scene, 1, 500);
  EXPECT_EQ(one, bits_after(scene, 2, 500));
  EXPECT_EQ(one, bits_after(scene, 8, 500));
}

}  // namespace
