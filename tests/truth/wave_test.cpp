#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;
constexpr double pi = std::numbers::pi;

/// Amplitude of a mode in the displacements along an axis after each of four steps.
std::array<double, 4> amplitudes(Scene scene, int axis, const std::vector<Vec3>& rest, auto&& shape, double dt) {
  scene.options.time_step = dt;
  weave::Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  std::array<double, 4> a{};
  for (double& amplitude : a) {
    engine.step(drive);
    for (std::size_t p = 0; p < rest.size(); ++p) {
      amplitude += scene.model.mass[p] * shape(p) * (engine.state().x[p][axis] - rest[p][axis]);
    }
  }
  return a;
}

/// Frequency in the limit of small steps: leapfrog turns w^2 into (2 - (a0 + a2)/a1) / dt^2 exactly.
double leapfrog_frequency(const std::array<double, 4>& a, double dt) {
  return std::sqrt(2 - (a[0] + a[2]) / a[1]) / dt;
}

/// Frequency of a damped oscillation from a2 = p a1 - q a0, a3 = p a2 - q a1.
double damped_frequency(const std::array<double, 4>& a, double dt) {
  const double det = a[1] * a[1] - a[0] * a[2];
  const double p = (a[2] * a[1] - a[0] * a[3]) / det, q = (a[2] * a[2] - a[1] * a[3]) / det;
  return std::acos(0.5 * p / std::sqrt(q)) / dt;
}

TEST(bar_wave, free_chain_has_the_discrete_frequency) {
  // w = (2c/l) sin(kl/2) with kl = n pi/N: half masses at the free ends make cosines its modes.
  const auto type = glass_fiber();
  const int bars = 24;
  const double length = 24e-4, l = length / bars, c = std::sqrt(type.youngs_modulus / type.density);
  for (const bool implicit_axial : {false, true}) {
    for (const int n : {1, 5, 24}) {
      Scene scene = empty_scene(type);
      add(scene, chain(Vec3(-0.5 * length, 0, 0), Vec3(0.5 * length, 0, 0), bars));
      scene.model.implicit_axial = implicit_axial;
      const auto shape = [&](std::size_t p) { return std::cos(n * pi * static_cast<double>(p) / bars); };
      const std::vector<Vec3> rest = scene.state.x;
      for (std::size_t p = 0; p < rest.size(); ++p) scene.state.x[p].x() += 1e-3 * l * shape(p);
      const double truth = 2 * c / l * std::sin(n * pi / (2.0 * bars));
      const double dt = 0.1 / truth;
      const auto measured = [&](double step) { return amplitudes(scene, 0, rest, shape, step); };
      if (!implicit_axial) {
        EXPECT_NEAR(leapfrog_frequency(measured(dt), dt) / truth, 1, 1e-9) << n;  // exact: round-off of differences of amplitudes 1e-3 l
      } else {
        // The implicit scheme damps; its frequency is off by the square of the step: Richardson.
        const double coarse = damped_frequency(measured(dt), dt), fine = damped_frequency(measured(dt / 2), dt / 2);
        EXPECT_NEAR((4 * fine - coarse) / 3 / truth, 1, 1e-4) << n;  // of fourth order in dt w = 0.1
        EXPECT_NEAR(std::log2((coarse - truth) / (fine - truth)), 2, 0.1) << n;
      }
    }
  }
}

TEST(string, has_the_discrete_frequency) {
  // w_n = 2 sqrt(T/(m l)) sin(n pi / 2N), both ends held.
  const auto type = glass_fiber();
  const int bars = 20;
  const double length = 2e-3, l = length / bars, strain = 1e-3;
  for (const bool implicit_axial : {false, true}) {
    for (const int n : {1, 3, 19}) {
      Scene scene = empty_scene(type);
      auto fiber = chain(Vec3::Zero(), Vec3(length, 0, 0), bars, strain);
      fiber.hold_first = true;
      add(scene, fiber);
      scene.model.inverse_mass.back() = 0;
      scene.model.implicit_axial = implicit_axial;
      const auto shape = [&](std::size_t p) { return std::sin(n * pi * static_cast<double>(p) / bars); };
      const std::vector<Vec3> rest = scene.state.x;
      for (std::size_t p = 0; p < rest.size(); ++p) scene.state.x[p].z() = 1e-5 * l * shape(p);
      const double tension = type.youngs_modulus * type.area * strain;
      const double truth = 2 * std::sqrt(tension / (scene.model.mass[1] * l)) * std::sin(n * pi / (2.0 * bars));
      const double dt = std::min(0.1 / truth, 0.5 * l / std::sqrt(type.youngs_modulus / type.density));  // explicit bars
      // Amplitude 1e-5 l stretches the bars by 1e-10 of the 1e-3 they have: 1e-7 of the tension at most.
      EXPECT_NEAR(leapfrog_frequency(amplitudes(scene, 2, rest, shape, dt), dt) / truth, 1, 1e-6) << n << implicit_axial;
    }
  }
}

