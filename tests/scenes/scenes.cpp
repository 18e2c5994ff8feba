#include "scenes/scenes.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace scenes {

using weave::FiberSpec;
using weave::FiberType;

FiberType glass_fiber(double radius) {
  FiberType type;
  type.radius = radius;
  type.area = std::numbers::pi * radius * radius;
  type.youngs_modulus = 86.9e9;
  type.compression_factor = 1;
  type.transverse_modulus = 1e9;
  type.density = 2460;
  return type;
}

FiberSpec chain(const Vec3& from, const Vec3& to, int bars, double strain, int yarn) {
  FiberSpec fiber;
  fiber.yarn = yarn;
  for (int i = 0; i <= bars; ++i) fiber.x.push_back(from + (to - from) * i / bars);
  fiber.rest_length.assign(bars, (to - from).norm() / bars / (1 + strain));
  return fiber;
}

FiberSpec chain_through(std::vector<Vec3> x, int yarn) {
  FiberSpec fiber;
  fiber.yarn = yarn;
  for (std::size_t i = 1; i < x.size(); ++i) fiber.rest_length.push_back((x[i] - x[i - 1]).norm());
  fiber.x = std::move(x);
  return fiber;
}

Scene empty_scene(const FiberType& type) {
  Scene scene;
  add_type(scene.model, type);
  finish_types(scene.model);
  scene.options.skin = 0.3 * 2 * type.radius;
  scene.options.time_step_max = 1e-6;
  return scene;
}

void add(Scene& scene, const FiberSpec& fiber, const Vec3& velocity) {
  add_fiber(scene.model, fiber, scene.state.x);
  scene.state.v.resize(scene.state.x.size(), velocity);
}

void wake_contacts(weave::State& state) {
  for (weave::ActiveContacts* contacts : {&state.contacts.active, &state.contacts.on_reed}) {
    for (weave::LineContact& c : contacts->line) c.asleep_until = 0;
  }
}

weave::Drive at_rest(const weave::Model& model) {
  weave::Drive drive;
  drive.guide_z.assign(model.fibers(), 0);
  drive.guide_speed.assign(model.fibers(), 0);
  return drive;
}

Momentum momentum(const weave::Engine& engine) {
  Momentum m;
  for (std::size_t p = 0; p < engine.model().nodes(); ++p) {
    const Vec3 q = engine.model().mass[p] * engine.state().v[p];
    const Vec3 l = engine.state().x[p].cross(q);
    m.linear += q;
    m.angular += l;
    m.linear_scale += q.norm();
    m.angular_scale += l.norm();
  }
  return m;
}

Scene crossing_pair(const FiberType& type, double angle, double length, int bars, double distance) {
  Scene scene = empty_scene(type);
  for (int i = 0; i < 2; ++i) {
    const double side = i == 0 ? -1 : 1;
    const Vec3 half = 0.5 * length * Vec3(std::cos(0.5 * side * angle), std::sin(0.5 * side * angle), 0);
    const Vec3 middle(0, 0, 0.5 * side * distance);
    add(scene, chain(middle - half, middle + half, bars, 0, i));
  }
  return scene;
}

double uniform(std::mt19937_64& random) {
  return 2 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1;
}

Vec3 random_vector(std::mt19937_64& random) {
  const double x = uniform(random), y = uniform(random), z = uniform(random);
  return {x, y, z};
}

