#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "weave/vec.hpp"

namespace relax {

using weave::Vec3;

/// Triangles over shared points, counterclockwise seen from outside.
struct SurfaceMesh {
  std::vector<Vec3> points;  ///< [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

}  // namespace relax
