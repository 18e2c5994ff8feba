#include "relax/volume_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <utility>

namespace relax {

int nodes_of(ElementShape shape) {
  switch (shape) {
    case ElementShape::hexahedron:
      return 8;
    case ElementShape::tetrahedron:
      return 4;
    case ElementShape::tetrahedron_10:
      return 10;
  }
  return 0;
}

std::span<const std::uint32_t> VolumeMesh::element(std::size_t i) const {
  const auto count = static_cast<std::size_t>(nodes_of(shape));
  return std::span(nodes).subspan(i * count, count);
}

Vec3 VolumeMesh::center(std::size_t i) const {
  const auto n = element(i);
  if (shape == ElementShape::hexahedron) return 0.5 * (points[n[0]] + points[n[6]]);
  return 0.25 * (points[n[0]] + points[n[1]] + points[n[2]] + points[n[3]]);
}

double VolumeMesh::volume(std::size_t i) const {
  if (shape == ElementShape::hexahedron) return (high - low).prod() / static_cast<double>(elements());
  const auto n = element(i);
  const Vec3 &a = points[n[0]], &b = points[n[1]], &c = points[n[2]], &d = points[n[3]];
  return (b - a).cross(c - a).dot(d - a) / 6;
}

void make_all_matrix(VolumeMesh& mesh) {
  const std::size_t n = mesh.elements();
  mesh.yarn.assign(n, -1);
  mesh.direction.assign(n, Vec3::Zero());
  mesh.yarn_tangent.assign(n, Vec3::Zero());
  mesh.location.assign(n, Eigen::Vector2d::Zero());
  mesh.volume_fraction.assign(n, 0);
  mesh.surface_distance.assign(n, 0);
}

VolumeMesh with_middle_nodes(const VolumeMesh& tetrahedra) {
  VolumeMesh m = tetrahedra;
  m.shape = ElementShape::tetrahedron_10;
  m.nodes.clear();
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  constexpr std::array<std::array<std::size_t, 2>, 6> edges = {{{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}};
  for (std::size_t i = 0; i < tetrahedra.elements(); ++i) {
    const auto corners = tetrahedra.element(i);
    m.nodes.insert(m.nodes.end(), corners.begin(), corners.end());
    for (const auto& [a, b] : edges) {
      const auto ends = std::minmax(corners[a], corners[b]);
      const auto [middle, added] = middles.try_emplace(ends, static_cast<std::uint32_t>(m.points.size()));
      if (added) m.points.emplace_back(0.5 * (tetrahedra.points[ends.first] + tetrahedra.points[ends.second]));
      m.nodes.push_back(middle->second);
    }
  }
  return m;
}

VolumeMesh without_middle_nodes(const VolumeMesh& tetrahedra) {
  VolumeMesh m = tetrahedra;
  m.shape = ElementShape::tetrahedron;
  m.nodes.clear();
  std::uint32_t last = 0;
  for (std::size_t i = 0; i < tetrahedra.elements(); ++i)
    for (const std::uint32_t corner : tetrahedra.element(i).first(4)) {
      m.nodes.push_back(corner);
      last = std::max(last, corner);
    }
  m.points.resize(last + 1);
  return m;
}

}  // namespace relax
