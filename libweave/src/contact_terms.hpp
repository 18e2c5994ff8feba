#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>

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

/// Numbers side by side.
template <int n>
using Numbers = Eigen::Array<double, n, 1>;

/// Eigen would approximate eight roots at once.
template <int n>
Numbers<n> root(const Numbers<n>& a) {
  Numbers<n> r;
  for (int k = 0; k < n; ++k) r[k] = std::sqrt(a[k]);
  return r;
}

/// Vectors side by side.
template <int n>
struct Vectors {
  Numbers<n> x, y, z;

  /// start + u along + u^2/2 bend.
  static Vectors on_curve(const Vec3& start, const Vec3& along, const Vec3& bend, const Numbers<n>& u) {
    const Numbers<n> half = 0.5 * u;
    return {start.x() + u * (along.x() + half * bend.x()), start.y() + u * (along.y() + half * bend.y()),
            start.z() + u * (along.z() + half * bend.z())};
  }
  void set(int k, const Vec3& v) {
    x[k] = v.x();
    y[k] = v.y();
    z[k] = v.z();
  }
  [[nodiscard]] Vec3 operator[](int k) const { return {x[k], y[k], z[k]}; }
  [[nodiscard]] Vectors operator+(const Vectors& o) const { return {x + o.x, y + o.y, z + o.z}; }
  [[nodiscard]] Vectors operator-(const Vectors& o) const { return {x - o.x, y - o.y, z - o.z}; }
  [[nodiscard]] Vectors times(const Numbers<n>& f) const { return {f * x, f * y, f * z}; }
  [[nodiscard]] Numbers<n> dot(const Vectors& o) const { return x * o.x + y * o.y + z * o.z; }
  [[nodiscard]] Numbers<n> dot(const Vec3& o) const { return x * o.x() + y * o.y() + z * o.z(); }
  [[nodiscard]] Vectors cross(const Vectors& o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
  /// Sum of the vectors, each times its weight.
  [[nodiscard]] Vec3 sum(const Numbers<n>& weight) const { return {(weight * x).sum(), (weight * y).sum(), (weight * z).sum()}; }
};

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
  std::span<SpanForce> force;
  std::span<DirectionalStiffness> stiffness;
  std::span<double> couple;
};

/// Calls f(node, share) for the nodes that carry the place u of a span.
template <typename F>
void each_node_at(const Model& m, const FiberGeometry& g, std::uint32_t fiber, std::uint32_t span, double u, F&& f) {
  const SpanNodes nodes = nodes_of_span(m, fiber, span);
  const Vec3 share = node_shares(g.span[span], u);
  f(nodes.here, share[1]);
  if (nodes.has_before) f(nodes.before, share[0]);
  if (nodes.has_after) f(nodes.after, share[2]);
}

/// Adds what a contact does to the nodes that carry the place u of a span.
inline void add_stiffness(const Model& m, const FiberGeometry& g, std::uint32_t fiber, std::uint32_t span, double u,
                          const ContactStiffness& felt, std::span<DirectionalStiffness> stiffness) {
  each_node_at(m, g, fiber, span, u, [&](std::uint32_t p, double share) { felt.add_to(stiffness[p], share, g.amplitude[p]); });
}

/// Guess at the amplitude of the place u of a span in the fastest oscillation, as its nodes have it.
inline double swing_at(const Model& m, const FiberGeometry& g, std::uint32_t fiber, std::uint32_t span, double u) {
  double swing = 0;
  each_node_at(m, g, fiber, span, u, [&](std::uint32_t p, double share) { swing += share * g.amplitude[p]; });
  return swing;
}

}  // namespace weave
