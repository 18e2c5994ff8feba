#include "yarn_side.hpp"

#include <Eigen/Geometry>

namespace relax {

std::vector<Vec3> YarnSide::all() const {
  std::vector<Vec3> points_all = x;
  for (std::size_t j = 0; j < points; ++j) points_all.push_back(at(x.size() + j));
  return points_all;
}

std::vector<Vec3> YarnSide::normals() const {
  std::vector<Vec3> result(x.size(), Vec3::Zero());
  for (const auto& t : triangles) {
    const Vec3 a = at(t[0]), twice = (at(t[1]) - a).cross(at(t[2]) - a);
    for (const std::uint32_t p : t) result[own(p)] += twice;
  }
  for (Vec3& n : result) n.normalize();
  return result;
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
  return side;
}

}  // namespace relax
