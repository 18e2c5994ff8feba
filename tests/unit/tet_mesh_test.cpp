#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "relax/periodic_sets.hpp"
#include "relax/volume_mesh.hpp"
#include "scenes/yarn_surfaces.hpp"

namespace relax {
namespace {

using scenes::envelope;
using scenes::TubeShape;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// Path of a wave about a middle line.
scenes::YarnPath wave_about(double lateral, double height) {
  return [=](double along) {
    const double phase = 2 * std::numbers::pi * along;
    return Eigen::Vector2d(lateral + 0.1 * std::cos(phase), height + 0.04 * std::sin(phase));
  };
}

constexpr int warp = 0, weft = 1;

/// A warp below a weft, each with four fibers, in a cell of 1 x 1; their middle lines.
struct Crossing {
  double warp_y = 0.45, weft_x = 0.55;
  double gap = 0.1;  ///< between the heights of the surfaces where they are nearest
};

weave::Snapshot fibers_of(const Crossing& c) {
  const auto offsets = scenes::grid_offsets(0.3, 0.15, 2, 2);
  weave::Snapshot s = scenes::one_yarn(1, 1, false, wave_about(c.warp_y, 0), offsets, 0.04, 0.004, 24);
  const weave::Snapshot above = scenes::one_yarn(1, 1, true, wave_about(c.weft_x, 0.28 + c.gap), offsets, 0.04, 0.004, 24);
  for (std::size_t f = 0; f < above.fibers(); ++f) {
    s.yarn.push_back(1);
    s.fiber.push_back(above.fiber[f]);
    s.weft.push_back(1);
    s.radius.push_back(above.radius[f]);
    s.area.push_back(above.area[f]);
    s.offset.push_back(s.offset.back() + above.offset[f + 1] - above.offset[f]);
  }
  s.x.insert(s.x.end(), above.x.begin(), above.x.end());
  s.tension.insert(s.tension.end(), above.tension.begin(), above.tension.end());
  s.arc.insert(s.arc.end(), above.arc.begin(), above.arc.end());
  return s;
}

std::vector<YarnEnvelope> surfaces_of(const Crossing& c) {
  const TubeShape along_x{warp, 0, 1, 0.2, 0.1, 24, 16}, along_y{weft, 0, 1, 0.2, 0.1, 24, 16};
  return {envelope(0, false, scenes::tube_surface(along_x, wave_about(c.warp_y, 0))),
          envelope(1, true, scenes::tube_surface(along_y, wave_about(c.weft_x, 0.28 + c.gap)))};
}

CompositeMesh mesh_of(const Crossing& c, const TetOptions& options = {}, TetQuality* quality = nullptr) {
  return tet_mesh(fibers_of(c), surfaces_of(c), options, quality);
}

// Sides of elements on a side of the cell, each by the places of its corners.
using Place = std::array<double, 3>;
std::set<std::set<Place>> faces_on(const VolumeMesh& m, int axis, double value) {
  std::set<std::set<Place>> faces;
  for (std::size_t i = 0; i < m.elements(); ++i) {
    std::set<Place> corners;
    for (const std::uint32_t n : m.element(i).first(4)) {
      Vec3 x = m.points[n];
      if (x[axis] != value) continue;
      x[axis] = 0;
      corners.insert({x.x(), x.y(), x.z()});
    }
    if (corners.size() == 3) faces.insert(corners);
  }
  return faces;
}

TEST(TetMesh, FillsTheCellAndTheYarns) {
  TetQuality quality;
  const CompositeMesh c = mesh_of({}, {}, &quality);
  const VolumeMesh& m = c.mesh;
  double whole = 0;
  for (std::size_t i = 0; i < m.elements(); ++i) {
    ASSERT_GT(m.volume(i), 0);
    whole += m.volume(i);
  }
  EXPECT_NEAR(whole, (m.high - m.low).prod(), 1e-12);
  ASSERT_EQ(c.volumes.size(), 2U);
  for (const YarnVolume& y : c.volumes) EXPECT_NEAR(y.elements, y.envelope, 1e-12) << "yarn " << y.yarn;
  EXPECT_GT(quality.dihedral_min, 0);
  EXPECT_LT(quality.dihedral_max, std::numbers::pi);
  EXPECT_LT(quality.flat_share, 0.02);
}

TEST(TetMesh, EveryTriangleOfTheSurfacesIsAFaceBetweenTwoElements) {
  TetQuality quality;
  const CompositeMesh c = mesh_of({}, {}, &quality);
  EXPECT_EQ(quality.surface_triangles, 2U * 2 * 24 * 16);  // without caps
  std::map<std::set<std::uint32_t>, std::vector<std::int32_t>> sides;
  for (std::size_t i = 0; i < c.mesh.elements(); ++i) {
    const auto n = c.mesh.element(i);
    for (std::size_t without = 0; without < 4; ++without) {
      std::set<std::uint32_t> side(n.begin(), n.end());
      side.erase(n[without]);
      sides[side].push_back(c.mesh.yarn[i]);
    }
  }
  std::size_t between = 0;
  for (const auto& [side, yarns] : sides) between += yarns.size() == 2 && yarns[0] != yarns[1] ? 1 : 0;
  EXPECT_EQ(between, quality.surface_triangles);
}

// Wherever the cell's box is laid: yarns across its sides are cut, and what is cut off goes on at the opposite side.
TEST(TetMesh, OppositeSidesMatchWhereverYarnsLie) {
  for (const Crossing& crossing :
       {Crossing{}, Crossing{.warp_y = 0.93}, Crossing{.warp_y = 0.02, .weft_x = 1.04}, Crossing{.weft_x = -0.47}}) {
    const CompositeMesh c = mesh_of(crossing);
    const VolumeMesh& m = c.mesh;
    EXPECT_NO_THROW(periodic_sets(m, true));
    EXPECT_NO_THROW(periodic_sets(with_middle_nodes(m), true));
    for (int axis = 0; axis < 3; ++axis) {
      const auto low = faces_on(m, axis, m.low[axis]);
      EXPECT_GT(low.size(), 50U);
      EXPECT_EQ(low, faces_on(m, axis, m.high[axis]));
    }
    // Points that move onto a side change a volume by little.
    for (const YarnVolume& y : c.volumes) EXPECT_NEAR(y.elements, y.envelope, 1e-3 * y.envelope) << "yarn " << y.yarn;
  }
}

TEST(TetMesh, ElementsKnowTheirFibers) {
  const CompositeMesh c = mesh_of({});
  const VolumeMesh& m = c.mesh;
  double fibers = 0;
  for (std::size_t i = 0; i < m.elements(); ++i) {
    fibers += m.volume_fraction[i] * m.volume(i);
    if (m.yarn[i] < 0) {
      EXPECT_EQ(m.surface_distance[i], 0);
      continue;
    }
    EXPECT_LT(m.surface_distance[i], 0);
    EXPECT_GT(m.surface_distance[i], -0.1);  // half the height of a yarn
    EXPECT_NEAR(m.direction[i].norm(), 1, 1e-12);
    EXPECT_GT(m.direction[i][m.yarn[i]], 0.7);  // the warp along x, the weft along y
  }
  EXPECT_NEAR(fibers, c.volumes[0].fibers + c.volumes[1].fibers, 1e-12);
}

TEST(TetMesh, MiddleNodesLieOnTheEdges) {
  const VolumeMesh corners = mesh_of({}).mesh, m = with_middle_nodes(corners);
  EXPECT_EQ(m.elements(), corners.elements());
  constexpr std::array<std::array<std::size_t, 2>, 6> edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
  for (std::size_t i = 0; i < m.elements(); ++i) {
    const auto n = m.element(i);
    for (std::size_t k = 0; k < edges.size(); ++k)
      ASSERT_EQ(m.points[n[4 + k]], Vec3(0.5 * (m.points[n[edges[k][0]]] + m.points[n[edges[k][1]]])));
  }
  const VolumeMesh back = without_middle_nodes(m);
  EXPECT_EQ(back.nodes, corners.nodes);
  EXPECT_EQ(back.points, corners.points);
}

TEST(TetMesh, EdgeLengthAndMarginAreTaken) {
  TetQuality quality;
  const std::size_t fine = mesh_of({}, {.edge_length = 0.04}, &quality).mesh.elements();
  EXPECT_EQ(quality.edge_length, 0.04);
  const VolumeMesh coarse = mesh_of({}, {.edge_length = 0.16, .resin_margin = 0.05}).mesh;
  EXPECT_GT(fine, 2 * coarse.elements());
  EXPECT_NEAR(coarse.low.z(), -0.14 - 0.05, 2e-3);  // the wave is sampled at rings
}

TEST(TetMesh, EdgeLengthsOutOfBoundsAreRefused) {
  for (const double edge : {0.6, 1e-4})
    EXPECT_THAT([&] { mesh_of({}, {.edge_length = edge}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("composite mesh: edge length")));
}

TEST(TetMesh, SurfacesThatCrossAreNamed) {
  EXPECT_THAT([] { mesh_of({.gap = -0.2}); }, ThrowsMessage<std::runtime_error>(HasSubstr("the surfaces of yarns 0 and 1 cross near")));
  std::vector<YarnEnvelope> open = surfaces_of({});
  open[0].surface.points.back().z() += 0.01;
  EXPECT_THAT([&] { tet_mesh(fibers_of({}), open, {}); }, ThrowsMessage<std::runtime_error>(HasSubstr("yarn 0 does not end as it begins")));
}

}  // namespace
}  // namespace relax
