#include "surface_check.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/manifoldness.h>
#include <CGAL/Polygon_mesh_processing/orientation.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <iterator>

namespace relax {
namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

}  // namespace

SurfaceState check_surface(const SurfaceMesh& surface) {
  std::vector<Kernel::Point_3> points;
  for (const Vec3& x : surface.points) points.emplace_back(x.x(), x.y(), x.z());
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : surface.triangles) triangles.push_back({t[0], t[1], t[2]});
  SurfaceState state;
  if (!pmp::is_polygon_soup_a_polygon_mesh(triangles)) return state;
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  std::vector<Mesh::Halfedge_index> pinched;
  pmp::non_manifold_vertices(mesh, std::back_inserter(pinched));
  state.closed = CGAL::is_closed(mesh) && pinched.empty() && pmp::is_outward_oriented(mesh);
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> crossing;
  pmp::self_intersections(mesh, std::back_inserter(crossing));
  state.self_intersections = crossing.size();
  return state;
}

bool triangles_meet(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b) {
  const auto triangle = [](const std::array<Vec3, 3>& corners) {
    const auto point = [&](std::size_t c) { return Kernel::Point_3(corners[c].x(), corners[c].y(), corners[c].z()); };
    return Kernel::Triangle_3(point(0), point(1), point(2));
  };
  return CGAL::do_intersect(triangle(a), triangle(b));
}

}  // namespace relax
