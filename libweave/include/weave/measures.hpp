#pragma once
#include "weave/snapshot.hpp"

namespace weave {

/// Geometry of a cloth cell (definitions used everywhere).
struct CellMeasures {
  double thickness = 0;              ///< highest minus lowest fiber surface [m]
  double thickness_mean = 0;         ///< distance between the mean upper and the mean lower envelope [m]
  double fiber_volume = 0;           ///< solid [m^3]
  double fiber_volume_fraction = 0;  ///< fiber_volume / (cell area x thickness)
  double fiber_volume_fraction_mean = 0;  ///< the same with thickness_mean
  double crimp_warp = 0, crimp_weft = 0;  ///< length / cell length - 1, mean over fibers
  double stress_max = 0;             ///< largest fiber stress [Pa]
  double stress_mean_warp = 0, stress_mean_weft = 0;  ///< [Pa]
};
CellMeasures measure_cell(const Snapshot& cell);

/// Difference of two successive unit cells in fiber diameters: distance between their fibers at the same share of the length from the
/// cell's face, mean and largest, after the translation that carries one cell to the other: from face to face along x, and `shift` beside it. The fibers of a yarn
/// are alike, so within each yarn they are paired such that the mean is least: a weft's fibers come to lie in another order at every pick.
/// Both cells must have the same fibers in the same order (std::invalid_argument).
struct Steadiness {
  double mean = 0, largest = 0;
  double mean_by_label = 0;   ///< with each fiber paired with the one of its own number
  Vec3 shift = Vec3::Zero();  ///< mean displacement of the fibers beside the cell's length [m]
};
Steadiness steadiness(const Snapshot& before, const Snapshot& after);

}  // namespace weave
