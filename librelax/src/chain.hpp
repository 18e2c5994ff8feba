#pragma once
#include <cmath>

#include "spline.hpp"

namespace relax {

/// Closest point of a fiber's endless axis to a point, found by walking from a span.
struct ChainPoint {
  bool found = false;  ///< false: no closest point near the start
  Span span;
  double share = 0;  ///< on the span
  Vec3 separation;   ///< from it to the point
  Vec3 shift;        ///< of the span's image [m]
  int walked = 0;    ///< periods of the fiber from the start to it
};

/// `other`, `shift`: the span to start from and the translation [m] of its fiber.
inline ChainPoint closest_on_chain(const Cell& cell, const Eigen::VectorXd& q, const Vec3& point, std::uint32_t other, Vec3 shift) {
  constexpr double round_off = 1e-9;  // of the share: both spans at a joint say that the other is nearer
  constexpr int limit = 12;
  const Vec3 period = cell.period(cell.fiber_of[other], q);
  std::uint32_t node = other;
  ChainPoint result{false, Span(cell, q, node), 0, Vec3::Zero(), shift};
  for (int step = 0; step < limit; ++step) {
    result.share = result.span.closest(point - shift);
    if (std::isfinite(result.share) && result.share >= -round_off && result.share <= 1 + round_off) {
      result.found = true;
      result.shift = shift;
      result.separation = point - shift - result.span.point(result.share);
      return result;
    }
    const Cell::ChainNode next = result.share > 1 ? cell.after(node) : cell.before(node);
    node = next.node;
    shift += next.wrap * period;
    result.walked += next.wrap;
    result.span = Span(cell, q, node);
  }
  return result;
}

inline Vec3 image_shift(const Cell& cell, const Eigen::VectorXd& q, std::int32_t image_x, std::int32_t image_y) {
  return {image_x * cell.length_x_at(q), image_y * cell.length_y_at(q), 0};
}

}  // namespace relax
