#include "yarn_side.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace relax {

std::vector<Vec3> YarnSide::all() const {
  std::vector<Vec3> points_all = x;
  for (std::size_t j = 0; j < points; ++j) points_all.push_back(at(x.size() + j));
  return points_all;
}

SideNormals YarnSide::normals() const {
  SideNormals n;
  n.smooth.assign(x.size(), Vec3::Zero());
  n.corner = n.smooth;
  for (const auto& t : triangles) {
    const std::array<Vec3, 3> corner = {at(t[0]), at(t[1]), at(t[2])};
    const Vec3 twice = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    n.triangle.push_back(twice.normalized());
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 to_next = (corner[(c + 1) % 3] - corner[c]).normalized(), to_last = (corner[(c + 2) % 3] - corner[c]).normalized();
      n.smooth[own(t[c])] += twice;
      n.corner[own(t[c])] += std::acos(std::clamp(to_next.dot(to_last), -1.0, 1.0)) * n.triangle.back();
    }
  }
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    n.edge.emplace_back();
    for (std::size_t c = 0; c < 3; ++c) n.edge.back()[c] = (n.triangle[t] + n.triangle[beside[t][c]]).normalized();
  }
  for (Vec3& normal : n.smooth) normal.normalize();
  for (Vec3& normal : n.corner) normal.normalize();
  return n;
}

YarnSide join_rings(const YarnFibers& yarn, const Rings& rings) {
  YarnSide side;
  side.yarn = yarn.yarn;
  side.weft = yarn.weft;
  side.period = yarn.period;
  side.last_face = yarn.last_face;
  side.diameter = 2 * yarn.radius.front();
  side.rings = rings.rings();
  side.points = rings.points;
  side.turn = rings.turn;
  side.x = rings.x;
  for (std::size_t k = 0; k < side.rings; ++k) {
    for (std::size_t j = 0; j < side.points; ++j) {
      const std::size_t after = (j + 1) % side.points;
      const auto a = static_cast<std::uint32_t>(k * side.points + j), b = static_cast<std::uint32_t>(k * side.points + after);
      const auto c = static_cast<std::uint32_t>(a + side.points), d = static_cast<std::uint32_t>(b + side.points);
      if ((side.at(a) - side.at(d)).squaredNorm() <= (side.at(b) - side.at(c)).squaredNorm()) {
        side.triangles.push_back({a, b, d});
        side.triangles.push_back({a, d, c});
      } else {
        side.triangles.push_back({a, b, c});
        side.triangles.push_back({b, d, c});
      }
    }
  }
  side.beside.resize(side.triangles.size());
  std::map<std::pair<std::size_t, std::size_t>, std::pair<std::uint32_t, std::size_t>> first;  // triangle and edge by the edge's ends
  for (std::uint32_t t = 0; t < side.triangles.size(); ++t) {
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax({side.own(side.triangles[t][c]), side.own(side.triangles[t][(c + 1) % 3])});
      const auto [other, is_new] = first.try_emplace({low, high}, t, c);
      if (is_new) continue;
      side.beside[t][c] = other->second.first;
      side.beside[other->second.first][other->second.second] = t;
    }
  }
  return side;
}

}  // namespace relax
