#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "rings.hpp"

namespace relax {

/// Unit normals of a side, outward.
struct SideNormals {
  std::vector<Vec3> smooth;  ///< of the points of the first `rings` rings; those of the faces count both sides
  // Those with which a point's nearest place on the side tells whether it lies within (Baerentzen & Aanaes 2005).
  std::vector<Vec3> triangle;
  std::vector<std::array<Vec3, 3>> edge;  ///< of each triangle, from corner i to the next (triangles)
  std::vector<Vec3> corner;               ///< at the points of the first `rings` rings, triangles weighted by their angles
};

/// The side of a yarn's surface, without its caps: a sheet of rings that goes on periodically. Points are numbered ring by ring; those of
/// the last ring are images of the first's.
struct YarnSide {
  int yarn = 0;
  bool weft = false;
  Vec3 period = Vec3::Zero();                           ///< [m]
  double last_face = 0;                                 ///< coordinate along the period of the last ring's points [m]
  double diameter = 0;                                  ///< of the fibers [m]
  std::size_t rings = 0, points = 0, turn = 0;          ///< as in Rings, the last ring left out
  std::vector<Vec3> x;                                  ///< (rings x points) [m]
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< points of rings 0 ... rings
  std::vector<std::array<std::uint32_t, 3>> beside;     ///< the triangle beyond each edge, from corner i to the next (triangles)

  [[nodiscard]] int axis() const { return weft ? 1 : 0; }
  /// The point of the first `rings` rings that a point is or is the image of.
  [[nodiscard]] std::size_t own(std::size_t point) const { return point < x.size() ? point : (point - x.size() + turn) % points; }
  [[nodiscard]] Vec3 at(std::size_t point) const {
    Vec3 p = x[own(point)];
    if (point >= x.size()) p[axis()] = last_face;
    return p;
  }
  /// All points, the last ring among them.
  [[nodiscard]] std::vector<Vec3> all() const;
  [[nodiscard]] SideNormals normals() const;
};

/// The rings joined by triangles across the shorter diagonals.
YarnSide join_rings(const YarnFibers& yarn, const Rings& rings);

}  // namespace relax
