#pragma once
#include "relax/energy.hpp"

namespace relax {

/// Bound on the convex part of a cell's Hessian that holds for a step to come, too: no bar is slack in it, as it may be taut after the
/// step, and fibers count as touching that nearly do.
class HessianBound {
 public:
  /// contact_factor: by how much contact between fibers counts more than it does.
  HessianBound(const Cell& cell, double contact_factor);

  /// Adds the bound at `q` to a matrix [N/m]; the list holds the contacts there. fiber_wise: without what couples different fibers.
  void add_to(SparseHessian& matrix, const Unknowns& unknowns, const ContactList& list, const Eigen::VectorXd& q, bool fiber_wise) const;

 private:
  Cell wide_, stiff_;  ///< thicker fibers that are never slack; of the second, contact counts more
};

}  // namespace relax
