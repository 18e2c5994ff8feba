#pragma once
#include <array>
#include <cstddef>

#include "relax/surface_mesh.hpp"

namespace relax {

/// What exact predicates say of a surface.
struct SurfaceState {
  bool closed = false;                 ///< a closed manifold whose normals point outward
  std::size_t self_intersections = 0;  ///< pairs of triangles that cross
};
SurfaceState check_surface(const SurfaceMesh& surface);

/// Do two triangles of these corners [m] share a point?
bool triangles_meet(const std::array<Vec3, 3>& a, const std::array<Vec3, 3>& b);

}  // namespace relax
