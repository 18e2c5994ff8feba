#pragma once
#include "weave/vec.hpp"

namespace weave {

/// Stiffness that one node feels, by direction: the sum of c w k n n^T over the springs at the node, k [N/m] the stiffness of a spring
/// along the unit vector n and w the share of its end that the node carries. With any positive numbers y of the nodes, c = Y/y, Y the sum
/// of w y over the nodes of both ends, makes (n . (u_a - u_b))^2 <= sum of c w (n . u)^2 (Cauchy), so that no frequency of the nodes is
/// above omega^2 = max(largest eigenvalue / m); so does c = 2, spring by spring. The nearer the y are to how far the nodes swing in the
/// fastest oscillation, the lower is the bound (Collatz 1942).
struct DirectionalStiffness {
  double xx = 0, yy = 0, zz = 0, xy = 0, xz = 0, yz = 0;  ///< [N/m]

  void add(double k, const Vec3& n) {
    const Vec3 kn = k * n;
    xx += kn.x() * n.x();
    yy += kn.y() * n.y();
    zz += kn.z() * n.z();
    xy += kn.x() * n.y();
    xz += kn.x() * n.z();
    yz += kn.y() * n.z();
  }
  void add_all_round(double k) {
    xx += k;
    yy += k;
    zz += k;
  }
  DirectionalStiffness& operator+=(const DirectionalStiffness& o) {
    xx += o.xx;
    yy += o.yy;
    zz += o.zz;
    xy += o.xy;
    xz += o.xz;
    yz += o.yz;
    return *this;
  }
  [[nodiscard]] double trace() const { return xx + yy + zz; }  ///< not below the largest eigenvalue, at most three times it [N/m]
  [[nodiscard]] DirectionalStiffness squared() const {
    return {xx * xx + xy * xy + xz * xz, xy * xy + yy * yy + yz * yz, xz * xz + yz * yz + zz * zz,
            xx * xy + xy * yy + xz * yz, xx * xz + xy * yz + xz * zz, xy * xz + yy * yz + yz * zz};
  }
  /// Sum of the eigenvalues' eighth powers: its root is not below the largest and at most 1.15 times it [(N/m)^8].
  [[nodiscard]] double eighth_powers() const {
    const DirectionalStiffness q = squared().squared();
    return q.xx * q.xx + q.yy * q.yy + q.zz * q.zz + 2 * (q.xy * q.xy + q.xz * q.xz + q.yz * q.yz);
  }
};

}  // namespace weave
