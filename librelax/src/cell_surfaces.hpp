#pragma once
#include <array>
#include <compare>
#include <cstdint>
#include <vector>

#include "composite_cell.hpp"

namespace relax {

/// A point of the periodic cell as a corner of a triangle in its box: on the high side along an axis where `high` is set, which only a
/// point on the low side may be.
struct BoxCorner {
  std::uint32_t point = 0;
  std::array<std::uint8_t, 3> high{0, 0, 0};
  auto operator<=>(const BoxCorner&) const = default;
};

struct BoxTriangle {
  std::array<BoxCorner, 3> corners;
  std::int32_t yarn = -1;  ///< index into CompositeCell::yarns, counterclockwise seen from outside; -1: on a side of the box
};

/// The yarns' surfaces within the box of the cell, without caps, cut where they pass its sides normal to x and y. A point on a side stands
/// for all its images on the opposite one.
struct CellSurfaces {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< of the box [m]
  std::vector<Vec3> points;                      ///< low <= x < high [m]
  std::vector<BoxTriangle> triangles;
  std::array<std::vector<std::array<BoxCorner, 2>>, 2> side_edges;  ///< of the triangles on the low sides normal to x and y, each once

  [[nodiscard]] Vec3 position(const BoxCorner& corner) const;  ///< to the last bit the side's on a side
};

/// Cuts the surfaces. Points nearer to a side than a fiftieth of their shortest edge move onto it. Throws std::runtime_error naming the
/// yarn whose surface is not the same on both ends of its period.
CellSurfaces surfaces_in_box(const CompositeCell& cell);

}  // namespace relax
