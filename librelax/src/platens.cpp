#include "line_law.hpp"
#include "relax/energy.hpp"
#include "spline.hpp"

namespace relax {
namespace {

constexpr int samples = 8;  ///< on a span of two diameters, as between yarns but for a factor of two

}  // namespace

double platen_energy(const Cell& cell, const Unknowns& unknowns, const Eigen::VectorXd& q, Derivatives want) {
  if (unknowns.platens < 0) return 0;
  const double load = cell.pressure * cell.length_x * cell.length_y;
  double energy = load * (q[unknowns.platens + 1] - q[unknowns.platens]);
  if (want.gradient) {
    (*want.gradient)[unknowns.platens] -= load;
    (*want.gradient)[unknowns.platens + 1] += load;
  }
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const std::uint32_t f = cell.fiber_of[i];
    const double radius = cell.type_of(f).radius, weight = cell.span_length(i) / samples;
    const PairLaw& law = cell.pair_law(f, f);
    const Span span(cell, q, i);
    for (int side = 0; side < 2; ++side) {
      const double up = side == 0 ? -1 : 1;  // outwards
      const Eigen::Index platen = unknowns.platens + side;
      for (int s = 0; s < samples; ++s) {
        const double u = (s + 0.5) / samples;
        const double overlap = up * (span.point(u).z() - q[platen]) + radius;
        if (overlap <= 0) continue;
        energy += 0.5 * weight * law.line_energy(2 * overlap);
        const double force = weight * law.line_force(2 * overlap), slope = 2 * weight * line_force_slope(law, 2 * overlap);
        const Vec3 share = span_weights(u);
        if (want.gradient) {
          (*want.gradient)[platen] -= up * force;
          for (std::size_t a = 0; a < 3; ++a) {
            (*want.gradient)[3 * Eigen::Index{span.node[a]} + 2] += up * force * share[static_cast<Eigen::Index>(a)];
          }
        }
        if (!want.hessian) continue;
        const Eigen::Index border = unknowns.border(platen);
        want.hessian->add_corner(border, slope);
        for (std::size_t a = 0; a < 3; ++a) {
          const double share_a = share[static_cast<Eigen::Index>(a)];
          want.hessian->add_border(border, span.node[a], Vec3(0, 0, -slope * share_a));
          for (std::size_t b = a; b < 3; ++b) {
            Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
            block(2, 2) = slope * share_a * share[static_cast<Eigen::Index>(b)];
            want.hessian->add(span.node[a], span.node[b], block);
          }
        }
      }
    }
  }
  return energy;
}

}  // namespace relax
