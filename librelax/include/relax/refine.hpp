#pragma once
#include <utility>
#include <vector>

#include "relax/cell.hpp"

namespace relax {

/// A cell with `fibers` digital fibers a yarn in place of its fewer ones, and the positions of its nodes; with axes of `element_length`, in
/// diameters of the finer fibers. Each coarse fiber splits into about as many finer ones, of the same solid area together, that run
/// beside it: evenly spread over its section (Vogel 1979), half a finer radius from its surface or more, in a frame that keeps the
/// direction of the cell's other axis, so that they keep their neighbors along the yarn, close where it closes and stay on their side of
/// the fibers that it touches. Coarse fibers nearest to the yarn's middle take one more where the number does not divide. Radii shrink by
/// sqrt(coarse / fine), as do forces and bending stiffness by coarse / fine. The finer fibers may overlap at first. Throws
/// std::invalid_argument if a yarn has more fibers already, or if fibers that go on in one another leave no way to share out the number.
std::pair<Cell, std::vector<Vec3>> refine(const Cell& coarse, const Eigen::VectorXd& q, int fibers, double element_length);

}  // namespace relax
