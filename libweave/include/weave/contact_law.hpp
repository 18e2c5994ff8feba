#pragma once
#include <cmath>

namespace weave {

/// Normal law of a pair of digital fibers. Line contact, per length of fiber (Yang 2015, eq. 3-5, unequal radii by the harmonic means of
/// radius and modulus): f = 4 E_T sqrt(R delta^3) / (3 l_c), with l_c the distance of the axes and delta = D - l_c, D = R1 + R2.
struct PairLaw {
  double reach = 0;          ///< D = R1 + R2 [m]
  double inverse_reach = 0;  ///< 1/D
  double line = 0;           ///< 4 E_T sqrt(R) / 3 [N m^-3/2]

  static PairLaw of(double radius_a, double radius_b, double modulus_a, double modulus_b) {
    const double r = 2 * radius_a * radius_b / (radius_a + radius_b);
    const double e = 2 / (1 / modulus_a + 1 / modulus_b);
    const double d = radius_a + radius_b;
    return {d, 1 / d, 4 * e * std::sqrt(r) / 3};
  }

  [[nodiscard]] double line_force(double overlap) const { return line * overlap * std::sqrt(overlap) / (reach - overlap); }  ///< [N/m]
  /// k_n = E_T A_c / (l_c l_e) of eq. (4), the slope of the force at fixed l_c [N/m^2].
  [[nodiscard]] double line_stiffness(double overlap) const { return 1.5 * line * std::sqrt(overlap) / (reach - overlap); }
  struct ForceAndStiffness {
    double force, stiffness;
  };
  /// line_force and line_stiffness together.
  [[nodiscard]] ForceAndStiffness line_response(double overlap) const {
    const double slope = line * std::sqrt(overlap) / (reach - overlap);
    return {slope * overlap, 1.5 * slope};
  }
  /// Integral of line_force from 0 to `overlap` [J/m], in closed form with u = sqrt(delta).
  [[nodiscard]] double line_energy(double overlap) const {
    const double u = std::sqrt(overlap), root = std::sqrt(reach);
    if (overlap < series_below * reach) return line * overlap * overlap * u / reach * series(2.5, overlap / reach);
    return line * (2 * reach * (root * std::atanh(u / root) - u) - 2.0 / 3.0 * overlap * u);
  }

 private:
  static constexpr double series_below = 0.05;  ///< where the closed forms would lose more than four digits
  /// Sum of q^n / (n + power).
  static double series(double power, double q) {
    double sum = 0;
    for (int n = 8; n >= 0; --n) sum = sum * q + 1 / (n + power);
    return sum;
  }
};

}  // namespace weave
