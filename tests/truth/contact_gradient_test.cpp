#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;
using weave::Engine;
using weave::Ledger;
using weave::Role;

/// Energy of contact, bars and bending, and forces, of a scene at rest with its contact list kept.
struct Evaluation {
  double energy = 0;
  std::vector<Vec3> force;
  std::size_t contacts = 0;  ///< listed
};

Evaluation evaluate(const Scene& scene) {
  Engine engine = scene.engine();
  Ledger ledger;
  engine.step(at_rest(scene.model), &ledger);
  return {ledger.contact + ledger.bending + ledger.bars, engine.force(), engine.state().contacts.line.size()};
}

/// Largest difference of the forces from the energy's central differences, over the largest force.
double gradient_error(Scene scene) {
  scene.options.time_step = 1e-12;
  scene.model.implicit_axial = false;  // so that the engine's forces hold those of the bars
  Engine engine = scene.engine();
  scene.state = engine.state();
  const Evaluation base = evaluate(scene);
  const double h = 1e-7 * 2 * scene.model.types[0].radius;
  double force_max = 0, error = 0;
  for (const Vec3& f : base.force) force_max = std::max(force_max, f.norm());
  for (std::size_t p = 0; p < scene.model.nodes(); ++p) {
    if (scene.model.mass[p] == 0) continue;  // a ghost moves with its image
    for (int axis = 0; axis < 3; ++axis) {
      Scene moved = scene;
      moved.state.x[p][axis] += h;
      const double above = evaluate(moved).energy;
      moved.state.x[p][axis] -= 2 * h;
      const double below = evaluate(moved).energy;
      error = std::max(error, std::abs(base.force[p][axis] + (above - below) / (2 * h)));
    }
  }
  return force_max > 0 ? error / force_max : 0;
}

weave::FiberType soft_bars() {
  weave::FiberType type = glass_fiber();
  type.youngs_modulus = 1;  // so that contact is the larger part
  return type;
}

/// Of central differences with h = 1e-7 d: the force has kinks in its slope at touch (delta^1/2) and at the bounds of the blend.
constexpr double tolerance = 1e-5;

TEST(contact_gradient, crossing_fibers_at_any_angle) {
  const auto type = soft_bars();
  const double d = 2 * type.radius;
  int loaded = 0;
  for (const double degrees : {5.0, 12.0, 19.0, 21.0, 24.0, 28.0, 32.0, 35.0, 37.0, 50.0, 70.0, 90.0}) {
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      std::mt19937_64 random(seed);
      Scene scene = crossing_pair(type, degrees * std::numbers::pi / 180, 5 * d, 3, 0.93 * d);
      for (Vec3& x : scene.state.x) x += 0.06 * d * random_vector(random);
      const double error = gradient_error(scene);
      EXPECT_LT(error, tolerance) << degrees << " degrees, seed " << seed;
      loaded += error > 0;
    }
  }
  EXPECT_GT(loaded, 80);
}

TEST(contact_gradient, node_beside_a_vertex) {
  // The upper fiber's middle node stands in the wedge over the lower one's bend, where the closest point is the vertex.
  const auto type = soft_bars();
  const double d = 2 * type.radius;
  for (const double degrees : {0.0, 15.0, 25.0, 30.0, 34.0}) {
    for (const double side : {-0.02, 0.0, 0.02}) {
      Scene scene = empty_scene(type);
      add(scene, chain_through({Vec3(-2 * d, 0, -0.6 * d), Vec3(0, 0, 0), Vec3(2 * d, 0, -0.5 * d)}, 0));
      const double a = degrees * std::numbers::pi / 180;
      const Vec3 half(2 * d * std::cos(a), 2 * d * std::sin(a), 0);
      const Vec3 middle(side * d, 0.01 * d, 0.9 * d);
      add(scene, chain_through({Vec3(middle - half), middle, Vec3(middle + half)}, 1));
      EXPECT_LT(gradient_error(scene), tolerance) << degrees << " degrees, side " << side;
    }
  }
}

