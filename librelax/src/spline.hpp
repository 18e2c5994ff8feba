#pragma once
#include <array>
#include <cmath>

#include "relax/cell.hpp"

namespace relax {

/// Weights of a span's three nodes at share u: uniform quadratic B-spline (de Boor 1978).
inline Vec3 span_weights(double u) {
  return {0.5 * (1 - u) * (1 - u), 0.5 + u - u * u, 0.5 * u * u};
}
/// Their derivatives by u.
inline Vec3 span_slopes(double u) {
  return {u - 1, 1 - 2 * u, u};
}

/// One span of a fiber's axis: y(u) = start + u slope + u^2/2 curve, u = 0...1, from its nodes x0, x1, x2.
struct Span {
  std::array<std::uint32_t, 3> node;
  std::array<int, 3> wrap;  ///< periods by which each node is moved
  Vec3 start, slope, curve;

  Span(const Cell& cell, const Eigen::VectorXd& q, std::uint32_t middle) {
    const Cell::ChainNode b = cell.before(middle), a = cell.after(middle);
    node = {b.node, middle, a.node};
    wrap = {b.wrap, 0, a.wrap};
    const Vec3 x1 = q.segment<3>(3 * static_cast<Eigen::Index>(middle));
    Vec3 x0 = q.segment<3>(3 * static_cast<Eigen::Index>(b.node)), x2 = q.segment<3>(3 * static_cast<Eigen::Index>(a.node));
    const std::uint32_t f = cell.fiber_of[middle];
    if (b.wrap != 0) x0 -= cell.period(f, q);
    if (a.wrap != 0) x2 += cell.period(f, q);
    start = 0.5 * (x0 + x1);
    slope = x1 - x0;
    curve = x2 - 2 * x1 + x0;
  }
  [[nodiscard]] Vec3 point(double u) const { return start + u * slope + (0.5 * u * u) * curve; }
  [[nodiscard]] Vec3 tangent(double u) const { return slope + u * curve; }

  /// Share u, not bounded to 0...1, at which the extended span comes closest to a point: (point - y).y' = 0 by Newton's method from the
  /// chord. Unique where the point is nearer to the axis than its radius of curvature.
  [[nodiscard]] double closest(const Vec3& point_at) const {
    constexpr double near = 1e-7;  // the step after one of this size would be of its square
    const Vec3 chord = slope + 0.5 * curve;
    double u = (point_at - start).dot(chord) / chord.squaredNorm();
    for (int i = 0; i < 30; ++i) {
      const Vec3 r = point_at - point(u), t = tangent(u);
      const double t2 = t.squaredNorm(), slope_of_residual = t2 - r.dot(curve);
      const double change = r.dot(t) / (slope_of_residual > 0.1 * t2 ? slope_of_residual : t2);
      u += change;
      if (std::abs(change) < near) break;
    }
    return u;
  }
};

}  // namespace relax
