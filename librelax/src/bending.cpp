#include <array>
#include <cmath>

#include "relax/energy.hpp"
#include "spline.hpp"

namespace relax {

double bending_energy(const Cell& cell, const Eigen::VectorXd& q, Derivatives want) {
  constexpr std::array<double, 3> weight = {1, -2, 1};
  const Unknowns unknowns(cell);
  double energy = 0;
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const double stiffness = cell.type_of(cell.fiber_of[i]).bending_stiffness;
    if (stiffness <= 0) continue;
    const Span span(cell, q, i);
    const double k = stiffness / std::pow(cell.span_length(i), 3);
    energy += 0.5 * k * span.curve.squaredNorm();
    const Eigen::Index axis = cell.axis_of(cell.fiber_of[i]), length = unknowns.length[static_cast<std::size_t>(axis)];
    const double wraps = span.wrap[0] + span.wrap[2];  // the weights of both are 1
    const bool grows = length >= 0 && wraps != 0;
    if (grows && want.gradient) (*want.gradient)[length] += k * wraps * span.curve[axis];
    if (grows && want.hessian) {
      const Eigen::Index border = unknowns.border(length);
      want.hessian->add_corner(border, k * wraps * wraps);
      for (std::size_t a = 0; a < 3; ++a) want.hessian->add_border(border, span.node[a], k * wraps * weight[a] * Vec3::Unit(axis));
    }
    for (std::size_t a = 0; a < 3; ++a) {
      if (want.gradient) want.gradient->segment<3>(3 * Eigen::Index{span.node[a]}) += k * weight[a] * span.curve;
      if (!want.hessian) continue;
      for (std::size_t b = a; b < 3; ++b) {
        want.hessian->add(span.node[a], span.node[b], k * weight[a] * weight[b] * Eigen::Matrix3d::Identity());
      }
    }
  }
  return energy;
}

}  // namespace relax
