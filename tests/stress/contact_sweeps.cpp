#include "stress/contact_sweeps.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "weave/fiber_path.hpp"
#include "weave/loom.hpp"

namespace stress {
namespace {

using scenes::Scene;
using weave::Model;
using weave::Vec3;

constexpr std::int64_t steps_most = 2000000;
constexpr int order_checks = 20;  ///< in the course of a scene
// A quarter of what the loom takes: there a light touch is over in a few steps, and its ledger is open by tenths of the touch's own energy.
constexpr double safety = 0.2;
constexpr double motion_share = 0.00375;  ///< of the smallest diameter or bar
constexpr double step_share = 0.0125;
constexpr double skin_share = 0.25;  ///< of the largest diameter
constexpr double ledger_limit = 0.03;

constexpr int narrow_bars = 6;  ///< of the weft in a narrow cell, as the loom gives it at least

using Nodes = std::vector<Vec3>;
using WrongOrder = std::function<int(const Model&, const Nodes&)>;

/// Height of bar p over bar q where they cross in the view along z; empty where they do not.
std::optional<double> height_over(const Nodes& x, std::uint32_t p, std::uint32_t q) {
  const auto cross = [](const Vec3& a, const Vec3& b) { return a.x() * b.y() - a.y() * b.x(); };
  const Vec3 u = x[p + 1] - x[p], v = x[q + 1] - x[q], w = x[q] - x[p];
  const double det = cross(u, v);
  if (det == 0) return std::nullopt;
  const double s = cross(w, v) / det, t = cross(w, u) / det;
  if (s < 0 || s > 1 || t < 0 || t > 1) return std::nullopt;
  return x[p].z() + s * u.z() - x[q].z() - t * v.z();
}

/// Crossings of yarn 1 over yarn 0, seen along z, at which it lies below.
int wrong_crossings(const Model& m, const Nodes& x) {
  int wrong = 0;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    for (std::uint32_t g = 0; g < m.fibers(); ++g) {
      if (m.yarn[f] != 1 || m.yarn[g] != 0) continue;
      for (std::uint32_t p = m.first[f]; p < m.last(f); ++p) {
        for (std::uint32_t q = m.first[g]; q < m.last(g); ++q) wrong += height_over(x, p, q).value_or(1) < 0;
      }
    }
  }
  return wrong;
}

/// Of two parallel yarns: 1 if the mean of yarn 1 lies below that of yarn 0.
int wrong_side(const Model& m, const Nodes& x) {
  double height = 0;
  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
    const std::uint32_t f = m.fiber_of[p];
    height += (m.yarn[f] == 1 ? 1 : -1) * x[p].z();
  }
  return height < 0 ? 1 : 0;
}

/// The weft, fiber 1, is to lie over the warp, fiber 0.
int weft_below(const Model& m, const Nodes& x) {
  return passes_over(m, x, 0, periodic_fiber_at_y(m, x, 1, x[m.first[0]].y())) > 0 ? 1 : 0;
}

/// Steps until the yarns have met and parted, or for `duration` [s]. While they touch, half of the energy of a contact that is met in a few
/// steps goes to and fro in the ledger of a leapfrog: what counts is what is missing at the end.
Outcome run(const Scene& scene, double duration, const WrongOrder& wrong_order) {
  weave::Engine engine = scene.engine();
  const weave::Drive drive = scenes::at_rest(scene.model);
  Outcome o;
  weave::Ledger ledger;
  double balance = 0, in_play = 0;
  double next_check = 0;
  bool met = false;
  while (engine.state().time < duration) {
    const weave::StepReport report = engine.step(drive, &ledger);
    o.steps = engine.state().step;
    o.overlap_max = std::max(o.overlap_max, report.overlap_max);
    if (report.status != weave::StepStatus::ok) {
      o.message = report.message;
      return o;
    }
    if (o.steps == 1) balance = ledger.balance();
    in_play = std::max({in_play, ledger.kinetic + ledger.contact + ledger.friction_store, std::abs(ledger.put_in())});
    if (met && ledger.contact == 0) break;
    met = met || ledger.contact > 0;
    if (engine.state().time >= next_check) {
      next_check += duration / order_checks;
      o.wrong_order = std::max(o.wrong_order, wrong_order(engine.model(), engine.state().x));
    }
    if (o.steps >= steps_most) {
      o.message = "the time step became too small to reach the end";
      return o;
    }
  }
  o.ledger_error = std::abs(ledger.balance() - balance) / in_play;
  o.late_searches = engine.state().late_searches;
  o.completed = true;
  return o;
}

