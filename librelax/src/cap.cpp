#include "cap.hpp"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <stdexcept>

namespace relax {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Triangulation_vertex_base_with_info_2<std::uint32_t, Kernel>;
using FaceBase = CGAL::Constrained_triangulation_face_base_2<Kernel, CGAL::Triangulation_face_base_with_info_2<int, Kernel>>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
                                                                 CGAL::No_constraint_intersection_requiring_constructions_tag>;

}  // namespace

std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(const std::vector<Vec2>& polygon) {
  Triangulation triangulation;
  std::vector<Triangulation::Vertex_handle> corners;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    corners.push_back(triangulation.insert(Kernel::Point_2(polygon[i].x(), polygon[i].y())));
    corners.back()->info() = static_cast<std::uint32_t>(i);
  }
  const auto crossing = [] { return std::runtime_error("the outline of a yarn crosses itself on a face of the cell"); };
  if (triangulation.number_of_vertices() != polygon.size()) throw crossing();
  try {
    for (std::size_t i = 0; i < corners.size(); ++i) triangulation.insert_constraint(corners[i], corners[(i + 1) % corners.size()]);
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    throw crossing();
  }
  // From outside inward: what lies behind an odd number of constraints is within.
  constexpr int unseen = -1;
  for (const auto face : triangulation.all_face_handles()) face->info() = unseen;
  std::vector<Triangulation::Face_handle> border = {triangulation.infinite_face()};
  border.front()->info() = 0;
  while (!border.empty()) {
    const Triangulation::Face_handle face = border.back();
    border.pop_back();
    for (int i = 0; i < 3; ++i) {
      const Triangulation::Face_handle beyond = face->neighbor(i);
      if (beyond->info() != unseen) continue;
      beyond->info() = triangulation.is_constrained({face, i}) ? 1 - face->info() : face->info();
      border.push_back(beyond);
    }
  }
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto face : triangulation.finite_face_handles())
    if (face->info() == 1) triangles.push_back({face->vertex(0)->info(), face->vertex(1)->info(), face->vertex(2)->info()});
  return triangles;
}

}  // namespace relax
