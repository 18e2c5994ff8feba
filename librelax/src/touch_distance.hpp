#pragma once
#include <cstddef>

#include "relax/surface_mesh.hpp"
#include "rings.hpp"
#include "yarn_fibers.hpp"

namespace relax {

/// Distances from the points where a ball rolled around a yarn touches its fibers to the yarn's surface.
struct TouchDistance {
  double sum = 0, largest = 0, protrusion = 0;  ///< protrusion: of such a point out of the surface; in fiber radii
  Vec3 largest_at = Vec3::Zero();               ///< [m]
  std::size_t count = 0;
};

/// The points lie in the planes of `rings` and halfway between them. `ball`: its radius [m]; `side_triangles`: the first ones of the
/// surface, those that are not on faces of the cell.
TouchDistance measure_touch(const YarnFibers& yarn, const Rings& rings, const SurfaceMesh& surface, std::size_t side_triangles,
                            double ball);

}  // namespace relax
