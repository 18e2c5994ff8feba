#pragma once
#include <cmath>

#include "weave/vec.hpp"

namespace weave {

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

  static Vectors zero() { return {Numbers<n>::Zero(), Numbers<n>::Zero(), Numbers<n>::Zero()}; }
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
  [[nodiscard]] Vectors times(double f) const { return {f * x, f * y, f * z}; }
  [[nodiscard]] Numbers<n> dot(const Vectors& o) const { return x * o.x + y * o.y + z * o.z; }
  [[nodiscard]] Numbers<n> dot(const Vec3& o) const { return x * o.x() + y * o.y() + z * o.z(); }
  [[nodiscard]] Vectors cross(const Vectors& o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
  /// Sum of the vectors, each times its weight.
  [[nodiscard]] Vec3 sum(const Numbers<n>& weight) const { return {(weight * x).sum(), (weight * y).sum(), (weight * z).sum()}; }
};

}  // namespace weave
