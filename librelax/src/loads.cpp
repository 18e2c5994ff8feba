#include <array>

#include "relax/energy.hpp"

namespace relax {

double load_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want) {
  const std::array<double, 2> load = {cell.load_x.value_or(0), cell.load_y.value_or(0)};
  double energy = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    if (unknowns.length[k] < 0) continue;
    energy -= load[k] * q[unknowns.length[k]];
    if (want.gradient) (*want.gradient)[unknowns.length[k]] -= load[k];
  }
  return energy;
}

Eigen::Vector2d borne_loads(const Cell& cell, const Eigen::VectorXd& q, const ContactSampling& sampling) {
  Cell free = cell;
  Eigen::VectorXd at = q;
  settle_lengths(free, at);
  free.load_x = free.load_y = 0;
  const Unknowns unknowns(free);
  at.conservativeResize(unknowns.size);
  at.tail<2>().setZero();
  Eigen::VectorXd gradient;
  potential(free, unknowns, find_contacts(free, at, 0, sampling), at, {&gradient, nullptr, false});
  return gradient.tail<2>();
}

}  // namespace relax
