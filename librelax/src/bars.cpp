#include <cmath>

#include "relax/energy.hpp"

namespace relax {
namespace {

/// psi, psi' and psi'' of a bar's energy E A rho psi(e).
struct StrainEnergy {
  double value, force, stiffness;
};

StrainEnergy linear(double e) {
  return {0.5 * e * e, e, 1};
}

StrainEnergy slackening(double e, double compression_factor, double width) {
  const double c = compression_factor;
  StrainEnergy tension{0, 0, 0};
  if (e >= width) {
    tension = {0.5 * e * e + width * width / 6, e, 1};
  } else if (e > -width) {
    const double s = e + width;
    tension = {s * s * s / (12 * width), s * s / (4 * width), s / (2 * width)};
  }
  return {0.5 * c * e * e + (1 - c) * tension.value, c * e + (1 - c) * tension.force, c + (1 - c) * tension.stiffness};
}

/// A bar as it stands: its vector, length, rest length, and strain energy.
struct Bar {
  std::uint32_t next;
  int wrap;  ///< periods to its end
  Vec3 along;
  double length, rest, axial;  ///< [m], [m], E A [N]
  StrainEnergy strain;
};

std::vector<double> rest_sums(const Cell& cell) {
  std::vector<double> sum(cell.fibers(), 0);
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) sum[cell.fiber_of[i]] += cell.rest_length[i];
  return sum;
}

Bar bar_at(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, std::uint32_t i, double rest_sum) {
  const std::uint32_t f = cell.fiber_of[i];
  const Cell::ChainNode next = cell.after(i);
  Bar bar;
  bar.next = next.node;
  bar.wrap = next.wrap;
  bar.along = q.segment<3>(3 * Eigen::Index{next.node}) - q.segment<3>(3 * Eigen::Index{i});
  if (next.wrap != 0) bar.along += cell.period(f, q);
  bar.length = bar.along.norm();
  bar.along /= bar.length;
  const Eigen::Index drawn = unknowns.drawn[f];
  bar.rest = drawn >= 0 ? cell.rest_length[i] * (1 + q[drawn] / rest_sum) : cell.rest_length[i];
  const FiberType& type = cell.type_of(f);
  bar.axial = type.youngs_modulus * type.area;
  const double e = bar.length / bar.rest - 1;
  bar.strain = drawn >= 0 ? linear(e) : slackening(e, type.compression_factor, cell.slack_strain);
  return bar;
}

}  // namespace

double bar_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want, double* tension_work) {
  const std::vector<double> rest_sum = rest_sums(cell);
  double energy = 0;
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const std::uint32_t f = cell.fiber_of[i];
    const Eigen::Index drawn = unknowns.drawn[f];
    const Bar bar = bar_at(cell, unknowns, q, i, rest_sum[f]);
    const Eigen::Index axis = cell.axis_of(f);
    const Eigen::Index length = bar.wrap != 0 ? unknowns.length[static_cast<std::size_t>(axis)] : -1;  // grows as the bar's end moves
    const auto [psi, force, stiffness] = bar.strain;
    const double pull = bar.axial * force, ratio = bar.length / bar.rest;
    const double share = cell.rest_length[i] / rest_sum[f];  // d rest / d drawn
    energy += bar.axial * bar.rest * psi;
    if (want.gradient) {
      want.gradient->segment<3>(3 * Eigen::Index{bar.next}) += pull * bar.along;
      want.gradient->segment<3>(3 * Eigen::Index{i}) -= pull * bar.along;
      if (drawn >= 0) (*want.gradient)[drawn] += share * bar.axial * (psi - force * ratio);
      if (length >= 0) (*want.gradient)[length] += pull * bar.along[axis];
    }
    if (want.hessian) {
      const double stretch = bar.axial * stiffness / bar.rest;
      const double turn = want.convex ? std::max(pull, 0.0) / bar.length : pull / bar.length;
      const Eigen::Matrix3d block = (stretch - turn) * bar.along * bar.along.transpose() + turn * Eigen::Matrix3d::Identity();
      want.hessian->add(i, i, block);
      want.hessian->add(bar.next, bar.next, block);
      want.hessian->add(i, bar.next, -block);
      if (drawn >= 0) {
        const Eigen::Index border = unknowns.border(drawn);
        const Vec3 mixed = -share * stretch * ratio * bar.along;
        want.hessian->add_border(border, bar.next, mixed);
        want.hessian->add_border(border, i, -mixed);
        want.hessian->add_corner(border, share * share * stretch * ratio * ratio);
        if (length >= 0) want.hessian->add_corner(border, unknowns.border(length), mixed[axis]);
      }
      if (length >= 0) {
        want.hessian->add_border(unknowns.border(length), bar.next, block.col(axis));
        want.hessian->add_border(unknowns.border(length), i, -block.col(axis));
        want.hessian->add_corner(unknowns.border(length), block(axis, axis));
      }
    }
  }
  double work = 0;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    if (unknowns.drawn[f] < 0) continue;
    const FiberType& type = cell.type_of(f);
    const double price = cell.tension[f] * (1 + 0.5 * cell.tension[f] / (type.youngs_modulus * type.area));
    work += price * (rest_sum[f] + q[unknowns.drawn[f]] - (cell.weft[f] ? cell.length_y : cell.length_x));
    if (want.gradient) (*want.gradient)[unknowns.drawn[f]] += price;
  }
  if (tension_work) *tension_work = work;
  return energy;
}

std::vector<Vec3> lay_axes(Cell& cell, const std::vector<Vec3>& points, const std::vector<double>& strain) {
  const std::vector<Vec3> x = nodes_through(cell, points);
  const Unknowns unknowns(cell);
  const Eigen::VectorXd q = unknowns_at(cell, x);
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) cell.rest_length[i] = bar_at(cell, unknowns, q, i, 1).length / (1 + strain[i]);
  return x;
}

double strain_under(const FiberType& type, double tension, double slack_strain) {
  const double c = type.compression_factor, force = tension / (type.youngs_modulus * type.area), w = slack_strain;
  if (force >= w) return force;
  if (force <= -c * w) return force / c;
  // c e + (1 - c) s^2 / (4 w) = force, s = e + w > 0.
  const double square = (1 - c) / (4 * w);
  return (std::sqrt(c * c + 4 * square * (c * w + force)) - c) / (2 * square) - w;
}

std::vector<double> bar_tensions(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q) {
  const std::vector<double> rest_sum = rest_sums(cell);
  std::vector<double> tension(cell.nodes());
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const Bar bar = bar_at(cell, unknowns, q, i, rest_sum[cell.fiber_of[i]]);
    tension[i] = bar.axial * bar.strain.force;
  }
  return tension;
}

}  // namespace relax