/// Diameters and the length of a bar [m].
void set_options(double smallest, double largest, double bar, Scene& scene) {
  scene.options.skin = skin_share * largest;
  scene.options.safety = safety;
  scene.options.motion_max = motion_share * std::min(smallest, bar);
  scene.options.time_step_max = step_share * smallest;
}

/// Adds a yarn whose fibers run along a unit vector in the plane z = const, its middle at height z [m].
void add_yarn(const FallingYarn& spec, std::uint16_t type, int yarn, double angle, double z, double length, int bars, const Vec3& velocity,
              Scene& scene) {
  const double radius = scene.model.types[type].radius;
  const Vec3 along(std::cos(angle), std::sin(angle), 0), across(-std::sin(angle), std::cos(angle), 0);
  const double strain = yarn == 0 ? spec.tension / (scene.model.types[type].youngs_modulus * scene.model.types[type].area) : 0;
  int place = 0;
  for (const Eigen::Vector2d& p : weave::bundle_section(spec.fibers, radius, 2 * spec.gap_within * radius, 1e300)) {
    const Vec3 middle = p.x() * across + Vec3(0, 0, z + p.y());
    weave::FiberSpec fiber = scenes::chain(middle - 0.5 * length * along, middle + 0.5 * length * along, bars, strain, yarn);
    fiber.type = type;
    fiber.place = place++;
    fiber.role = yarn == 0 ? weave::Role::warp : weave::Role::weft;
    if (yarn == 0 && spec.tension > 0) {
      fiber.hold_first = true;
      fiber.end_force = spec.tension;
    }
    scenes::add(scene, fiber, velocity);
  }
}

}  // namespace

scenes::Scene falling_yarn(const FallingYarn& spec) {
  weave::FiberType lower = scenes::glass_fiber(spec.lower_radius);
  lower.youngs_modulus = spec.modulus_ratio * lower.transverse_modulus;
  weave::FiberType upper = lower;
  upper.radius *= spec.radius_ratio;
  upper.area *= spec.radius_ratio * spec.radius_ratio;
  Scene scene = scenes::empty_scene(lower);
  weave::add_type(scene.model, upper);
  weave::finish_types(scene.model);
  scene.model.friction = spec.friction;
  const double d = 2 * upper.radius;
  set_options(std::min(d, 2 * lower.radius), std::max(d, 2 * lower.radius), spec.bar * d, scene);
  const double length = std::max(spec.length, 2 * spec.bar) * d;
  const auto bars = static_cast<int>(std::lround(length / (spec.bar * d)));
  const auto half_height = [&](const weave::FiberType& type) {
    double high = 0;
    for (const auto& p : weave::bundle_section(spec.fibers, type.radius, 2 * spec.gap_within * type.radius, 1e300))
      high = std::max(high, p.y());
    return high + type.radius;
  };
  add_yarn(spec, 0, 0, 0, 0, length, bars, Vec3::Zero(), scene);
  const double z = half_height(lower) + half_height(upper) + spec.gap * d;
  add_yarn(spec, 1, 1, spec.angle, z, length, bars, -spec.speed * Vec3::UnitZ(), scene);
  return scene;
}

Outcome run(const FallingYarn& spec) {
  const double duration = spec.fall * 2 * spec.radius_ratio * spec.lower_radius / (spec.speed > 0 ? spec.speed : 5);
  return run(falling_yarn(spec), duration, spec.angle == 0 ? WrongOrder(wrong_side) : WrongOrder(wrong_crossings));
}

Outcome run_narrow_cell(double width) {
  const weave::FiberType type = scenes::glass_fiber();
  const double d = 2 * type.radius;
  Scene scene = scenes::empty_scene(type);
  scene.model.friction = 0.2;
  scene.model.period_y = width * d;
  set_options(d, d, width * d / narrow_bars, scene);
  scenes::add(scene, scenes::chain(Vec3(-3 * d, 0.5 * width * d, 0), Vec3(3 * d, 0.5 * width * d, 0), 6, 0, 0));
  weave::FiberSpec weft;
  weft.role = weave::Role::weft;
  weft.periodic = true;
  weft.yarn = 1;
  for (int i = 0; i < narrow_bars; ++i) weft.x.emplace_back(0.1 * d, (i + 0.5) * width * d / narrow_bars, 1.02 * d);
  weft.rest_length.assign(narrow_bars, width * d / narrow_bars);
  scenes::add(scene, weft, Vec3(0, 0, -4.5));
  return run(scene, 3 * d / 4.5, weft_below);
}

