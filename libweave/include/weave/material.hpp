#pragma once
#include <cmath>
#include <string>
#include <vector>

namespace weave {

/// Elastic constants of a material that is isotropic across one axis, 1.
struct TransverseIsotropic {
  double e1 = 0, e2 = 0;      ///< [Pa]
  double g12 = 0;             ///< [Pa]
  double nu12 = 0, nu23 = 0;  ///< contraction across under a stress along 1, and under one across in the other direction across
  [[nodiscard]] double g23() const { return e2 / (2 * (1 + nu23)); }
  /// What |nu12| must be below for the strain energy to be positive.
  [[nodiscard]] double nu12_bound() const { return std::sqrt(0.5 * (1 - nu23) * e1 / e2); }
};
TransverseIsotropic isotropic(double e, double nu);

/// Fibers by name, with where their constants are from; the constants of glass are those of an isotropic material.
struct KnownFiber {
  const char* name;
  TransverseIsotropic constants;
  const char* source;
};
const std::vector<KnownFiber>& known_fibers();

/// Throws std::invalid_argument naming the constant, its value and bound, unless the strain energy is positive; `name` is the material's.
void check_constants(const TransverseIsotropic& material, const std::string& name);

}  // namespace weave
