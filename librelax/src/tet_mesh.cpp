#define TETLIBRARY  // of tetgen.h, which otherwise declares the program's main
#include <fmt/format.h>
#include <tetgen.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "cell_sides.hpp"
#include "cell_surfaces.hpp"
#include "composite_cell.hpp"
#include "relax/volume_mesh.hpp"
#include "surface_check.hpp"
#include "triangle_crossings.hpp"

namespace relax {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Tetrahedron = std::array<std::uint32_t, 4>;

constexpr double default_margin = 0.1;  // of matrix above and below the yarns, in edge lengths

/// Sides of a tetrahedron, counterclockwise seen from outside.
constexpr std::array<std::array<std::size_t, 3>, 4> tet_sides = {{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

/// Closed surfaces over shared points.
struct Boundary {
  std::vector<Vec3> points;
  std::vector<Triangle> triangles;
  std::vector<std::int32_t> yarn;  ///< of the triangles, as in BoxTriangle
};

Boundary boundary_of(const CellSurfaces& surfaces) {
  Boundary boundary;
  std::map<BoxCorner, std::uint32_t> numbers;
  for (const BoxTriangle& t : surfaces.triangles) {
    Triangle triangle{};
    for (std::size_t i = 0; i < 3; ++i) {
      const auto [number, added] = numbers.try_emplace(t.corners[i], static_cast<std::uint32_t>(boundary.points.size()));
      if (added) boundary.points.push_back(surfaces.position(t.corners[i]));
      triangle[i] = number->second;
    }
    boundary.triangles.push_back(triangle);
    boundary.yarn.push_back(t.yarn);
  }
  return boundary;
}

double mean_edge(const CompositeCell& cell) {
  double sum = 0;
  std::size_t count = 0;
  for (const YarnEnvelope* yarn : cell.yarns)
    for (const auto& t : yarn->surface.triangles) {
      for (std::size_t i = 0; i < 3; ++i) sum += (yarn->surface.points[t[i]] - yarn->surface.points[t[(i + 1) % 3]]).norm();
      count += 3;
    }
  return sum / static_cast<double>(count);
}

struct Tetrahedra {
  std::vector<Vec3> points;          ///< the boundary's first
  std::vector<Tetrahedron> corners;  ///< the fourth above the first three counterclockwise
  std::vector<int> region;           ///< that the boundary's triangles enclose
};

const char* tetgen_failure(int code) {
  switch (code) {
    case 1:
      return "it ran out of memory";
    case 4:
    case 5:
      return "surfaces come too near to one another; make the envelopes with a larger --gap";
    default:
      return "the surfaces are not what it can mesh";
  }
}

/// TetGen works with lengths near 1: it gets them in `unit`s from `origin`.
Tetrahedra fill(const Boundary& boundary, const Vec3& origin, double unit, double radius_ratio) {
  tetgenio in, out;
  in.numberofpoints = static_cast<int>(boundary.points.size());
  in.pointlist = new REAL[3 * boundary.points.size()];
  for (std::size_t i = 0; i < boundary.points.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) in.pointlist[3 * i + static_cast<std::size_t>(axis)] = (boundary.points[i] - origin)[axis] / unit;
  in.numberoffacets = static_cast<int>(boundary.triangles.size());
  in.facetlist = new tetgenio::facet[boundary.triangles.size()];
  for (std::size_t i = 0; i < boundary.triangles.size(); ++i) {
    tetgenio::facet& facet = in.facetlist[i];
    tetgenio::init(&facet);
    facet.numberofpolygons = 1;
    facet.polygonlist = new tetgenio::polygon[1];
    tetgenio::init(&facet.polygonlist[0]);
    facet.polygonlist[0].numberofvertices = 3;
    facet.polygonlist[0].vertexlist = new int[3];
    for (std::size_t k = 0; k < 3; ++k) facet.polygonlist[0].vertexlist[k] = static_cast<int>(boundary.triangles[i][k]);
  }
  // Boundary kept (pYM), regions numbered (A), no point dropped (J), elements no larger than those of twice the unit.
  std::string switches = fmt::format("pYMAJQq{:.3f}a1.0", radius_ratio);
  try {
    tetrahedralize(switches.data(), &in, &out);
  } catch (const int code) {
    throw std::runtime_error(fmt::format("TetGen can not mesh the cell: {}", tetgen_failure(code)));
  }

  Tetrahedra result;
  result.points = boundary.points;
  for (std::size_t i = boundary.points.size(); i < static_cast<std::size_t>(out.numberofpoints); ++i)
    result.points.emplace_back(origin + unit * Vec3(out.pointlist[3 * i], out.pointlist[3 * i + 1], out.pointlist[3 * i + 2]));
  for (std::size_t i = 0; i < static_cast<std::size_t>(out.numberoftetrahedra); ++i) {
    Tetrahedron t{};
    for (std::size_t k = 0; k < 4; ++k)
      t[k] = static_cast<std::uint32_t>(out.tetrahedronlist[i * static_cast<std::size_t>(out.numberofcorners) + k]);
    result.corners.push_back(t);
    result.region.push_back(
        static_cast<int>(out.tetrahedronattributelist[i * static_cast<std::size_t>(out.numberoftetrahedronattributes)]));
  }
  return result;
}

/// Starts with the lowest corner, in the same sense.
Triangle turned(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

/// Yarn of each region, -1 matrix, from the sides on which it has the yarns' triangles. Throws if one is not a face between elements.
std::map<int, std::int32_t> yarns_of_regions(const Boundary& boundary, const Tetrahedra& tets) {
  std::map<Triangle, std::size_t> numbers;
  for (std::size_t i = 0; i < boundary.triangles.size(); ++i)
    if (boundary.yarn[i] >= 0) numbers[turned(boundary.triangles[i])] = i;
  std::map<int, std::int32_t> yarns;
  std::size_t found = 0;
  for (std::size_t e = 0; e < tets.corners.size(); ++e) {
    yarns.try_emplace(tets.region[e], -1);
    for (const auto& side : tet_sides) {
      const Tetrahedron& t = tets.corners[e];
      const auto triangle = numbers.find(turned({t[side[0]], t[side[1]], t[side[2]]}));
      if (triangle == numbers.end()) continue;
      ++found;  // once only: the element on its other side has it the other way round
      std::int32_t& yarn = yarns[tets.region[e]];
      const std::int32_t here = boundary.yarn[triangle->second];
      if (yarn >= 0 && yarn != here) throw std::runtime_error("composite mesh: the surfaces of two yarns enclose the same place");
      yarn = here;
    }
  }
  if (found != numbers.size())
    throw std::runtime_error(fmt::format("composite mesh: {} of {} triangles of the yarns' surfaces are no faces of the mesh",
                                         numbers.size() - found, numbers.size()));
  return yarns;
}

/// Angle between two sides of a tetrahedron, for each of its six edges [rad].
std::array<double, 6> dihedral_angles(const std::vector<Vec3>& points, const Tetrahedron& t) {
  std::array<Vec3, 4> normals;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& s = tet_sides[i];
    normals[i] = (points[t[s[1]]] - points[t[s[0]]]).cross(points[t[s[2]]] - points[t[s[0]]]).normalized();
  }
  std::array<double, 6> angles{};
  std::size_t n = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) angles[n++] = std::numbers::pi - std::acos(std::clamp(normals[i].dot(normals[j]), -1.0, 1.0));
  return angles;
}

TetQuality quality_of(const Tetrahedra& tets) {
  TetQuality quality;
  quality.dihedral_min = std::numbers::pi;
  std::size_t flat = 0;
  for (const Tetrahedron& t : tets.corners) {
    const auto angles = dihedral_angles(tets.points, t);
    const auto [least, largest] = std::minmax_element(angles.begin(), angles.end());
    quality.dihedral_min = std::min(quality.dihedral_min, *least);
    quality.dihedral_max = std::max(quality.dihedral_max, *largest);
    constexpr double flat_angle = 5 * std::numbers::pi / 180;
    if (*least < flat_angle) ++flat;
  }
  quality.flat_share = static_cast<double>(flat) / static_cast<double>(tets.corners.size());
  return quality;
}

/// TetGen does not survive surfaces that cross.
void check_crossings(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes) {
  for (const YarnEnvelope& e : envelopes) {
    if (const std::size_t pairs = check_surface(e.surface).self_intersections; pairs > 0)
      throw std::runtime_error(
          fmt::format("composite mesh: the surface of yarn {} crosses itself in {} pairs of triangles", e.yarn, pairs));
  }
  const std::vector<TriangleCrossing> crossings = find_crossings(envelopes, {snapshot.cell_length, snapshot.cell_width});
  if (crossings.empty()) return;
  const TriangleCrossing& first = crossings.front();
  throw std::runtime_error(
      fmt::format("composite mesh: the surfaces of yarns {} and {} cross near ({:.4g}, {:.4g}, {:.4g}) mm, one of {} places",
                  envelopes[first.surface_a].yarn, envelopes[first.surface_b].yarn, 1e3 * first.x.x(), 1e3 * first.x.y(), 1e3 * first.x.z(),
                  crossings.size()));
}

}  // namespace

CompositeMesh tet_mesh(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, const TetOptions& options,
                       TetQuality* quality) {
  if (!(options.radius_ratio >= 1)) throw std::invalid_argument("composite mesh: the ratio of radius to edge must be >= 1");
  CompositeCell cell = composite_cell(snapshot, envelopes, options.resin_margin);
  const double of_surfaces = mean_edge(cell);
  const double edge_length = options.edge_length > 0 ? options.edge_length : of_surfaces;
  const double least = of_surfaces / 20, largest = 0.5 * (cell.high - cell.low).head<2>().minCoeff();
  if (!(edge_length >= least && edge_length <= largest))
    throw std::invalid_argument(
        fmt::format("composite mesh: edge length {:.4g} m: must be >= {:.4g} (a twentieth of the surfaces' edges) and "
                    "<= {:.4g} (half the cell)",
                    edge_length, least, largest));
  double margin = options.resin_margin;
  if (margin == 0) {  // else the highest point of a yarn would lie on the side
    margin = default_margin * edge_length;
    cell.low.z() -= margin;
    cell.high.z() += margin;
  }
  check_crossings(snapshot, envelopes);
  CellSurfaces surfaces = surfaces_in_box(cell);
  const std::size_t yarn_triangles = surfaces.triangles.size();
  add_sides(surfaces, edge_length);
  const Boundary boundary = boundary_of(surfaces);
  const Tetrahedra tets = fill(boundary, cell.low, edge_length, options.radius_ratio);
  const std::map<int, std::int32_t> yarns = yarns_of_regions(boundary, tets);
  if (quality != nullptr) {
    *quality = quality_of(tets);
    quality->edge_length = edge_length;
    quality->resin_margin = margin;
    quality->surface_triangles = yarn_triangles;
  }

  CompositeMesh result;
  VolumeMesh& m = result.mesh;
  m.low = cell.low;
  m.high = cell.high;
  m.shape = ElementShape::tetrahedron;
  m.points = tets.points;
  for (const YarnEnvelope* yarn : cell.yarns) m.yarns.push_back(yarn->yarn);
  for (const Tetrahedron& t : tets.corners) m.nodes.insert(m.nodes.end(), t.begin(), t.end());
  make_all_matrix(m);
  std::vector<YarnDistance> distances;
  for (const YarnEnvelope* yarn : cell.yarns) distances.emplace_back(*yarn, cell);
  for (std::size_t e = 0; e < m.elements(); ++e) {
    m.yarn[e] = yarns.at(tets.region[e]);
    if (m.yarn[e] >= 0) m.surface_distance[e] = -distances[static_cast<std::size_t>(m.yarn[e])].from(m.center(e));
  }
  fill_fields(snapshot, cell, options.fields, result);
  return result;
}

}  // namespace relax