TEST(contact_gradient, many_fibers) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    Scene scene = tangle(soft_bars(), {.fibers = 6, .bars = 5, .box = 3, .clearance = 0.85, .seed = seed});
    EXPECT_LT(gradient_error(scene), tolerance);
  }
}

TEST(contact_gradient, across_the_periodic_faces) {
  const auto type = soft_bars();
  const double d = 2 * type.radius;
  Scene scene = periodic_mesh(type, 6 * d, 3, 3, 0.9 * d, 1.5 * d, 5);
  EXPECT_LT(gradient_error(scene), tolerance);
}

TEST(bending, force_is_the_gradient_of_its_energy) {
  weave::FiberType type = soft_bars();
  type.bending_stiffness = 1e-9;
  std::mt19937_64 random(3);
  const double d = 2 * type.radius;
  Scene scene = empty_scene(type);
  std::vector<Vec3> x;
  for (int i = 0; i < 7; ++i) x.push_back(Vec3(i * 1.3 * d, 0, 0) + 0.3 * d * random_vector(random));
  add(scene, chain_through(x));
  EXPECT_LT(gradient_error(scene), 1e-7);  // smooth energy: round-off of positions over h
}

TEST(bending, straight_fiber_is_at_rest) {
  weave::FiberType type = glass_fiber();
  type.bending_stiffness = 1e-9;
  Scene scene = empty_scene(type);
  add(scene, chain(Vec3::Zero(), Vec3(1e-3, 2e-3, -1e-3), 10));
  scene.options.time_step = 1e-12;
  scene.model.implicit_axial = false;
  double force_max = 0;
  for (const Vec3& f : evaluate(scene).force) force_max = std::max(force_max, f.norm());
  EXPECT_LT(force_max, 1e-9);  // round-off of the bars: E A times 1e-16 is 7e-14 N, of bending EI/l^2 1e-16 less
}

/// A hairpin: two straight legs joined by a half turn of the given radius [R], legs `legs` [R] long, bars shorter than a diameter.
Scene hairpin(double bend_radius, double legs, double leg_distance) {
  const auto type = glass_fiber();
  const double r = type.radius, step = 0.4 * r;
  std::vector<Vec3> x;
  const auto leg_bars = static_cast<int>(legs * r / step);
  for (int i = leg_bars; i > 0; --i) x.emplace_back(-i * step, -0.5 * leg_distance * r, 0);
  const int turn_bars = static_cast<int>(std::ceil(std::numbers::pi * bend_radius * r / step));
  for (int i = 0; i <= turn_bars; ++i) {
    const double angle = std::numbers::pi * (static_cast<double>(i) / turn_bars - 0.5);
    x.emplace_back(bend_radius * r * std::cos(angle), bend_radius * r * std::sin(angle), 0);
  }
  for (int i = 1; i <= leg_bars; ++i) x.emplace_back(-i * step, 0.5 * leg_distance * r, 0);
  Scene scene = empty_scene(type);
  add(scene, chain_through(x));
  scene.options.time_step = 1e-12;
  scene.model.implicit_axial = false;
  return scene;
}

TEST(self_contact, bent_fine_fiber_does_not_push_itself) {
  for (const double bend : {1.05, 1.5, 3.0, 6.0}) {
    double force_max = 0;
    for (const Vec3& f : evaluate(hairpin(bend, 8, 2 * bend)).force) force_max = std::max(force_max, f.norm());
    EXPECT_LT(force_max, 1e-9) << bend;  // round-off of the bars at their rest lengths, E A 1e-16
  }
}

TEST(self_contact, legs_of_a_hairpin_that_touch_push_each_other) {
  const Evaluation e = evaluate(hairpin(1.5, 20, 1.9));
  const auto law = weave::PairLaw::of(5e-5, 5e-5, 1e9, 1e9);
  const double expected = law.line_force(0.1 * 5e-5) * 0.4 * 5e-5;  // on a node far from the bend
  EXPECT_NEAR(e.force[5].y() / -expected, 1, 1e-9);                 // parallel straight legs: the law itself, with bar forces of round-off
}

}  // namespace
