#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "relax/volume_mesh.hpp"

namespace relax {

/// Points on the cell's boundary by where they lie, each in one set only.
struct PointSet {
  std::string name;                   ///< FACE_X0 ... FACE_Z1, EDGE_Y0Z0 ..., CORNER_X0Y0Z0 ...: low (0) and high (1) sides
  std::vector<std::uint32_t> points;  ///< in an order in which sets of opposite sides pair off
};

/// A point on a high side and its image on the low sides.
struct PeriodicPair {
  std::uint32_t point, image;
  std::array<bool, 3> across;  ///< axes along which they are a period apart
};

struct PeriodicSets {
  std::vector<PointSet> sets;
  std::vector<PeriodicPair> pairs;                 ///< of all points on high sides of the periodic axes
  std::array<std::vector<std::uint32_t>, 3> high;  ///< all points of the high side normal to x, y, z
  std::uint32_t corner = 0;                        ///< point at the lower corner of the cell
};

/// Sorts the points of a mesh's boundary. `periodic_z`: whether the sides normal to z are paired, too. Throws std::invalid_argument naming
/// the point where one on a high side has no image with the same coordinates, to the last bit, along the side.
PeriodicSets periodic_sets(const VolumeMesh& mesh, bool periodic_z);

}  // namespace relax
