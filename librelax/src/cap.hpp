#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "outline.hpp"

namespace relax {

/// Triangles, counterclockwise, between the corners of a counterclockwise polygon: those of its constrained Delaunay triangulation that lie
/// within. Throws std::runtime_error if sides of the polygon cross.
std::vector<std::array<std::uint32_t, 3>> triangulate_polygon(const std::vector<Vec2>& polygon);

}  // namespace relax
