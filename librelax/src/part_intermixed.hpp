#pragma once
#include <vector>

#include "separate.hpp"

namespace relax {

/// Where yarns are intermixed, moves points of their sides that lie where another yarn's fibers are denser than their own back to where
/// both are as dense: single fibers that have gone astray there may come to lie outside of their yarn's side. Looks at points near the
/// places alone. `yarns` and `sides` belong together; `places`: of find_intrusions.
void part_intermixed(const std::vector<YarnFibers>& yarns, std::vector<YarnSide>& sides, const Lattice& lattice,
                     const std::vector<Intrusion>& places);

}  // namespace relax
