#pragma once
#include <utility>
#include <vector>

#include "relax/cell.hpp"
#include "weave/case.hpp"

namespace relax {

struct TopologyOptions {
  double warp_tension = 0;    ///< per yarn [N]; 0: of each section the case's
  double weft_tension = 0;    ///< per yarn [N]; 0: the loom's
  double element_length = 2;  ///< [fiber diameters]
};

/// A unit cell and the positions of its nodes from the weaving matrix alone: wefts straight, one column after another and one layer over
/// another; warps in sinusoidal paths that pass each column between the layers that the matrix wants. Fibers of a
/// yarn stand in the hexagon of weave::bundle_section, a little apart.
/// Throws std::invalid_argument if the matrix is none that warp positions describe, or a tension is < 0.
std::pair<Cell, std::vector<Vec3>> cell_from_topology(const weave::Case& c, const TopologyOptions& options);

}  // namespace relax
