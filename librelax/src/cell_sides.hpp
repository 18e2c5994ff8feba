#pragma once
#include "cell_surfaces.hpp"

namespace relax {

/// Adds triangles of the six sides of the box, about `edge_length` [m] wide, to those of the surfaces: the edges that the surfaces leave on
/// a side are edges of its triangles, and opposite sides are triangulated alike. Throws std::runtime_error naming the place on a side where
/// edges of surfaces cross.
void add_sides(CellSurfaces& surfaces, double edge_length);

}  // namespace relax
