#include "weave/fiber_path.hpp"

#include <cmath>

namespace weave {

std::optional<Vec3> fiber_at_x(const Model& m, const std::vector<Vec3>& nodes, std::uint32_t f, double x) {
  for (std::uint32_t p = m.first[f]; p < m.last(f); ++p) {
    const Vec3 &a = nodes[p], &b = nodes[p + 1];
    if ((a.x() <= x) != (b.x() <= x)) return a + (x - a.x()) / (b.x() - a.x()) * (b - a);
  }
  return std::nullopt;
}

int passes_over(const Model& m, const std::vector<Vec3>& nodes, std::uint32_t f, const Vec3& point) {
  // Passages over the point's x from the held end on, above the point less those back: one if the fiber goes over it, none if under it.
  int above = 0, all = 0;
  for (std::uint32_t p = m.first[f]; p < m.last(f); ++p) {
    const Vec3 &a = nodes[p], &b = nodes[p + 1];
    if ((a.x() <= point.x()) == (b.x() <= point.x())) continue;
    const int way = a.x() <= point.x() ? 1 : -1;
    all += way;
    if (a.z() + (point.x() - a.x()) / (b.x() - a.x()) * (b.z() - a.z()) > point.z()) above += way;
  }
  if (all == 0) return 0;
  return above > 0 ? 1 : -1;
}

Vec3 periodic_fiber_at_y(const Model& m, const std::vector<Vec3>& nodes, std::uint32_t f, double y) {
  const double start = nodes[m.first[f]].y();
  const double wanted = y + m.period_y * std::ceil((start - y) / m.period_y);  // in [start, start + period)
  for (std::uint32_t p = m.first[f]; p < m.last(f); ++p) {
    const Vec3 &a = nodes[p], &b = nodes[p + 1];
    if ((a.y() <= wanted) != (b.y() <= wanted)) return a + (wanted - a.y()) / (b.y() - a.y()) * (b - a);
  }
  return nodes[m.first[f]];
}

}  // namespace weave
