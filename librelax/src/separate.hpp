#pragma once
#include <vector>

#include "yarn_side.hpp"

namespace relax {

/// Lengths of the cell along x and y, whose faces are x = x_min and y = 0 and their images [m].
struct Lattice {
  double x_min = 0, length_x = 0, length_y = 0;
};

/// Moves points of the sides of yarns that come nearer to one another than `gap` [m] apart, periodic images among them, until none do;
/// points on the faces stay there. Returns the least distance left, as far as it is below `gap` and a tenth of a fiber diameter more, else
/// that [m].
double separate_yarns(std::vector<YarnSide>& sides, const Lattice& lattice, double gap);

}  // namespace relax
