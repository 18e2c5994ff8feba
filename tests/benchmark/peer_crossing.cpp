// How evenly two fibers that cross at a right angle push one another, wherever their nodes lie: spheres on the nodes, as of a particle
// code, and the line contact of this one. Prints, for a few overlaps, the force over its mean as both fibers are moved along themselves.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "weave/engine.hpp"

namespace {

using weave::Vec3;

constexpr double diameter = 0.33e-3;  // [m]
constexpr int half_length = 4;        // of a fiber [diameters]
constexpr int places = 17;            // of each fiber along itself, over one spacing of its nodes; no multiple of the samples

/// Sum of overlap^1.5 over the pairs of spheres of one diameter, `spacing` diameters apart on each fiber, shifted by a and b diameters.
double spheres(double spacing, double overlap, double a, double b) {
  const int nodes = static_cast<int>(half_length / spacing);
  double sum = 0;
  for (int i = -nodes; i <= nodes; ++i) {
    for (int j = -nodes; j <= nodes; ++j) {
      const double distance = std::hypot(i * spacing + a, j * spacing + b, 1 - overlap);
      if (distance < 1) sum += std::pow(1 - distance, 1.5);
    }
  }
  return sum;
}

/// Force of the line contact [N].
double lines(double spacing, double overlap, double a, double b) {
  weave::Model model;
  weave::State state;
  weave::FiberType type;
  type.radius = diameter / 2;
  type.area = std::numbers::pi / 4 * diameter * diameter;
  type.youngs_modulus = 87e9;
  type.transverse_modulus = 2e9;
  type.density = 2460;
  weave::add_type(model, type);
  weave::finish_types(model);
  const int nodes = static_cast<int>(half_length / spacing);
  for (int f = 0; f < 2; ++f) {
    weave::FiberSpec fiber;
    fiber.yarn = f;
    for (int i = -nodes; i <= nodes; ++i) {
      const double along = i * spacing + (f == 0 ? a : b), z = 0.5 * (1 - overlap);
      fiber.x.push_back(diameter * (f == 0 ? Vec3(along, 0, z) : Vec3(0, along, -z)));
    }
    fiber.rest_length.assign(fiber.x.size() - 1, spacing * diameter);
    weave::add_fiber(model, fiber, state.x);
  }
  state.v.assign(state.x.size(), Vec3::Zero());
  weave::EngineOptions options;
  options.skin = 0.2 * diameter;
  options.outer_skin = 2 * options.skin;
  weave::Drive drive;
  drive.guide_z.assign(2, 0);
  drive.guide_speed.assign(2, 0);
  const std::uint32_t upper = static_cast<std::uint32_t>(2 * nodes + 1);
  weave::Engine engine(std::move(model), std::move(state), options);
  engine.step(drive);
  double force = 0;
  for (std::uint32_t p = 0; p < upper; ++p) force += engine.force()[p].z();
  return force;
}

void print(const char* name, double spacing, double overlap, const std::function<double(double, double)>& force) {
  std::vector<double> values;
  for (int i = 0; i < places; ++i) {
    for (int j = 0; j < places; ++j) values.push_back(force(spacing * (i + 0.5) / places, spacing * (j + 0.5) / places));
  }
  double mean = 0, variance = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) variance += (v - mean) * (v - mean) / static_cast<double>(values.size());
  const auto [least, most] = std::ranges::minmax(values);
  const auto without = std::ranges::count(values, 0.0);
  fmt::print("| {} | {:g} | {:g} | {:.2g} % | {:.2f} ... {:.2f} | {:.0f} % |\n", name, spacing, overlap, 100 * std::sqrt(variance) / mean,
             least / mean, most / mean, 100.0 * static_cast<double>(without) / static_cast<double>(values.size()));
}

}  // namespace

int main() {
  fmt::print("| contact | nodes apart [d] | overlap [d] | force off its mean, rms | force over its mean | places without any |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (const double overlap : {0.02, 0.1}) {
    for (const double spacing : {1.0, 0.5, 0.25, 0.125, 0.0625})
      print("spheres", spacing, overlap, [&](double a, double b) { return spheres(spacing, overlap, a, b); });
    for (const double spacing : {2.0, 1.0, 0.5})
      print("lines", spacing, overlap, [&](double a, double b) { return lines(spacing, overlap, a, b); });
  }
}
