#pragma once
#include <vector>

#include "relax/volume_mesh.hpp"
#include "surface_distance.hpp"

namespace relax {

struct Bounds {
  Vec3 low, high;
};
Bounds bounds_of(const SurfaceMesh& surface);

/// Where a yarn's surface ends.
struct YarnEnds {
  int along;         ///< axis of the yarn
  double low, high;  ///< [m]
  double near;       ///< what counts as there [m]
  [[nodiscard]] bool at(const Vec3& x, double end) const;
};
YarnEnds ends_of(const YarnEnvelope& yarn);

/// Triangles of a yarn's surface but those of its caps.
std::vector<std::array<std::uint32_t, 3>> side_triangles(const SurfaceMesh& surface, const YarnEnds& ends);

/// The cell that a mesh of a composite fills, and its yarns by rising number.
struct CompositeCell {
  Vec3 low, high;  ///< x_min ... x_min + cell_length, 0 ... cell_width, lowest ... highest envelope and the resin margin [m]
  std::vector<const YarnEnvelope*> yarns;
};
/// Throws std::invalid_argument for no envelopes, a yarn twice, a snapshot of no periodic cell, a negative margin, or an envelope that does
/// not span its period.
CompositeCell composite_cell(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, double resin_margin);

/// Distance to a yarn without end: without the caps of its surface, and from the neighboring periods too.
class YarnDistance {
 public:
  YarnDistance(const YarnEnvelope& yarn, const CompositeCell& cell);
  [[nodiscard]] double from(const Vec3& point) const;  ///< [m]

 private:
  int along_;
  Vec3 middle_;  ///< of the surface's bounds
  double period_, lateral_period_;
  SurfaceDistance side_;
};

/// Sets direction, tangent, location and local volume fraction of the yarns' elements, which know their yarn, and sums up the yarns'
/// volumes.
void fill_fields(const weave::Snapshot& snapshot, const CompositeCell& cell, const FieldOptions& options, CompositeMesh& composite);

}  // namespace relax
