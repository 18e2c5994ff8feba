#pragma once
#include <cmath>

#include "weave/vec.hpp"

namespace weave {

/// Stiffness that one node feels, by direction: the sum of c w k n n^T over the springs at the node, k [N/m] the stiffness of a spring
/// along the unit vector n and w the share of its end that the node carries. With any positive numbers y of the nodes, c = Y/y, Y the sum
/// of w y over the nodes of both ends, makes (n . (u_a - u_b))^2 <= sum of c w (n . u)^2 (Cauchy), so that no frequency of the nodes is
/// above omega^2 = max(largest eigenvalue / m); so does c = 2, spring by spring. The nearer the y are to how far the nodes swing in the
/// fastest oscillation, the lower is the bound (Collatz 1942).
struct DirectionalStiffness {
  using Numbers = Eigen::Array<float, 8, 1, Eigen::DontAlign>;
  Numbers k = Numbers::Zero();  ///< xx yy zz xy xz yz, and two zeros: added as one [N/m]

  /// Springs of `normal` along the unit vector n and of `across` along every direction normal to it.
  static DirectionalStiffness along(const Vec3& n, double normal, double across) {
    DirectionalStiffness s;
    s.add(normal - across, n);
    s.add_all_round(across);
    return s;
  }
  void add(double stiffness, const Vec3& n) {
    const Vec3 kn = stiffness * n;
    const Eigen::Array<double, 8, 1> all{
        kn.x() * n.x(), kn.y() * n.y(), kn.z() * n.z(), kn.x() * n.y(), kn.x() * n.z(), kn.y() * n.z(), 0, 0};
    k += all.cast<float>();
  }
  void add_all_round(double stiffness) { k.head<3>() += static_cast<float>(stiffness); }
  DirectionalStiffness& operator+=(const DirectionalStiffness& o) {
    k += o.k;
    return *this;
  }
  /// Not below the largest eigenvalue, at most three times it [N/m].
  [[nodiscard]] double trace() const { return double{k[0]} + k[1] + k[2]; }
  /// Eighth root of the sum of the eigenvalues' eighth powers: not below the largest and at most 1.15 times it [N/m].
  [[nodiscard]] double largest() const {
    Eigen::Array<double, 6, 1> q = k.head<6>().cast<double>();
    for (int i = 0; i < 2; ++i) {  // squared, twice
      const double xx = q[0], yy = q[1], zz = q[2], xy = q[3], xz = q[4], yz = q[5];
      q << xx * xx + xy * xy + xz * xz, xy * xy + yy * yy + yz * yz, xz * xz + yz * yz + zz * zz,  //
          xx * xy + xy * yy + xz * yz, xx * xz + xy * yz + xz * zz, xy * xz + yy * yz + yz * zz;
    }
    return std::sqrt(std::sqrt(std::sqrt(q.head<3>().square().sum() + 2 * q.tail<3>().square().sum())));
  }
};

}  // namespace weave
