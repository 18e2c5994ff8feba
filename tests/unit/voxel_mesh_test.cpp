#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "relax/surface_file.hpp"
#include "relax/volume_mesh.hpp"
#include "scenes/yarn_surfaces.hpp"

namespace relax {
namespace {

using scenes::envelope;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

Eigen::Vector2d straight(double) {
  return {0.5, 0.2};
}
Eigen::Vector2d wave(double along) {
  return {0.5 + 0.1 * std::cos(2 * std::numbers::pi * along), 0.2 + 0.08 * std::sin(2 * std::numbers::pi * along)};
}

/// A straight warp of fibers that fill 0.25...0.75 x 0.1...0.3.
weave::Snapshot straight_warp() {
  return scenes::one_yarn(1, 1, false, straight, scenes::grid_offsets(0.5, 0.2, 5, 2), 0.05, 0.006, 8);
}

std::size_t yarn_elements(const VolumeMesh& m) {
  std::size_t n = 0;
  for (const std::int32_t y : m.yarn) n += y >= 0 ? 1 : 0;
  return n;
}

TEST(VoxelMesh, BoxFillsItsVoxels) {
  const CompositeMesh v = voxel_mesh(straight_warp(), {envelope(0, false, scenes::box_surface({0, 0.25, 0.1}, {1, 0.75, 0.3}))},
                                     {.counts = {4, 8, 4}, .resin_margin = 0.1});
  EXPECT_DOUBLE_EQ(v.mesh.low.z(), 0);
  EXPECT_DOUBLE_EQ(v.mesh.high.z(), 0.4);
  EXPECT_EQ(yarn_elements(v.mesh), 4U * 4U * 2U);
  ASSERT_EQ(v.volumes.size(), 1U);
  EXPECT_NEAR(v.volumes[0].elements, v.volumes[0].envelope, 1e-12);
  for (std::size_t i = 0; i < v.mesh.elements(); ++i) {
    const Vec3 center = v.mesh.center(i);
    const bool inside = std::abs(center.y() - 0.5) < 0.25 && std::abs(center.z() - 0.2) < 0.1;
    ASSERT_EQ(v.mesh.yarn[i], inside ? 0 : -1);
    // From the sides of the box, not from its ends, which join the next period.
    const double depth = std::min(0.25 - std::abs(center.y() - 0.5), 0.1 - std::abs(center.z() - 0.2));
    EXPECT_NEAR(v.mesh.surface_distance[i], inside ? -depth : 0, 1e-12);
  }
}

// The planes of the box pass through the centers of elements: a center on a surface counts as a little farther along x, y and z, so that
// those on the low sides are inside, those on the high sides outside, and no column leaks.
TEST(VoxelMesh, CentersOnTheSurface) {
  const CompositeMesh v = voxel_mesh(straight_warp(), {envelope(0, false, scenes::box_surface({0.125, 0.25, 0.125}, {1.125, 0.75, 0.375}))},
                                     {.counts = {4, 16, 4}, .resin_margin = 0.125});
  // z: centers at 0.0625, 0.1875 ...; y: at 1/32 + j/16, none on the planes 0.25 and 0.75; x: at 1/8, on the cap.
  EXPECT_EQ(yarn_elements(v.mesh), 4U * 8U * 2U);
  const CompositeMesh on =
      voxel_mesh(straight_warp(), {envelope(0, false, scenes::box_surface({0.125, 0.28125, 0.125}, {1.125, 0.71875, 0.375}))},
                 {.counts = {4, 16, 2}, .resin_margin = 0.125});
  // Now y = 9/32 is the center of column 4, 23/32 that of column 11; z: 0.125 and 0.375 are both centers.
  EXPECT_EQ(yarn_elements(on.mesh), 4U * 7U * 1U);
  for (std::size_t i = 0; i < on.mesh.elements(); ++i) {
    const auto j = static_cast<int>(i / 4 % 16), k = static_cast<int>(i / 64);
    EXPECT_EQ(on.mesh.yarn[i] == 0, j >= 4 && j < 11 && k == 0);
  }
}

TEST(VoxelMesh, PeriodicImagesFillTheCell) {
  const weave::Snapshot s = straight_warp();
  const VoxelOptions options{.counts = {2, 10, 4}};
  const CompositeMesh across = voxel_mesh(s, {envelope(0, false, scenes::box_surface({0, 0.7, 0.1}, {1, 1.3, 0.3}))}, options);
  const CompositeMesh below = voxel_mesh(s, {envelope(0, false, scenes::box_surface({0, -0.3, 0.1}, {1, 0.3, 0.3}))}, options);
  const CompositeMesh shifted = voxel_mesh(s, {envelope(0, false, scenes::box_surface({-0.4, 0.7, 0.1}, {0.6, 1.3, 0.3}))}, options);
  EXPECT_EQ(yarn_elements(across.mesh), 2U * 6U * 4U);
  EXPECT_EQ(across.mesh.yarn, below.mesh.yarn);
  EXPECT_EQ(across.mesh.yarn, shifted.mesh.yarn);
  for (std::size_t i = 0; i < across.mesh.elements(); ++i)
    EXPECT_NEAR(across.mesh.surface_distance[i], below.mesh.surface_distance[i], 1e-12);
}

TEST(VoxelMesh, VolumeConvergesToTheSurfaces) {
  for (const bool weft : {false, true}) {
    const scenes::TubeShape shape{.along = weft ? 1 : 0};
    const SurfaceMesh tube = scenes::tube_surface(shape, wave);
    EXPECT_NEAR(enclosed_volume(tube), scenes::polygon_area(shape), 1e-12);
    const weave::Snapshot s = scenes::one_yarn(1, 1, weft, wave, scenes::grid_offsets(0.2, 0.1, 3, 2), 0.03, 0.004, 32);
    double error = 0;
    for (const int n : {12, 24, 48}) {
      const CompositeMesh v = voxel_mesh(s, {envelope(0, weft, tube)}, {.counts = {n, n, n}});
      error = std::abs(v.volumes[0].elements / v.volumes[0].envelope - 1);
      // Elements are wrong only where the surface passes: a share 6 (h/w + h/t) of them at most, and mostly as many in as out.
      EXPECT_LT(error, 0.25 / n) << (weft ? "weft" : "warp") << ", n = " << n;
    }
  }
}

TEST(VoxelMesh, TheDeeperYarnWins) {
  weave::Snapshot s = straight_warp();
  const weave::Snapshot second = scenes::one_yarn(1, 1, true, straight, scenes::grid_offsets(0.5, 0.2, 5, 2), 0.05, 0.006, 8);
  for (std::size_t f = 0; f < second.fibers(); ++f) {
    for (auto i = static_cast<std::size_t>(second.offset[f]); i < static_cast<std::size_t>(second.offset[f + 1]); ++i) {
      s.x.emplace_back(second.x[i] + Vec3(0, 0, 0.1));
      s.tension.push_back(0);
      s.arc.push_back(0);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
    s.yarn.push_back(1);
    s.fiber.push_back(0);
    s.weft.push_back(1);
    s.radius.push_back(0.05);
    s.area.push_back(0.006);
  }
  // Two layers of four elements in z share the element layers 2 and 3 of six.
  const CompositeMesh v = voxel_mesh(s,
                                     {envelope(1, true, scenes::box_surface({0.25, 0, 0.2}, {0.75, 1, 0.4})),
                                      envelope(0, false, scenes::box_surface({0, 0.25, 0.1}, {1, 0.75, 0.3}))},
                                     {.counts = {4, 4, 6}});
  EXPECT_EQ(v.mesh.yarns, (std::vector<int>{0, 1}));
  EXPECT_EQ(v.contested, 2U * 2U * 2U);
  const auto at = [&](int i, int j, int k) { return v.mesh.yarn[static_cast<std::size_t>(i + 4 * (j + 4 * k))]; };
  EXPECT_EQ(at(1, 1, 1), 0);
  EXPECT_EQ(at(1, 1, 2), 0);  // 0.075 below the top of the warp, 0.025 above the bottom of the weft
  EXPECT_EQ(at(1, 1, 3), 1);
  EXPECT_EQ(at(0, 1, 3), 0);
  EXPECT_EQ(at(1, 0, 2), 1);
  EXPECT_EQ(at(0, 0, 2), -1);
}

TEST(VoxelMesh, LocalFractionsAddUpToTheFibers) {
  const weave::Snapshot s = scenes::one_yarn(1, 1, false, wave, scenes::grid_offsets(0.3, 0.15, 5, 3), 0.03, 0.0015, 64);
  const CompositeMesh v = voxel_mesh(s, {envelope(0, false, scenes::tube_surface({}, wave))}, {.counts = {12, 24, 24}});
  double fibers = 0;
  for (std::size_t i = 0; i < v.mesh.elements(); ++i) fibers += v.mesh.volume_fraction[i] * v.mesh.volume(i);
  EXPECT_NEAR(fibers, v.volumes[0].fibers, 1e-12);
  // What is left to scale is the voxels' error of the volume, 1 %.
  EXPECT_NEAR(v.volumes[0].fraction_scale, 1, 0.02);
}

TEST(VoxelMesh, CountsFromSizeAndElements) {
  const Vec3 size(1.5e-3, 1.5e-3, 0.25e-3);
  EXPECT_EQ(voxel_counts(size, {.counts = {1, 2, 3}}), (std::array<int, 3>{1, 2, 3}));
  EXPECT_EQ(voxel_counts(size, {.size = 0.1e-3}), (std::array<int, 3>{15, 15, 3}));
  const std::array<int, 3> n = voxel_counts(size, {.elements = 20000});
  EXPECT_NEAR(n[0] * n[1] * n[2], 20000, 2000);  // counts are whole numbers
  EXPECT_NEAR(1.5 / n[0] / (0.25 / n[2]), 2, 0.1);
  for (const VoxelOptions& many : {VoxelOptions{.counts = {1300, 1300, 1300}}, VoxelOptions{.size = 1e-9}})
    EXPECT_THAT([&] { voxel_counts(size, many); }, testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("at most 1e+08")));
}

TEST(VoxelMesh, BadInputIsNamed) {
  const weave::Snapshot s = straight_warp();
  const YarnEnvelope good = envelope(0, false, scenes::box_surface({0, 0.25, 0.1}, {1, 0.75, 0.3}));
  EXPECT_THAT(
      [&] {
        voxel_mesh(s, {envelope(0, false, scenes::box_surface({0, 0.25, 0.1}, {0.9, 0.75, 0.3}))});
      },
      ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("yarn 0"), HasSubstr("900."), HasSubstr("1000."))));
  EXPECT_THAT([&] { voxel_mesh(s, {good, good}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("yarn 0 has two envelopes")));
  EXPECT_THAT([&] { voxel_mesh(s, {envelope(3, false, good.surface)}); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("no fibers of yarn 3")));
  EXPECT_THAT([&] { voxel_mesh(s, {}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("no yarn envelopes")));
  EXPECT_THAT([&] { voxel_mesh(s, {good}, {.counts = {4, 0, 4}}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("at least 1")));
}

}  // namespace
}  // namespace relax
