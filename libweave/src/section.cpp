#include "weave/section.hpp"

#include <algorithm>
#include <cmath>

namespace weave {

namespace {

/// The crossing at fraction `part` of the element between `node` and the next; `n` is the coordinate normal to the plane.
SectionCircle crossing(const Snapshot& s, std::size_t fiber, std::size_t node, int n, double part) {
  const Vec3& a = s.x[node];
  const Vec3& b = s.x[node + 1];
  const Vec3 center = a + part * (b - a);
  const Vec3 along = (b - a).normalized();
  const int u = 1 - n;

  SectionCircle circle;
  circle.fiber = fiber;
  circle.node = node;
  circle.yarn = s.yarn[fiber];
  circle.weft = s.weft[fiber] != 0;
  circle.u = center[u];
  circle.z = center.z();
  circle.radius = s.radius[fiber];
  circle.aspect = std::min(1 / std::abs(along[n]), max_section_aspect);
  circle.angle = std::atan2(along.z(), along[u]);
  circle.tension = s.tension[node] + part * (s.tension[node + 1] - s.tension[node]);
  circle.stress = circle.tension / s.area[fiber];
  return circle;
}

}  // namespace

double section_period(const Snapshot& snapshot, SectionAxis axis) {
  return axis == SectionAxis::x ? snapshot.cell_width : snapshot.cell_length;
}

std::vector<SectionCircle> cut_section(const Snapshot& snapshot, SectionAxis axis, double value) {
  constexpr double closing_tolerance = 1e-9;  // of the period: rounding, far below a fiber's radius
  const int n = axis == SectionAxis::x ? 0 : 1;
  const double period = axis == SectionAxis::x ? snapshot.cell_length : snapshot.cell_width;
  const double unit = period > 0 ? period : 1;
  std::vector<SectionCircle> circles;
  for (std::size_t fiber = 0; fiber < snapshot.fibers(); ++fiber) {
    const auto first = static_cast<std::size_t>(snapshot.offset[fiber]);
    const auto end = static_cast<std::size_t>(snapshot.offset[fiber + 1]);
    if (end <= first + 1) continue;

    // Distances from the first node, in periods. They are made exact for a last node that is the first one's image, so that a plane
    // through both is crossed once.
    const auto phase = [&](std::size_t node) {
      const double exact = (snapshot.x[node][n] - snapshot.x[first][n]) / unit;
      const bool closing = period > 0 && node == end - 1 && std::abs(std::abs(exact) - 1) < closing_tolerance;
      return closing ? std::round(exact) : exact;
    };
    double plane = (value - snapshot.x[first][n]) / unit;
    if (period > 0) plane -= std::floor(plane);

    for (std::size_t node = first; node + 1 < end; ++node) {
      // An element holds its lower end and not its upper one, so that a crossing at a node counts once.
      const double a = phase(node), b = phase(node + 1), low = std::min(a, b), high = std::max(a, b);
      for (double level = period > 0 ? plane + std::ceil(low - plane) : plane; level < high; ++level) {
        if (level >= low) circles.push_back(crossing(snapshot, fiber, node, n, (level - a) / (b - a)));
        if (period <= 0) break;
      }
    }
  }
  return circles;
}

}  // namespace weave