TEST(integrators, agree_as_the_step_goes_to_zero) {
  // A bent, stretched fiber let go: the implicit scheme damps axial waves in proportion to the step.
  const auto run = [](bool implicit_axial, double dt) {
    weave::FiberType type = glass_fiber();
    type.bending_stiffness = 1e-10;
    Scene scene = empty_scene(type);
    auto fiber = chain(Vec3::Zero(), Vec3(2e-3, 0, 0), 16, 2e-3);
    fiber.hold_first = true;
    add(scene, fiber);
    scene.model.inverse_mass.back() = 0;
    scene.model.implicit_axial = implicit_axial;
    for (std::size_t p = 0; p < 17; ++p) scene.state.x[p] += Vec3(5e-7, 0, 5e-5) * std::sin(pi * static_cast<double>(p) / 16);
    scene.options.time_step = dt;
    weave::Engine engine = scene.engine();
    const weave::Drive drive = at_rest(scene.model);
    for (int i = 0, n = static_cast<int>(std::lround(2e-6 / dt)); i < n; ++i) engine.step(drive);
    return engine.state().x;
  };
  double difference[3];
  for (int i = 0; i < 3; ++i) {
    const double dt = 2e-9 / (1 << i);
    const auto a = run(false, dt), b = run(true, dt);
    difference[i] = 0;
    for (std::size_t p = 0; p < a.size(); ++p) difference[i] = std::max(difference[i], (a[p] - b[p]).norm());
  }
  EXPECT_LT(difference[2], 1e-2 * 5e-5);  // of the deflection
  EXPECT_NEAR(std::log2(difference[1] / difference[2]), 1, 0.3);
}

/// Largest speed of a taut chain's nodes, over that at the start, after 2000 chosen explicit steps; it begins in its fastest swing, every
/// node against its neighbors.
double swing_left(double axial_damping) {
  Scene scene = empty_scene(glass_fiber());
  scene.model.implicit_axial = false;
  scene.model.axial_damping = axial_damping;
  scene.options.safety = 0.99;
  constexpr int bars = 40;
  constexpr double speed = 1e-3;
  weave::FiberSpec fiber = chain(Vec3::Zero(), Vec3(4e-3, 0, 0), bars, 1e-3);
  fiber.hold_first = true;
  add(scene, fiber);
  scene.model.inverse_mass.back() = 0;
  for (int k = 1; k < bars; ++k) scene.state.v[k].x() = k % 2 == 0 ? speed : -speed;
  weave::Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  for (int i = 0; i < 2000; ++i) engine.step(drive);
  double most = 0;
  for (const Vec3& v : engine.state().v) most = std::max(most, v.norm());
  return most / speed;
}

TEST(damped_bars, explicit_steps_near_the_limit_are_stable) {
  EXPECT_LT(swing_left(0), 20);  // a swing of 2 omega sqrt(1 - 0.99^2) and its beat
  for (const double damping : {0.05, 0.1, 0.5, 2.0}) EXPECT_LT(swing_left(damping), 0.1) << damping;
}

/// Largest distance of a towed chain's nodes from the catenary, over the span. Held ends drawn up at a steady speed V through a medium that
/// damps by mass (c m v) hang the chain in a uniform field of strength c V.
double catenary_error(int bars) {
  weave::FiberType type = glass_fiber();
  type.youngs_modulus = 86.9e12;           // does not stretch
  const double span = 2e-3, a = span / 2;  // y = a cosh(x/a)
  const double damping = 1e4, speed = 4;   // the field only scales the tension
  const double length = 2 * a * std::sinh(0.5 * span / a);
  Scene scene = empty_scene(type);
  weave::FiberSpec fiber;
  for (int i = 0; i <= bars; ++i) {
    const double s = length * (static_cast<double>(i) / bars - 0.5);
    fiber.x.emplace_back(a * std::asinh(s / a), 0, a * std::sqrt(1 + s * s / (a * a)));
  }
  fiber.rest_length.assign(bars, length / bars);
  fiber.hold_first = true;
  add(scene, fiber, Vec3(0, 0, speed));
  scene.model.inverse_mass.back() = 0;
  scene.model.damping = damping;
  scene.model.axial_damping = 0.1;
  scene.options.time_step = 2e-7;
  const std::vector<Vec3> start = scene.state.x;
  weave::Engine engine = scene.engine();
  weave::Drive drive = at_rest(scene.model);
  drive.held_velocity = Vec3(0, 0, speed);
  while (engine.state().time < 4e-3) engine.step(drive);
  const double risen = engine.state().x[0].z() - start[0].z();
  double error = 0;
  for (std::size_t p = 0; p < start.size(); ++p) error = std::max(error, (engine.state().x[p] - start[p] - Vec3(0, 0, risen)).norm());
  return error / span;
}

TEST(hanging_chain, converges_to_the_catenary) {
  const double coarse = catenary_error(8), fine = catenary_error(16), finest = catenary_error(32);
  EXPECT_LT(finest, 1e-3);
  EXPECT_NEAR(std::log2(coarse / fine), 2, 0.2);  // bars of length l cut the curve by l^2/8
  EXPECT_NEAR(std::log2(fine / finest), 2, 0.2);
}

}  // namespace
