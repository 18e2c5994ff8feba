#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "weave/vec.hpp"

namespace weave {

/// How the warps of a unit cell go on beyond it: poly-lines like a snapshot's.
struct Continuation {
  double length = 0;                 ///< along x [m]
  std::vector<std::int64_t> offset;  ///< per fiber of the cell, wefts having no nodes here; size n_fibers + 1, or 0 where nothing is known
  std::vector<Vec3> x;               ///< [m]
  std::vector<double> tension;       ///< mean of the adjacent bars [N]
  std::vector<double> arc;           ///< rest length from the cell's face [m]

  [[nodiscard]] bool known() const { return !offset.empty(); }
};

/// Fibers as poly-lines at one time: what pictures, results files and measures are made of.
struct Snapshot {
  double time = 0;            ///< [s]
  int pick = 0;               ///< picks finished
  double cell_width = 0;      ///< period along y [m]
  double cell_length = 0;     ///< period along x of a unit cell [m]; 0 where the snapshot is not of a cell
  double length_on_loom = 0;  ///< of a cell cut out of the loom, whose x has been drawn from it to cell_length [m]; 0 of any other
  double x_min = 0;           ///< the cell or cloth spans x_min ... x_max [m]
  double x_max = 0;

  // per fiber
  std::vector<std::int64_t> offset;  ///< nodes of fiber i are offset[i] ... offset[i+1]-1; size n_fibers + 1
  std::vector<int> yarn;             ///< yarn of the fiber; warps are numbered 0...n_warps-1, wefts n_warps + pick
  std::vector<int> fiber;            ///< place of the fiber in its yarn
  std::vector<std::uint8_t> weft;    ///< 1 for fibers of wefts; a weft's last node is its first node's periodic image at y + cell_width
  std::vector<double> radius;        ///< [m]
  std::vector<double> area;          ///< solid area [m^2]

  bool along_axis = false;  ///< whether the nodes lie on the fibers' smooth axes; if not, these are B-splines over them (on_axis)

  // per node
  std::vector<Vec3> x;          ///< [m]
  std::vector<double> tension;  ///< mean of the adjacent bars [N]
  std::vector<double> arc;      ///< rest length from the fiber's first node [m]

  Continuation beyond;  ///< of a cell cut out of the loom: its warps from x_max on, to about the next weft column

  [[nodiscard]] std::size_t fibers() const { return yarn.size(); }
  [[nodiscard]] double stress(std::size_t fiber_index, std::size_t node) const { return tension[node] / area[fiber_index]; }
};

/// The same fibers by points of their smooth axes, the quadratic B-splines over the nodes that touch (axis.hpp): the middles of the bars,
/// and a point beside each node. The nodes themselves lie outside of a bent axis. An open fiber keeps its end nodes. A snapshot along the
/// axes stays as it is.
Snapshot on_axis(const Snapshot& snapshot);

}  // namespace weave
