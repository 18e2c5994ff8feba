#pragma once
#include "relax/minimize.hpp"

namespace relax {

enum class FirstOrderEnd {
  near,       ///< the gradient has come down to the tolerance, the steps are used up, or the state is not finite
  stagnated,  ///< neither the gradient nor the energy came down any more
  paused,     ///< it can be gone on with
};

/// Brings a cell near to a minimum, where Newton's method is at home: FIRE (Bitzek et al. 2006, Phys. Rev. Lett. 97:170201) in the metric
/// of a matrix M in place of the masses. M holds the convex part of the Hessian fiber by fiber, without what couples different fibers, and
/// contact twice: as (a - b)^2 <= 2 a^2 + 2 b^2, M is then not less than the convex Hessian, all frequencies are 1 at most and a time step
/// below 2 is stable. Neither a node nor a platen moves farther than a tenth of the smallest diameter in a step.
/// Ends when the gradient has come down to `tolerance`, its largest component over the reference tension, and to the least one of the
/// options where fibers overlap deeply, or does not come down any more, or after `steps_max` steps, or at a state that is not finite. Asks
/// `pause` when M is about to be renewed, which it need not keep then. Appends to the history, and counts contact search, assembly,
/// factorizations and solutions into the walls.
FirstOrderEnd calm_down(const Cell& cell, const std::vector<Eigen::Index>& pins, const MinimizeOptions& options, double tolerance,
                        int steps_max, const std::function<bool()>& pause, FirstOrderState& state, MinimizeResult& result);

}  // namespace relax
