#pragma once
#include <utility>
#include <vector>

#include "relax/cell.hpp"
#include "weave/case.hpp"
#include "weave/snapshot.hpp"

namespace relax {

struct WovenOptions {
  double warp_tension = 0, weft_tension = 0;  ///< per yarn [N]; 0: the rest lengths under which the bars have their woven tensions
  double element_length = 2;                  ///< [fiber diameters]
};

/// How well the two faces of a woven cell fit, in fiber diameters.
struct FaceMismatch {
  double lean = 0;               ///< of the whole cell: mean over the warp fibers of the vector below, taken out first
  double mean = 0, largest = 0;  ///< distance from a warp fiber's end to the start of the fiber that it goes on in, a period later
  int moved = 0;                 ///< warp fibers that go on in another place of their yarn
};

struct WovenStart {
  Cell cell;
  std::vector<Vec3> x;  ///< nodes [m]
  FaceMismatch mismatch;
};

/// A unit cell out of a woven one (weave::cut_cell): each warp fiber goes on in the fiber of its yarn that starts nearest to where it ends,
/// the sum of squared distances over the yarn being least; the mean of what is left is taken out as a shear of the whole cell, which leans
/// as the cloth leads down to the breast beam. Where it is known how the warps go on beyond the last face, they lie so behind the first,
/// where they cross the same wefts a period before; else the rest of the mismatch is spread along each fiber. The middles of spans are
/// evenly spread along the woven rest lengths, on the woven axes. A fiber's path changes its length as it is closed, upright and has other
/// nodes, by more than it is stretched: so each bar keeps its woven tension, not its rest length. Throws std::invalid_argument if the
/// snapshot is of no unit cell of the case.
WovenStart cell_from_woven(const weave::Case& c, const weave::Snapshot& nodes, const WovenOptions& options);

}  // namespace relax
