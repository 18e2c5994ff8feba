#pragma once
#include <vector>

#include "relax/volume_mesh.hpp"
#include "surface_distance.hpp"

namespace relax {

struct Bounds {
  Vec3 low, high;
};
Bounds bounds_of(const SurfaceMesh& surface);

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
  Bounds bounds_;
  int along_;
  double period_, lateral_period_;
  SurfaceDistance side_;
};

/// Sets direction, tangent, location and local volume fraction of the yarns' elements, which know their yarn, and sums up the yarns'
/// volumes.
void fill_fields(const weave::Snapshot& snapshot, const CompositeCell& cell, const FieldOptions& options, CompositeMesh& composite);

}  // namespace relax
