#pragma once
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "weave/snapshot.hpp"

namespace weave {

inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

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
  /// Mean over the yarns' paths (YarnPath) [m]; not_measured where there are no such yarns, or a plane cuts no fiber of one.
  double yarn_width_warp = not_measured, yarn_height_warp = not_measured;
  double yarn_width_weft = not_measured, yarn_height_weft = not_measured;
};
CellMeasures measure_cell(const Snapshot& cell);

/// The measures by the names that they have in every summary, each with its unit.
std::vector<std::pair<std::string, double>> named(const CellMeasures& measures);

/// Share of a section across the warps that no fiber fills, within the cloth's local height: from the lowest to the highest fiber surface
/// over each place along y; places without any fiber are left out. For `sections` planes x = const evenly spread over a unit cell, the
/// first one half an interval behind its face. Fibers fill their outer radius. Throws std::invalid_argument if the snapshot is of no unit
/// cell.
std::vector<double> void_shares(const Snapshot& cell, int sections = 8);

/// Mean stress of warp fibers by their place in the yarn, as it was at the start of the weaving [Pa]: at the edge those of the outermost
/// ring of the bundle, of 5 fibers the outer 4; in the middle the others. not_measured where no yarn has both, as of 1 or 3 fibers.
struct StressByPlace {
  double middle = not_measured, edge = not_measured;
};
StressByPlace warp_stress_by_place(const Snapshot& cell);

/// Mean stress of the warps over each `length` [m] of cloth from the fell at x = 0 backwards [Pa], `count` of them at most, as far as the
/// snapshot reaches.
std::vector<double> warp_stress_behind_fell(const Snapshot& loom, double length, int count);

/// Difference of two successive unit cells in fiber diameters: distance between their fibers at the same share of the length from the
/// cell's face, mean and largest, after the translation that carries one cell to the other: from face to face along x, and `shift` beside
/// it, each warp slid along itself to where it fits best. The fibers of a yarn are alike, so within each yarn they are paired such that the
/// mean is least: a weft's fibers come to lie in another order at every pick. Both cells must have the same fibers in the same order
/// (std::invalid_argument).
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
