#pragma once
#include <optional>
#include <vector>

#include "yarn_side.hpp"

namespace relax {

/// Lengths of the cell along x and y [m].
struct Lattice {
  double length_x = 0, length_y = 0;
};

/// A place where one yarn lies within another.
struct Intrusion {
  std::size_t side_a = 0, side_b = 0;  ///< indices in the list of sides
  Vec3 x = Vec3::Zero();               ///< [m]
  double depth = 0;                    ///< [m]
  Vec3 shift = Vec3::Zero();           ///< of the image of side_b that it lies in [m]
  bool axis_inside = false;            ///< the fiber's axis lies within too
  double length = 0;                   ///< of fiber that it stands for [m]
};

/// Where surfaces of fibers, sampled every half diameter, lie within the side of another yarn. `yarns` and `sides` belong together.
std::vector<Intrusion> find_intrusions(const std::vector<YarnFibers>& yarns, const std::vector<YarnSide>& sides, const Lattice& lattice);

/// Points of sides that lie within other yarns' sides.
std::vector<Intrusion> find_overlaps(const std::vector<YarnSide>& sides, const Lattice& lattice);

/// Moves points of the sides of yarns that come nearer to one another than `gap` [m] apart, each a hundredth of it farther than it must,
/// periodic images among them; points on the faces stay there. Returns the place that is worst if some do not come apart.
std::optional<Intrusion> separate_yarns(std::vector<YarnSide>& sides, const Lattice& lattice, double gap);

/// Least distance between two sides that do not cross, as far as it is below `reach`, else that [m].
double least_distance(const std::vector<YarnSide>& sides, const Lattice& lattice, double reach);

}  // namespace relax
