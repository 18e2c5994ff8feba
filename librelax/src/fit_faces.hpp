#pragma once
#include <vector>

#include "weave/snapshot.hpp"
#include "weave/vec.hpp"

namespace relax {

/// Fiber in which each fiber of a cell goes on a period later (fibers); wefts go on in themselves (fibers_that_go_on).
std::vector<std::size_t> fibers_across_faces(const weave::Snapshot& cell);

/// From where a fiber would end, a period before where fiber `next` begins, to where it ends [m].
weave::Vec3 mismatch_across_faces(const weave::Snapshot& cell, std::size_t fiber, std::size_t next);

/// Mean mismatch of the warps: as the cloth leads down to the breast beam, a cell leans [m].
weave::Vec3 lean_of(const weave::Snapshot& cell, const std::vector<std::size_t>& next);

/// The axes of a cell with its first face made to fit its last one. A cell's faces cut a weft column in two. Successive columns of a cloth
/// differ, wefts by fibers' diameters: warps that cross this column at the last face and, a period before, the one before it at the first,
/// would lie within its wefts. So from the first face to the gap before the next column, warps take the paths that they have beyond the
/// last face, where they cross the other half of the same column; within that gap they go over to their own. A cell of which nothing is
/// known beyond it stays as it is.
weave::Snapshot fit_faces(const weave::Snapshot& cell);

/// A cell with its faces along x moved to where its warps run most level, if one of them climbs by more than 45 degrees where it crosses
/// its own: sections parallel to a face would cut that one at a slant. Needs a cell that is periodic, and does not lean.
weave::Snapshot with_level_faces(const weave::Snapshot& cell);

}  // namespace relax