std::vector<Sweep> contact_sweeps(Extent extent) {
  std::vector<Sweep> sweeps;
  const auto add = [&](const char* quantity, const char* unit, const char* scene, std::vector<double> values, const auto& set) {
    sweeps.push_back({quantity, unit, scene, std::move(values), ledger_limit, [set](double value) {
                        FallingYarn spec;
                        set(value, spec);
                        return run(spec);
                      }});
  };
  add("impact speed", "m/s", "fiber on fiber", pick(extent, {0.5, 50}, {0.05, 0.5, 5, 20, 50, 100, 200, 500, 1000}),
      [](double v, FallingYarn& s) { s.speed = v; });
  add("friction", "", "fiber on fiber, slanting", pick(extent, {0, 0.5, 2}, {0, 0.1, 0.5, 1, 2, 5, 10}), [](double v, FallingYarn& s) {
    s.friction = v;
    s.angle = 0.4;
  });
  add("tension", "N", "fiber on a taut fiber", pick(extent, {0.01, 1000}, {0.001, 0.01, 0.1, 1, 10, 100, 1000, 10000}),
      [](double v, FallingYarn& s) {
        s.tension = v;
        s.lower_radius = 2e-4;
      });
  add("E/E_T", "", "yarn of 3 on yarn of 3", pick(extent, {1, 100, 1e4}, {0.1, 1, 10, 100, 1e3, 1e4, 1e5, 1e6}),
      [](double v, FallingYarn& s) {
        s.modulus_ratio = v;
        s.fibers = 3;
      });
  add("ratio of radii", "", "fine yarn of 3 on coarse yarn of 3", pick(extent, {0.1, 1}, {0.01, 0.02, 0.05, 0.1, 0.3, 1}),
      [](double v, FallingYarn& s) {
        s.radius_ratio = v;
        s.fibers = 3;
        s.length = 6 / v;
        s.bar = 1 / v;
      });
  add("fibers a yarn", "", "yarn on yarn", pick(extent, {1, 19, 169}, {1, 3, 5, 7, 19, 37, 61, 91, 127, 169, 271}),
      [](double v, FallingYarn& s) {
        s.fibers = static_cast<int>(v);
        s.length = 8;
        s.bar = 2;
        s.fall = 1;
      });
  add("gap", "diameters", "crossing fibers", pick(extent, {0, 1e-15, 1e-9}, {0, 1e-300, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3}),
      [](double v, FallingYarn& s) { s.gap = v; });
  add("gap", "diameters", "parallel yarns of 7", pick(extent, {0, 1e-15, 1e-9}, {0, 1e-300, 1e-16, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3}),
      [](double v, FallingYarn& s) {
        s.gap = s.gap_within = v;
        s.fibers = 7;
        s.angle = 0;
        s.fall = 1;
      });
  add("angle", "rad", "nearly parallel fibers", pick(extent, {0, 1e-9, 1e-3}, {0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3, 1e-2, 1e-1}),
      [](double v, FallingYarn& s) { s.angle = v; });
  add("overlap at the start", "diameters", "crossing fibers",
      pick(extent, {0.01, 0.5, 0.7, 1}, {0.01, 0.1, 0.3, 0.5, 0.55, 0.59, 0.65, 0.9, 1}), [](double v, FallingYarn& s) {
        s.gap = -v;
        s.speed = 0;
      });
  add("overlap at the start", "diameters", "parallel fibers",
      pick(extent, {0.01, 0.5, 0.7, 1}, {0.01, 0.1, 0.3, 0.5, 0.55, 0.59, 0.65, 0.9, 1}), [](double v, FallingYarn& s) {
        s.gap = -v;
        s.speed = 0;
        s.angle = 0;
      });
  add("overlap within a yarn", "diameters", "yarn of 7 on yarn of 7",
      pick(extent, {0.1, 0.5, 1}, {0.01, 0.1, 0.3, 0.5, 0.55, 0.59, 0.65, 0.9, 1}), [](double v, FallingYarn& s) {
        s.gap_within = -v;
        s.fibers = 7;
        s.fall = 1;
      });
  add("length of a bar", "diameters", "crossing fibers", pick(extent, {0.1, 20}, {0.02, 0.05, 0.1, 0.25, 0.5, 1, 2, 5, 20, 50, 100}),
      [](double v, FallingYarn& s) {
        s.bar = v;
        s.length = std::max(3.0, 3 * v);
      });
  sweeps.push_back({"cell width", "diameters", "weft on warp", pick(extent, {1, 1.5}, {0.5, 0.7, 0.9, 1, 1.001, 1.05, 1.2, 1.5, 2, 3}),
                    ledger_limit, run_narrow_cell});
  return sweeps;
}

}  // namespace stress
