#include "weave/material.hpp"

#include <cmath>
#include <stdexcept>

namespace weave {
namespace {

[[noreturn]] void reject(const std::string& name, const char* constant, double value, const std::string& bound) {
  throw std::invalid_argument(name + ": " + constant + " = " + std::to_string(value) + ": must be " + bound);
}

}  // namespace

TransverseIsotropic isotropic(double e, double nu) {
  return {e, e, e / (2 * (1 + nu)), nu, nu};
}

const std::vector<KnownFiber>& known_fibers() {
  static const std::vector<KnownFiber> fibers = {
      {"e_glass", isotropic(72.4e9, 0.22), "E-glass, typical of data sheets"},
      {"s2_glass", isotropic(86.9e9, 0.23), "S-2 glass, typical of data sheets"},
      {"aramid", {84.62e9, 1.34e9, 24.4e9, 0.6, 0.24}, "Kevlar KM2: Cheng, Chen, Weerasooriya, J. Eng. Mater. Technol. 127 (2005) 197"},
      {"carbon", {225e9, 15e9, 15e9, 0.2, 15.0 / 14 - 1}, "AS4: Soden, Hinton, Kaddour, Compos. Sci. Technol. 58 (1998) 1011"},
  };
  return fibers;
}

void check_constants(const TransverseIsotropic& m, const std::string& name) {
  if (!(m.e1 > 0) || !std::isfinite(m.e1)) reject(name, "E1", m.e1, "> 0 Pa");
  if (!(m.e2 > 0) || !std::isfinite(m.e2)) reject(name, "E2", m.e2, "> 0 Pa");
  if (!(m.g12 > 0) || !std::isfinite(m.g12)) reject(name, "G12", m.g12, "> 0 Pa");
  if (!(std::abs(m.nu23) < 1)) reject(name, "nu23", m.nu23, "> -1 and < 1");
  if (!(std::abs(m.nu12) < m.nu12_bound()))
    reject(name, "nu12", m.nu12, "within +-sqrt((1 - nu23) E1 / (2 E2)) = " + std::to_string(m.nu12_bound()));
}

}  // namespace weave
