#include "cell_sides.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "outline.hpp"

namespace relax {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                                                 CGAL::No_constraint_intersection_requiring_constructions_tag>;

constexpr double clearance = 0.55;  // of a side's own points from the edges and points that it must have, in edge lengths

/// Points on the box's edge along an axis, so that those there are no farther apart than about the edge length.
void fill_edge(CellSurfaces& s, int axis, double edge_length) {
  const int b = (axis + 1) % 3, c = (axis + 2) % 3;
  std::vector<double> at = {s.low[axis], s.high[axis]};
  for (const Vec3& x : s.points)
    if (x[b] == s.low[b] && x[c] == s.low[c]) at.push_back(x[axis]);
  std::sort(at.begin(), at.end());
  for (std::size_t i = 0; i + 1 < at.size(); ++i) {
    const int parts = static_cast<int>(std::lround((at[i + 1] - at[i]) / edge_length));
    for (int k = 1; k < parts; ++k) {
      Vec3 x = s.low;
      x[axis] = at[i] + (at[i + 1] - at[i]) * k / parts;
      s.points.push_back(x);
    }
  }
}

/// What a side must not have points near to: found through square bins.
class Occupied {
 public:
  explicit Occupied(double reach) : reach_(reach) {}
  /// Marks the points of a segment, no farther apart than a quarter of the reach.
  void add(const Vec2& a, const Vec2& b) {
    const int parts = static_cast<int>(std::ceil((b - a).norm() / (0.25 * reach_))) + 1;
    for (int k = 0; k <= parts; ++k) {
      const Vec2 x = a + (b - a) * k / parts;
      bins_[bin(x)].push_back(x);
    }
  }
  [[nodiscard]] bool near(const Vec2& x) const {
    const auto [i, j] = bin(x);
    for (int di = -1; di <= 1; ++di)
      for (int dj = -1; dj <= 1; ++dj) {
        const auto found = bins_.find({i + di, j + dj});
        if (found == bins_.end()) continue;
        for (const Vec2& other : found->second)
          if ((other - x).norm() < reach_) return true;
      }
    return false;
  }

 private:
  [[nodiscard]] std::pair<int, int> bin(const Vec2& x) const {
    return {static_cast<int>(std::floor(x.x() / reach_)), static_cast<int>(std::floor(x.y() / reach_))};
  }
  double reach_;
  std::map<std::pair<int, int>, std::vector<Vec2>> bins_;
};

/// The side normal to an axis at its low end.
class Side {
 public:
  Side(CellSurfaces& surfaces, int axis, double edge_length)
      : s_(surfaces), axis_(axis), b_((axis + 1) % 3), c_((axis + 2) % 3), edge_length_(edge_length) {}

  std::vector<std::array<BoxCorner, 3>> triangles() {
    fill();
    Triangulation triangulation;
    std::vector<BoxCorner> corners;
    std::map<BoxCorner, Triangulation::Vertex_handle> handles;
    for (std::uint32_t p = 0; p < s_.points.size(); ++p)
      for (const BoxCorner& corner : images(p)) {
        const Vec2 x = at(corner);
        const auto handle = triangulation.insert(Kernel::Point_2(x.x(), x.y()));
        handle->info() = static_cast<std::uint32_t>(corners.size());
        corners.push_back(corner);
        handles[corner] = handle;
      }
    if (triangulation.number_of_vertices() != corners.size())
      throw std::runtime_error("two yarns touch on a side of the cell; make the envelopes with a larger --gap");
    for (const auto& [from, to] : edges()) {
      try {
        triangulation.insert_constraint(handles.at(from), handles.at(to));
      } catch (const Triangulation::Intersection_of_constraints_exception&) {
        const Vec3 x = 1e3 * s_.position(from);
        throw std::runtime_error("surfaces cross on a side of the cell near (" + std::to_string(x.x()) + ", " + std::to_string(x.y()) +
                                 ", " + std::to_string(x.z()) + ") mm; make the envelopes with a larger --gap or a smaller --edge-length");
      }
    }
    std::vector<std::array<BoxCorner, 3>> result;
    for (const auto face : triangulation.finite_face_handles())
      result.push_back({corners[face->vertex(0)->info()], corners[face->vertex(1)->info()], corners[face->vertex(2)->info()]});
    return result;
  }

 private:
  [[nodiscard]] Vec2 at(const BoxCorner& corner) const {
    const Vec3 x = s_.position(corner);
    return {x[b_], x[c_]};
  }

  [[nodiscard]] std::vector<std::array<BoxCorner, 2>> edges() const {
    return axis_ < 2 ? s_.side_edges[static_cast<std::size_t>(axis_)] : std::vector<std::array<BoxCorner, 2>>{};
  }

  /// Where a point lies on this side: nowhere, once, twice on an edge of the box or four times in a corner.
  [[nodiscard]] std::vector<BoxCorner> images(std::uint32_t p) const {
    const Vec3& x = s_.points[p];
    std::vector<BoxCorner> result;
    if (x[axis_] != s_.low[axis_]) return result;
    for (int high_b = 0; high_b <= (x[b_] == s_.low[b_] ? 1 : 0); ++high_b)
      for (int high_c = 0; high_c <= (x[c_] == s_.low[c_] ? 1 : 0); ++high_c) {
        BoxCorner corner{p, {}};
        corner.high[static_cast<std::size_t>(b_)] = static_cast<std::uint8_t>(high_b);
        corner.high[static_cast<std::size_t>(c_)] = static_cast<std::uint8_t>(high_c);
        result.push_back(corner);
      }
    return result;
  }

  /// Points of a lattice of equilateral triangles, where there is room for them.
  void fill() {
    Occupied occupied(clearance * edge_length_);
    for (std::uint32_t p = 0; p < s_.points.size(); ++p)
      for (const BoxCorner& corner : images(p)) occupied.add(at(corner), at(corner));
    for (const auto& [from, to] : edges()) occupied.add(at(from), at(to));
    const Vec2 low(s_.low[b_], s_.low[c_]), high(s_.high[b_], s_.high[c_]);
    const Vec2 margin = Vec2::Constant(clearance * edge_length_);
    const double row_height = std::sqrt(0.75) * edge_length_;
    for (int row = 1; low.y() + row * row_height < high.y(); ++row)
      for (int k = 0; low.x() + k * edge_length_ < high.x(); ++k) {
        const Vec2 x = low + Vec2((k + 0.5 * (row % 2)) * edge_length_, row * row_height);
        if (((x - low - margin).array() < 0).any() || ((high - margin - x).array() < 0).any() || occupied.near(x)) continue;
        Vec3 point = s_.low;
        point[b_] = x.x();
        point[c_] = x.y();
        s_.points.push_back(point);
      }
  }

  CellSurfaces& s_;
  int axis_, b_, c_;
  double edge_length_;
};

}  // namespace

void add_sides(CellSurfaces& surfaces, double edge_length) {
  surfaces.points.push_back(surfaces.low);
  for (int axis = 0; axis < 3; ++axis) fill_edge(surfaces, axis, edge_length);
  for (int axis = 0; axis < 3; ++axis)
    for (const std::array<BoxCorner, 3>& corners : Side(surfaces, axis, edge_length).triangles())
      for (const std::uint8_t high : {std::uint8_t{0}, std::uint8_t{1}}) {
        BoxTriangle triangle{corners, -1};
        for (BoxCorner& corner : triangle.corners) corner.high[static_cast<std::size_t>(axis)] = high;
        surfaces.triangles.push_back(triangle);
      }
}

}  // namespace relax
