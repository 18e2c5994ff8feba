#pragma once
#include "relax/envelope.hpp"
#include "separate.hpp"

namespace relax {

/// Two triangles of different yarns, or of a yarn and its image beside it, that meet.
struct TriangleCrossing {
  std::size_t surface_a, surface_b;  ///< indices in the list
  Vec3 x = Vec3::Zero();             ///< middle of the first triangle [m]
};

/// All crossings of surfaces with one another and with the images of one another and of themselves, by exact predicates.
std::vector<TriangleCrossing> find_crossings(const std::vector<YarnEnvelope>& yarns, const Lattice& lattice);

}  // namespace relax
