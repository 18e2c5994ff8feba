#include "scenes/belt.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace scenes {

using weave::FiberSpec;
using weave::FiberType;

Scene belt_on_drum(const BeltSpec& spec) {
  const double turn = spec.wrap / spec.rods;
  const double bar = spec.drum_radius * std::sin(0.5 * turn), reach = spec.rod_over_bar * bar;
  FiberType type;
  type.radius = 0.5 * reach;
  type.area = 1e-6;
  type.youngs_modulus = 1e11;
  type.density = 2500;
  // A rod's load T turn presses the belt in by a twentieth: f = (pi/2) E_T delta^2 where R = D/2.
  type.transverse_modulus = spec.tension * turn / (0.5 * std::numbers::pi * std::pow(0.05 * reach, 2));
  Scene scene = empty_scene(type);
  scene.model.friction = spec.friction;
  scene.options.skin = reach;
  const double stiffness = 2 * spec.tension * turn / (0.05 * reach);
  scene.options.time_step = 0.3 * std::sqrt(0.5 * type.density * type.area * bar / stiffness);
  const auto along = [](double angle) { return Vec3(std::cos(angle), std::sin(angle), 0); };
  const auto outward = [](double angle) { return Vec3(-std::sin(angle), std::cos(angle), 0); };
  std::vector<Vec3> x;
  for (int k = 0; k < spec.rods; ++k) {
    const double angle = (spec.rods - k - 0.5) * turn;  // of the bar on rod k
    FiberSpec rod;
    rod.role = weave::Role::reed;
    const Vec3 axis = spec.drum_radius * outward(angle);
    rod.x = {axis - spec.drum_radius * Vec3::UnitZ(), axis + spec.drum_radius * Vec3::UnitZ()};
    rod.rest_length = {2 * spec.drum_radius};
    rod.hold_all = true;
    rod.yarn = -1;
    add(scene, rod);
    const Vec3 middle = axis + reach * outward(angle);
    if (k == 0) x.push_back(middle - 0.5 * bar * along(angle) - bar * along(spec.wrap));
    x.push_back(middle - 0.5 * bar * along(angle));
    x.push_back(middle + 0.5 * bar * along(angle));
    if (k + 1 == spec.rods) x.push_back(x.back() + bar * Vec3::UnitX());
  }
  FiberSpec belt = chain_through(x);
  for (double& rest : belt.rest_length) rest /= 1 + spec.tension / (type.youngs_modulus * type.area);
  belt.hold_first = true;
  belt.end_force = spec.tension;
  add(scene, belt);
  return scene;
}

DrawnBelt draw_belt(Scene scene, const BeltSpec& spec) {
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
      if (report.status != weave::StepStatus::ok) throw std::runtime_error(report.message);
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
  DrawnBelt result;
  for (int k = 0; k < spec.rods; ++k) {
    const std::uint32_t on_rod = first + 1 + 2 * k;
    const double tight = engine.tension()[on_rod - 1], slack = engine.tension()[on_rod + 1];
    const double at_tight = direction(on_rod - 1) - direction(on_rod), at_slack = direction(on_rod) - direction(on_rod + 1);
    const double mu = spec.friction;
    const double law = (std::cos(at_slack) + mu * std::sin(at_slack)) / (std::cos(at_tight) - mu * std::sin(at_tight));
    result.law_error = std::max(result.law_error, std::abs(tight / slack / law - 1));
  }
  result.ratio = engine.tension()[first] / engine.tension()[m.last(belt) - 1];
  result.steps = engine.state().step;
  return result;
}

}  // namespace scenes
