#pragma once
#include <vector>

#include "weave/measures.hpp"
#include "weave/weaving_matrix.hpp"

namespace weave {

/// Whether the yarns of a unit cell lie where the weave has them, without loops.
struct ClothOrder {
  double column_spread = not_measured;  ///< largest distance along x between two wefts of a column, by their means [m]
  /// Along x from each weft column to the next one, from the cell's back to its front; the last one from the front column to the back
  /// column of the next cell [m].
  std::vector<double> column_distances;
  int wefts_out_of_layer = 0;  ///< by their mean height on the wrong side of the weft that was inserted before them into their column
  double fiber_slack = 0;      ///< length of a fiber over the mean of its yarn's fibers - 1, the largest
  double sharpest_turn = 0;    ///< largest angle between two successive bars of a fiber [rad]
};

/// `layers`: wefts over one another in a column. Throws std::invalid_argument if the snapshot is of no unit cell, or its wefts do not
/// make whole columns.
ClothOrder cloth_order(const Snapshot& cell, int layers, InsertionOrder insertion = InsertionOrder::top_first);

/// Distances along x of successive weft columns on a loom, from the fell backwards [m]. They settle as more wefts are beaten up behind
/// them: a unit cell should be taken where they have come to the taking-up. warps: yarns before the wefts.
std::vector<double> column_distances_behind_fell(const Snapshot& loom, int warps, int layers);

}  // namespace weave
