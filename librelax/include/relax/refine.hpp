#pragma once
#include <string>
#include <utility>
#include <vector>

#include "relax/cell.hpp"

namespace relax {

/// A cell with `fibers` digital fibers a yarn in place of its fewer ones, and the positions of its nodes; with axes of `element_length`, in
/// diameters of the finer fibers. Each coarse fiber splits into about as many finer ones, of the same solid area together, that run
/// beside it: evenly spread over its section (Vogel 1979), half a finer radius from its surface or more, in a frame that keeps the
/// direction of the cell's other axis, so that they keep their neighbors along the yarn, close where it closes and stay on their side of
/// the fibers that it touches. Coarse fibers nearest to the yarn's middle take one more where the number does not divide; those that go on
/// in one another take as many, if that can be shared out; if not, each finer fiber goes on in the one that begins nearest to where it
/// ends, and the gap is spread over a period of both. Radii shrink by sqrt(coarse / fine), as do forces and bending stiffness by coarse /
/// fine. The finer fibers may overlap at first. Throws std::invalid_argument if a yarn has more fibers already.
std::pair<Cell, std::vector<Vec3>> refine(const Cell& coarse, const Eigen::VectorXd& q, int fibers, double element_length);

/// How well finer fibers stand for coarse ones.
struct RefinementCheck {
  double area_ratio = 1;             ///< solid section of a yarn over that of its coarse fibers, of the yarn where it is farthest from one
  int order_violations = 0;          ///< crossings that are not as they were
  double overlap_before_newton = 0;  ///< deepest one where Newton's method begins [fiber diameters]

  /// The bound that it breaks, empty if none: the area is kept within 1 %, all crossings stay as they were, and no fibers overlap by more
  /// than 0.1 diameters before Newton's method, unless they are pressed together as deep in a state at rest, by `overlap_at_rest`.
  [[nodiscard]] std::string blocked_by(double overlap_at_rest) const;
};

/// Area and order of a refined cell at `q_fine`, as refine() gives it, against its coarse one at `q`.
RefinementCheck check_refinement(const Cell& coarse, const Eigen::VectorXd& q, const Cell& fine, const Eigen::VectorXd& q_fine);

}  // namespace relax