double bar_distance(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1) {
  const auto to_bar = [](const Vec3& point, const Vec3& a, const Vec3& b) {
    const Vec3 ab = b - a;
    const double u = std::clamp((point - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    return (point - a - u * ab).norm();
  };
  double least = std::min({to_bar(p0, q0, q1), to_bar(p1, q0, q1), to_bar(q0, p0, p1), to_bar(q1, p0, p1)});
  // The lines' common normal, where its feet are inside both bars.
  const Vec3 u = p1 - p0, v = q1 - q0, w = p0 - q0;
  const double uu = u.dot(u), uv = u.dot(v), vv = v.dot(v), uw = u.dot(w), vw = v.dot(w);
  const double det = uu * vv - uv * uv;
  if (det > 1e-12 * uu * vv) {
    const double s = (uv * vw - vv * uw) / det, t = (uu * vw - uv * uw) / det;
    if (s > 0 && s < 1 && t > 0 && t < 1) least = std::min(least, (w + s * u - t * v).norm());
  }
  return least;
}

double polyline_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double least = 1e300;
  for (std::size_t i = 1; i < a.size(); ++i) {
    for (std::size_t j = 1; j < b.size(); ++j) least = std::min(least, bar_distance(a[i - 1], a[i], b[j - 1], b[j]));
  }
  return least;
}

Scene tangle(const FiberType& type, const TangleSpec& spec) {
  Scene scene = empty_scene(type);
  const double d = 2 * type.radius;
  scene.model.period_y = spec.period_y * d;
  std::mt19937_64 random(spec.seed);
  std::vector<std::vector<Vec3>> placed;
  while (static_cast<int>(placed.size()) < spec.fibers) {
    const Vec3 middle = 0.5 * spec.box * d * random_vector(random);
    Vec3 along = random_vector(random);
    if (along.norm() < 0.1 || along.norm() > 1) continue;
    along.normalize();
    const Vec3 bend = 0.3 * random_vector(random);
    std::vector<Vec3> x(1, Vec3::Zero());
    for (int i = 0; i < spec.bars; ++i) {
      x.push_back(x.back() + spec.bar_length * d * (along + bend * (2.0 * i / spec.bars - 1)).normalized());
    }
    const Vec3 shift = middle - x[x.size() / 2];
    for (Vec3& p : x) p += shift;
    const bool clear =
        std::all_of(placed.begin(), placed.end(), [&](const auto& other) { return polyline_distance(x, other) > spec.clearance * d; });
    if (!clear) continue;
    placed.push_back(x);
    const auto fiber = chain_through(x, static_cast<int>(placed.size()) - 1);
    add(scene, fiber, -spec.speed * middle / (0.5 * spec.box * d));
  }
  for (std::size_t p = 0; p < scene.state.x.size(); ++p) scene.state.v[p] += spec.spin * Vec3::UnitZ().cross(scene.state.x[p]);
  return scene;
}

Scene periodic_mesh(const FiberType& type, double period_y, int warps, int wefts, double bar_length, double height, std::uint64_t seed) {
  Scene scene = empty_scene(type);
  scene.model.period_y = period_y;
  std::mt19937_64 random(seed);
  const double length = 12 * 2 * type.radius;
  const int warp_bars = static_cast<int>(std::ceil(length / bar_length));
  const int weft_bars = std::max(6, static_cast<int>(std::lround(period_y / bar_length)));
  for (int w = 0; w < warps; ++w) {
    const double y = period_y * uniform(random), z = 0.5 * height * uniform(random), slope = 0.3 * uniform(random);
    const double wave = 0.5 * type.radius * uniform(random);
    std::vector<Vec3> x;
    for (int i = 0; i <= warp_bars; ++i) {
      const double along = i * bar_length - 0.5 * length;
      x.emplace_back(along, y + slope * along, z + wave * std::sin(7 * along / length));
    }
    add(scene, chain_through(x, w));
  }
  for (int w = 0; w < wefts; ++w) {
    const double x0 = 0.4 * length * uniform(random), z0 = 0.5 * height * uniform(random), phase = 3 * uniform(random);
    FiberSpec fiber;
    fiber.role = weave::Role::weft;
    fiber.periodic = true;
    fiber.yarn = warps + w;
    for (int i = 0; i < weft_bars; ++i) {
      const double y = (i + 0.5) * period_y / weft_bars;
      const double turn = 2 * std::numbers::pi * y / period_y + phase;
      fiber.x.emplace_back(x0 + 0.03 * period_y * std::sin(turn), y, z0 + 0.03 * period_y * std::cos(turn));
    }
    for (int i = 0; i < weft_bars; ++i) {
      const Vec3 next = i + 1 < weft_bars ? fiber.x[i + 1] : Vec3(fiber.x[0] + Vec3(0, period_y, 0));
      fiber.rest_length.push_back((next - fiber.x[i]).norm());
    }
    add(scene, fiber);
  }
  return scene;
}

Scene colliding_layers(const FiberType& type, int fibers, double speed) {
  Scene scene = empty_scene(type);
  const double d = 2 * type.radius, length = 3 * d * fibers;
  for (int i = 0; i < fibers; ++i) {
    const double y = 3 * d * (i - 0.5 * (fibers - 1));
    add(scene, chain(Vec3(-0.5 * length, y, 0), Vec3(0.5 * length, y, 0), 2 * fibers, 0, i));
  }
  for (int i = 0; i < fibers; ++i) {
    const double x = 3 * d * (i - 0.5 * (fibers - 1)) + 0.2 * d;
    const Vec3 from(x, -0.5 * length, 1.05 * d), to(x, 0.5 * length, 1.05 * d);
    add(scene, chain(from, to, 2 * fibers, 0, fibers + i), speed * Vec3(0.4, 0.3, -1));
  }
  const double away = 2 * length;
  add(scene, chain(Vec3(-0.5 * length, away, 0), Vec3(0.5 * length, away, 0), 2 * fibers, 0, 2 * fibers));
  add(scene, chain(Vec3(-0.4 * length, away, 1.05 * d), Vec3(0.6 * length, away, 1.05 * d), 2 * fibers, 0, 2 * fibers + 1),
      speed * Vec3(0.5, 0, -1));
  return scene;
}

Scene plain_weave_cell(const FiberType& type, double pitch, int bars_a_pitch) {
  Scene scene = empty_scene(type);
  const double p = pitch * 2 * type.radius, amplitude = 0.5 * type.radius;
  scene.model.period_y = 2 * p;
  for (int w = 0; w < 2; ++w) {
    std::vector<Vec3> x;
    for (int i = 0; i <= 2 * bars_a_pitch; ++i) {
      const double along = -0.5 * p + i * p / bars_a_pitch;
      x.emplace_back(along, (w + 0.5) * p, (w == 0 ? 1 : -1) * amplitude * std::cos(std::numbers::pi * along / p));
    }
    add(scene, chain_through(x, w));
  }
  for (int w = 0; w < 2; ++w) {
    FiberSpec fiber;
    fiber.role = weave::Role::weft;
    fiber.periodic = true;
    fiber.yarn = 2 + w;
    const int bars = 2 * bars_a_pitch;
    for (int i = 0; i < bars; ++i) {
      const double y = i * 2 * p / bars;
      fiber.x.emplace_back(w * p, y, (w == 0 ? -1 : 1) * amplitude * std::sin(std::numbers::pi * y / p));
    }
    for (int i = 0; i < bars; ++i) {
      const Vec3 next = i + 1 < bars ? fiber.x[i + 1] : Vec3(fiber.x[0] + Vec3(0, 2 * p, 0));
      fiber.rest_length.push_back((next - fiber.x[i]).norm());
    }
    add(scene, fiber);
  }
  return scene;
}

}  // namespace scenes
