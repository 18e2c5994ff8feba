#pragma once
#include <cmath>
#include <cstdint>
#include <span>

#include "weave/model.hpp"

namespace weave {

/// One span of a fiber's smooth axis around a node: c(u) = middle + u slope + u^2/2 curve, u = -1/2...1/2, of the uniform quadratic
/// B-spline over the nodes (de Boor 1978). Spans join at the middles of the bars, which the axis touches there. An open fiber's axis ends
/// in its end nodes: their spans are straight and half as long.
struct Span {
  Vec3 middle = Vec3::Zero(), slope = Vec3::UnitX(), curve = Vec3::Zero();
  double low = -0.5, high = 0.5;  ///< of u

  [[nodiscard]] Vec3 point(double u) const { return middle + u * slope + (0.5 * u * u) * curve; }
  [[nodiscard]] Vec3 tangent(double u) const { return slope + u * curve; }
  /// How far the axis may lie off the chord of the span.
  [[nodiscard]] double sag() const { return 0.125 * curve.norm(); }
};

/// The nodes that a span depends on; at an open fiber's end one is missing.
struct SpanNodes {
  std::uint32_t before, here, after;
  bool has_before, has_after;
  bool wraps_before, wraps_after;  ///< the neighbor is meant one period away
};

inline SpanNodes nodes_of_span(const Model& m, std::uint32_t fiber, std::uint32_t node) {
  const std::uint32_t begin = m.first[fiber], end = begin + m.own_nodes(fiber);
  const bool closed = m.periodic[fiber], is_first = node == begin, is_last = node + 1 == end;
  return {is_first ? end - 1 : node - 1, node, is_last ? begin : node + 1, closed || !is_first, closed || !is_last, is_first, is_last};
}

/// What a span's nodes carry (positions, velocities), in the span's own terms.
inline Span span_between(const Vec3& before, const Vec3& here, const Vec3& after) {
  return {0.125 * (before + after) + 0.75 * here, 0.5 * (after - before), before - 2 * here + after, -0.5, 0.5};
}
inline Span first_span(const Vec3& here, const Vec3& after) {
  return {here, after - here, Vec3::Zero(), 0, 0.5};
}
inline Span last_span(const Vec3& before, const Vec3& here) {
  return {here, here - before, Vec3::Zero(), -0.5, 0};
}

/// The span around a fiber's own node of what its nodes carry, `y` (nodes), which grows by `per_period` from one image of a closed fiber to
/// the next.
inline Span span_at(const Model& m, std::uint32_t fiber, std::uint32_t node, std::span<const Vec3> y, const Vec3& per_period) {
  const std::uint32_t begin = m.first[fiber], last = m.last(fiber);
  if (node > begin && node < last) return span_between(y[node - 1], y[node], y[node + 1]);
  if (m.periodic[fiber]) return span_between(y[last - 1] - per_period, y[begin], y[begin + 1]);
  return node == begin ? first_span(y[begin], y[begin + 1]) : last_span(y[last - 1], y[last]);
}

/// Shares of a point of a span that its nodes carry; not negative, together one.
inline Vec3 node_shares(const SpanNodes& nodes, double u) {
  if (!nodes.has_before) return {0, 1 - u, u};
  if (!nodes.has_after) return {-u, 1 + u, 0};
  return {0.5 * (0.5 - u) * (0.5 - u), 0.75 - u * u, 0.5 * (0.5 + u) * (0.5 + u)};
}

/// Forces on a span, as what they do on its middle, slope and curve when these change.
struct SpanForce {
  Vec3 on_middle = Vec3::Zero(), on_slope = Vec3::Zero(), on_curve = Vec3::Zero();

  void add(const Vec3& force, double u) {
    on_middle += force;
    on_slope += u * force;
    on_curve += (0.5 * u * u) * force;
  }
  /// A couple's pull on the tangent at u.
  void add_to_tangent(const Vec3& pull, double u) {
    on_slope += pull;
    on_curve += u * pull;
  }
  /// A force on the span's own node alone.
  void add_to_node(const Vec3& force) {
    on_middle += force;
    on_curve -= 0.125 * force;
  }
};

/// Adds a force on the span around a fiber's own node to the forces on its nodes, `y`: the adjoint of span_at. What a closed fiber's last
/// node feels of it is its ghost's.
inline void add_span_force(const Model& m, std::uint32_t fiber, std::uint32_t node, const SpanForce& s, std::span<Vec3> y) {
  const std::uint32_t begin = m.first[fiber], last = m.last(fiber);
  const bool inner = node > begin && node < last;
  if (inner || m.periodic[fiber]) {
    const Vec3 even = 0.125 * s.on_middle + s.on_curve, odd = 0.5 * s.on_slope;
    y[inner ? node - 1 : last - 1] += even - odd;
    y[node] += 0.75 * s.on_middle - 2 * s.on_curve;
    y[node + 1] += even + odd;
  } else if (node == begin) {
    y[begin] += s.on_middle - s.on_slope;
    y[begin + 1] += s.on_slope;
  } else {
    y[last] += s.on_middle + s.on_slope;
    y[last - 1] -= s.on_slope;
  }
}

}  // namespace weave
