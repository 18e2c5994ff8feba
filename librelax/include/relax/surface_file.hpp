#pragma once
#include <filesystem>

#include "relax/envelope.hpp"

namespace relax {

/// Reads a closed triangulated surface from an OFF file (Geomview's ASCII format: "OFF", counts, points, "3 a b c" per triangle, #
/// comments). Throws std::runtime_error naming the file, the line and what is wrong: not OFF, a facet that is no triangle, an index out of
/// range, a coordinate that is not finite, an edge that has not exactly one triangle on each side, or triangles that face inward.
SurfaceMesh read_closed_off(const std::filesystem::path& file);

/// Volume that a closed surface bounds, by the divergence theorem [m^3].
double enclosed_volume(const SurfaceMesh& surface);

}  // namespace relax
