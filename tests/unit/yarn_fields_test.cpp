#include "relax/yarn_fields.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "scenes/yarn_surfaces.hpp"

namespace relax {
namespace {

using std::numbers::pi;

Eigen::Vector2d wave(double along) {
  return {0.3, 0.1 * std::sin(2 * pi * along)};
}

TEST(YarnFields, DirectionFollowsTheFibers) {
  for (const bool weft : {false, true}) {
    const double period = weft ? 2 : 1;
    const scenes::YarnPath path = [period](double along) { return wave(along / period); };
    const weave::Snapshot cell = scenes::one_yarn(1, 2, weft, path, scenes::grid_offsets(0.2, 0.1, 4, 2), 0.025, 0.001, 64);
    const scenes::TubeShape shape{.along = weft ? 1 : 0, .period = period, .half_width = 0.14, .half_height = 0.08};
    const YarnFields fields(cell, 0, scenes::tube_surface(shape, path));
    for (const double share : {0.013, 0.25, 0.4, 0.99}) {
      const double slope = 0.1 * 2 * pi / period * std::cos(2 * pi * share), height = 0.1 * std::sin(2 * pi * share);
      // In an image a period up the yarn and one across.
      const double along = period * (share - 1), lateral = 0.3 + 0.03 + (weft ? 1 : 2);
      const YarnFields::Value v = fields.at(weft ? Vec3(lateral, along, height + 0.02) : Vec3(along, lateral, height + 0.02));
      const Vec3 truth = (weft ? Vec3(0, 1, slope) : Vec3(1, 0, slope)).normalized();
      // Linear between stations 0.025 apart: (2 pi)^3 0.1 0.025^2 / 8 = 0.002; by the chord of two bars: (pi/32)^2 / 6 = 0.0016 of the
      // slope.
      EXPECT_LT((v.direction - truth).norm(), 4e-3);
      EXPECT_LT((v.yarn_tangent - truth).norm(), 0.01);  // chords of three stations: (2 pi)^3 0.1 0.075^2 / 24 = 0.006
      const Vec3 up = (Vec3::UnitZ() - truth.z() * truth).normalized(), side = truth.cross(up);
      const Vec3 relative = weft ? Vec3(0.03, 0, 0.02) : Vec3(0, 0.03, 0.02);
      EXPECT_NEAR(v.location.x(), relative.dot(side), 2e-3);
      EXPECT_NEAR(v.location.y(), relative.dot(up), 2e-3);
    }
  }
}

TEST(YarnFields, FractionIntegratesToTheFibers) {
  // A rectangular section full of fibers: the fraction is nearly uniform, up to the edges.
  const SurfaceMesh surface = scenes::box_surface({0, 0.1, -0.1}, {1, 0.5, 0.1});
  const weave::Snapshot flat = scenes::one_yarn(
      1, 1, false, [](double) { return Eigen::Vector2d(0.3, 0); }, scenes::grid_offsets(0.4, 0.2, 8, 4), 0.025, 0.0015, 8);
  const YarnFields fields(flat, 0, surface);
  EXPECT_NEAR(fields.fiber_volume(), 32 * 0.0015, 1e-12);
  const double mean = 32 * 0.0015 / (0.4 * 0.2);
  double sum = 0, least = 1, largest = 0;
  const int n = 80, m = 40;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < m; ++k) {
      const double f = fields.at({0.37, 0.1 + 0.4 * (i + 0.5) / n, -0.1 + 0.2 * (k + 0.5) / m}).volume_fraction;
      sum += f / (n * m);
      least = std::min(least, f);
      largest = std::max(largest, f);
    }
  EXPECT_NEAR(sum, mean, 5e-3 * mean);  // the factor of a station is made on a grid of a quarter of the kernel's radius
  EXPECT_GT(least, 0.9 * mean);
  EXPECT_LT(largest, 1.1 * mean);
}

}  // namespace
}  // namespace relax
