#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <optional>

#include "weave/vec.hpp"

namespace relax {

using weave::Vec3;

struct PointOnTriangle {
  Vec3 x;
  std::array<double, 3> share;  ///< barycentric coordinates
};

/// The point of a triangle nearest to p (Ericson 2005, Real-Time Collision Detection, section 5.1.5).
inline PointOnTriangle closest_on_triangle(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 ab = b - a, ac = c - a, ap = p - a;
  const auto at = [&](double u, double v) { return PointOnTriangle{a + u * ab + v * ac, {1 - u - v, u, v}}; };
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return at(0, 0);
  const Vec3 bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return at(1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(d1 / (d1 - d3), 0);
  const Vec3 cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return at(0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(1 - w, w);
  }
  const double all = va + vb + vc;
  return at(vb / all, vc / all);
}

/// Two edges where they pass one another.
struct EdgeGap {
  double share_a, share_b;  ///< of the edges, where they are nearest
  Vec3 between;             ///< from there on b to there on a
};

/// Empty where the lines of the edges are nearest beyond the ends of either, or parallel.
inline std::optional<EdgeGap> gap_of_edges(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
  const Vec3 a = a1 - a0, b = b1 - b0, r = a0 - b0;
  const double aa = a.squaredNorm(), bb = b.squaredNorm(), ab = a.dot(b), ar = a.dot(r), br = b.dot(r);
  const double square = aa * bb - ab * ab;
  if (square <= 1e-12 * aa * bb) return std::nullopt;
  const double s = (ab * br - bb * ar) / square, t = (aa * br - ab * ar) / square;
  if (s <= 0 || s >= 1 || t <= 0 || t >= 1) return std::nullopt;
  return EdgeGap{s, t, r + s * a - t * b};
}

}  // namespace relax
