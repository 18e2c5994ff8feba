#pragma once
#include <cstddef>
#include <vector>

#include "weave/snapshot.hpp"

namespace weave {

enum class SectionAxis {
  x,  ///< the plane is normal to x; the section shows y, z
  y,  ///< the plane is normal to y; the section shows x, z
};

/// Where a fiber crosses a plane: an ellipse, the section of a cylinder of the fiber's radius.
struct SectionCircle {
  std::size_t fiber = 0;  ///< index of the fiber in the snapshot
  std::size_t node = 0;   ///< the crossing lies between this node and the next
  int yarn = 0;           ///< yarn of the fiber
  bool weft = false;
  double u = 0;        ///< center, y in a section normal to x and x in one normal to y, of the fiber as stored [m]
  double z = 0;        ///< center [m]
  double radius = 0;   ///< of the fiber: the small half-axis [m]
  double aspect = 1;   ///< long half-axis / radius, 1 ... max_section_aspect
  double angle = 0;    ///< of the long half-axis from the u axis towards z [rad]
  double tension = 0;  ///< [N]
  double stress = 0;   ///< [Pa]
};

/// A fiber that runs nearly parallel to the plane is drawn out into an ellipse no longer than this many radii.
inline constexpr double max_section_aspect = 6;

/// All crossings of the snapshot's fibers with the plane x = value or y = value [m], fiber by fiber along each. The plane stands for
/// its periodic images too (period cell_width along y; cell_length along x where that is not 0), so that a fiber that crosses an
/// image is found, each crossing once; u and z are of the fiber as stored. To fill a picture, repeat by the period of u:
/// section_period.
std::vector<SectionCircle> cut_section(const Snapshot& snapshot, SectionAxis axis, double value);

/// Period of u in a section [m]; 0 where it has none.
double section_period(const Snapshot& snapshot, SectionAxis axis);

}  // namespace weave
