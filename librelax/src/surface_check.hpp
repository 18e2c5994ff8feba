#pragma once
#include "relax/envelope.hpp"

namespace relax {

/// What exact predicates say of a surface.
struct SurfaceState {
  bool closed = false;                 ///< a closed manifold whose normals point outward
  std::size_t self_intersections = 0;  ///< pairs of triangles that cross
};
SurfaceState check_surface(const SurfaceMesh& surface);

}  // namespace relax
