#pragma once
#include "weave/contact_law.hpp"

namespace relax {

/// Slope of weave::PairLaw::line_force over the overlap, at a distance that changes with it [N/m^2].
inline double line_force_slope(const weave::PairLaw& law, double overlap) {
  return law.line_stiffness(overlap) + law.line_force(overlap) / (law.reach - overlap);
}

}  // namespace relax
