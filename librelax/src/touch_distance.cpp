#include "touch_distance.hpp"

#include <algorithm>
#include <cmath>

#include "box_grid.hpp"
#include "closest.hpp"

namespace relax {

TouchDistance measure_touch(const YarnFibers& yarn, const Rings& rings, const SurfaceMesh& surface, std::size_t side_triangles,
                            double ball) {
  const double radius = yarn.radius.front();
  std::vector<Box> boxes;
  for (std::size_t t = 0; t < side_triangles; ++t) {
    boxes.emplace_back(surface.points[surface.triangles[t][0]]);
    boxes.back().extend(surface.points[surface.triangles[t][1]]).extend(surface.points[surface.triangles[t][2]]);
  }
  const BoxGrid grid(std::move(boxes), 2 * radius);
  std::vector<std::uint32_t> found;
  TouchDistance result;
  const auto take = [&](const Vec3& x) {
    for (double reach = 0.25 * radius;; reach *= 2) {
      grid.find(Box(Vec3(x - Vec3::Constant(reach)), Vec3(x + Vec3::Constant(reach))), found);
      double least = INFINITY, height = 0;
      for (const std::uint32_t f : found) {
        const auto& t = surface.triangles[f];
        const Vec3 &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
        const Vec3 away = x - closest_on_triangle(x, a, b, c).x;
        const double distance = away.norm();
        // Of triangles equally near, the one that faces the point most tells the side.
        const double facing = (b - a).cross(c - a).normalized().dot(away);
        if (distance > least + 1e-9 * radius || (distance > least - 1e-9 * radius && std::abs(facing) <= std::abs(height))) continue;
        least = distance;
        height = facing;
      }
      if (least > reach) continue;
      result.sum += least / radius;
      if (least / radius > result.largest) {
        result.largest = least / radius;
        result.largest_at = x;
      }
      if (height > 0) result.protrusion = std::max(result.protrusion, least / radius);
      ++result.count;
      return;
    }
  };
  constexpr double step = 0.25;  // along an arc, in radii
  const auto look = [&](const Station& station, const Outline& outline) {
    for (std::size_t a = 0; a < outline.arcs.size(); ++a) {
      const OutlineArc& arc = outline.arcs[a];
      if (arc.sweep <= 0) continue;
      const int pieces = std::max(1, static_cast<int>(std::ceil(arc.length() / (step * radius))));
      for (int i = 0; i < pieces; ++i) take(station.point(arc.at((i + 0.5) / pieces)));
    }
  };
  for (std::size_t k = 0; k < rings.rings(); ++k) {
    look(rings.stations[k], rings.outlines[k]);
    Station after = rings.stations[(k + 1) % rings.rings()];
    if (k + 1 == rings.rings()) {
      after.origin += yarn.period;
      after.share += 1;
    }
    Station middle = rings.stations[k];
    middle.share = 0.5 * (middle.share + after.share);
    middle.origin = yarn.center(middle.share);
    middle.normal = (middle.normal + after.normal).normalized();
    middle.u = (middle.u + after.u - (middle.u + after.u).dot(middle.normal) * middle.normal).normalized();
    middle.v = middle.normal.cross(middle.u);
    look(middle, outline_at(yarn, middle, ball));
  }
  return result;
}

}  // namespace relax
