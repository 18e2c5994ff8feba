#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

#include "numbers_side_by_side.hpp"
#include "weave/contact.hpp"

namespace weave {

/// Of Newton's method to a closest point, which ends with a step below `converged` of the span.
constexpr int newton_limit = 12;
constexpr double converged = 1e-8;
/// A step of it below this leaves less than `converged`, as the next goes with its square.
constexpr double nearly_converged = 1e-5;
/// Of the length of the tangent, squared: below it a point is so near the axis's center of curvature that Newton's method would overshoot.
constexpr double flattest = 0.1;
/// Overlap beyond what motion explains that is put down to rounding [sum of the radii].
constexpr double unexplained = 1e-6;
/// The shortest separation by which a normal is still made a unit vector [sum of the radii].
constexpr double shortest_separation = 1e-3;

/// The cubic (r - c(u)).c'(u) whose root is the point of a span nearest to a point r from its middle. T: double, or an array of them.
template <typename T>
struct NearnessCubic {
  T slope2, slope_curve, curve2;

  /// Its value; along = r.slope, steep = slope^2 - r.curve. U: T, or an array of them.
  template <typename U>
  U value(const U& along, const U& steep, const U& u) const {
    return along - u * (steep + u * (1.5 * slope_curve + 0.5 * curve2 * u));
  }
  template <typename U>
  U minus_slope(const U& steep, const U& u) const {
    return steep + u * (3 * slope_curve + 1.5 * curve2 * u);
  }
  template <typename U>
  U length2_of_tangent(const U& u) const {
    return slope2 + u * (2 * slope_curve + curve2 * u);
  }
};
inline NearnessCubic<double> nearness_cubic(const Span& s) {
  return {s.slope.squaredNorm(), s.slope.dot(s.curve), s.curve.squaredNorm()};
}

/// u of the points of spans, thought to go on beyond their ends, that are nearest to points: along and steep as in NearnessCubic.
template <typename T, int n>
Numbers<n> nearest_on_spans(const NearnessCubic<T>& cubic, const Numbers<n>& along, const Numbers<n>& steep) {
  Numbers<n> u = Numbers<n>::Zero();
  for (int i = 0; i < newton_limit; ++i) {
    const Numbers<n> slope = cubic.minus_slope(steep, u), length2 = cubic.length2_of_tangent(u);
    const auto newton = slope > flattest * length2;
    const Numbers<n> change = cubic.value(along, steep, u) / newton.select(slope, length2);
    u += change;
    if (change.abs().maxCoeff() < (newton.all() ? nearly_converged : converged)) break;
  }
  return u;
}

inline double stored_in(const Touch& t) {
  return t.stiffness > 0 ? 0.5 * (t.along * t.along + t.across * t.across) / t.stiffness : 0;
}

inline void note_overlap(double ratio, std::uint32_t node, std::uint32_t span, ContactSums& sums) {
  if (ratio <= sums.overlap_max) return;
  sums.overlap_max = ratio;
  sums.node_max = node;
  sums.span_max = span;
}

/// What all contacts of a fiber with another have in common.
struct FiberPair {
  std::uint32_t other = none;
  const PairLaw* law = nullptr;
  double touch_reach = 0, share_of_points = 0;
  bool meets_at_nodes = false, on_reed = false;

  static constexpr auto none = std::numeric_limits<std::uint32_t>::max();
};

/// Those of the fibers that a fiber has touched of late, as its contacts come back to the same few again and again.
class FiberPairs {
 public:
  FiberPairs(const Model& model, std::uint32_t fiber) : model_(model), fiber_(fiber) {}

  const FiberPair& with(std::uint32_t other) {
    FiberPair& pair = pairs_[other % pairs_.size()];
    if (pair.other != other) {
      pair = {other,
              &model_.pair_law(fiber_, other),
              touch_reach(model_, fiber_, other),
              share_of_points(model_, fiber_, other),
              meets_at_nodes(model_, fiber_, other),
              model_.role[other] == Role::reed};
    }
    return pair;
  }

 private:
  const Model& model_;
  std::uint32_t fiber_;
  std::array<FiberPair, 32> pairs_;
};

/// What the contacts of a fiber are evaluated from, and what they add to.
struct ContactTarget {
  const Model& model;
  const FiberGeometry& g;
  std::uint32_t fiber;
  double dt;
  bool with_energy;
  std::span<Vec3> force;
  std::span<DirectionalStiffness> stiffness;
  std::span<double> couple;
};

/// Calls f(node, share) for the nodes that carry the place u of a span.
template <typename F>
void each_node_at(const Model& m, std::uint32_t fiber, std::uint32_t span, double u, F&& f) {
  const SpanNodes nodes = nodes_of_span(m, fiber, span);
  const Vec3 share = node_shares(nodes, u);
  f(nodes.here, share[1]);
  if (nodes.has_before) f(nodes.before, share[0]);
  if (nodes.has_after) f(nodes.after, share[2]);
}

/// Adds what a contact does to the nodes that carry the place u of a span.
inline void add_stiffness(const Model& m, const FiberGeometry& g, std::uint32_t fiber, std::uint32_t span, double u,
                          const ContactStiffness& felt, std::span<DirectionalStiffness> stiffness) {
  each_node_at(m, fiber, span, u, [&](std::uint32_t p, double share) { felt.add_to(stiffness[p], share, g.amplitude[p]); });
}

/// Guess at the amplitude of the place u of a span in the fastest oscillation, as its nodes have it.
inline double swing_at(const Model& m, const FiberGeometry& g, std::uint32_t fiber, std::uint32_t span, double u) {
  double swing = 0;
  each_node_at(m, fiber, span, u, [&](std::uint32_t p, double share) { swing += share * g.amplitude[p]; });
  return swing;
}

}  // namespace weave
