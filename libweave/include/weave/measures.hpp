#pragma once
#include <string>
#include <utility>
#include <vector>

#include "weave/snapshot.hpp"

namespace weave {

/// Geometry of a cloth cell (definitions used everywhere), by its fibers' smooth axes.
struct CellMeasures {
  double thickness = 0;                               ///< highest minus lowest fiber surface [m]
  double thickness_mean = 0;                          ///< distance between the mean upper and the mean lower envelope [m]
  double fiber_volume = 0;                            ///< solid [m^3]
  double fiber_volume_fraction = 0;                   ///< fiber_volume / (cell area x thickness)
  double fiber_volume_fraction_mean = 0;              ///< the same with thickness_mean
  double crimp_warp = 0, crimp_weft = 0;              ///< length / cell length - 1, mean over fibers
  double stress_max = 0;                              ///< largest fiber stress [Pa]
  double stress_mean_warp = 0, stress_mean_weft = 0;  ///< [Pa]
};
CellMeasures measure_cell(const Snapshot& cell);

/// The measures by the names that they have in every summary, each with its unit.
std::vector<std::pair<std::string, double>> named(const CellMeasures& measures);

/// Difference of two successive unit cells in fiber diameters: distance between their fibers at the same share of the length from the
/// cell's face, mean and largest, after the translation that carries one cell to the other: from face to face along x, and `shift` beside
/// it. The fibers of a yarn are alike, so within each yarn they are paired such that the mean is least: a weft's fibers come to lie in
/// another order at every pick. Both cells must have the same fibers in the same order (std::invalid_argument).
struct Steadiness {
  double mean = 0, largest = 0;
  double mean_by_label = 0;   ///< with each fiber paired with the one of its own number
  Vec3 shift = Vec3::Zero();  ///< mean displacement of the fibers beside the cell's length [m]
};
Steadiness steadiness(const Snapshot& before, const Snapshot& after);

/// A yarn where a plane normal to its period cuts it: the plane x = const for a warp, y = const for a weft.
struct YarnStation {
  double along = 0;              ///< x of the plane for a warp, y for a weft [m]
  double across = 0, z = 0;      ///< centroid of the fibers: y for a warp, x for a weft [m]
  double width = 0, height = 0;  ///< extent of the fibers across and in z, each with its own elliptic section [m]
};

/// A yarn's way through a cell.
struct YarnPath {
  int yarn = 0;
  bool weft = false;
  std::vector<YarnStation> stations;
  [[nodiscard]] double width() const;  ///< mean over the stations [m]
  [[nodiscard]] double height() const;
};

/// Each yarn of a cell, by rising number, cut at `stations` planes evenly spread over its period; the first one lies half an interval
/// behind the face, moved by `shift` [m]. A fiber that a plane does not cut is left out there. Throws std::invalid_argument if the snapshot
/// is of no unit cell, or a plane cuts no fiber of a yarn.
std::vector<YarnPath> yarn_paths(const Snapshot& cell, int stations = 64, const Vec3& shift = Vec3::Zero());

}  // namespace weave
