#include "hessian_bound.hpp"

namespace relax {
namespace {

constexpr double near_touch = 1.04;  ///< radii by which fibers are seen: those that may touch after a few steps have to be in it

Cell widened(Cell cell, double contact_factor) {
  for (FiberType& type : cell.types) {
    type.radius *= near_touch;
    type.transverse_modulus *= contact_factor;
    type.compression_factor = 1;
  }
  finish_types(cell);
  return cell;
}

}  // namespace

HessianBound::HessianBound(const Cell& cell, double contact_factor) : wide_(widened(cell, 1)), stiff_(widened(cell, contact_factor)) {}

void HessianBound::add_to(SparseHessian& matrix, const Unknowns& unknowns, const ContactList& list, const Eigen::VectorXd& q,
                          bool fiber_wise) const {
  const Derivatives convex{nullptr, &matrix, true, fiber_wise};
  bar_energy(stiff_, unknowns, q, convex);
  bending_energy(stiff_, q, convex);
  ContactList nearer = list;
  for (std::size_t i = 0; i < nearer.contacts.size(); ++i) {
    const SpanContact& c = nearer.contacts[i];
    const double nearer_by = (1 - 1 / near_touch) * stiff_.pair_law(stiff_.fiber_of[c.span], stiff_.fiber_of[c.other]).reach;
    for (std::size_t s = nearer.first_sample[i]; s < nearer.first_sample[i + 1]; ++s) nearer.gap[s] -= nearer_by;
  }
  contact_energy(stiff_, nearer, q, convex);
  platen_energy(wide_, unknowns, q, convex);
}

}  // namespace relax
