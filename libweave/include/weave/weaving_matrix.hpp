#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

namespace weave {

/// Weaving matrix of one warp section or of a whole fabric: one row per pick (step), one column per warp; entry +1 when the heddle is
/// up, -1 when it is down (Yang 2015, 3.3).
using WeavingMatrix = Eigen::MatrixXi;

/// Warp position matrix: one row per warp (top to bottom), one column per weft column; entry = number of weft layers below the warp in
/// that column, 0...layers (Yang 2015, 3.3).
using PositionMatrix = Eigen::MatrixXi;

/// Weaving matrix of a section from its warp positions. Within a column the top layer is inserted first; at the j-th (1-based) of the L
/// insertions the heddle is up if j > L - p, else down.
/// positions: (n_warps x n_columns), entries 0...layers. Returns (n_columns*layers x n_warps).
/// Throws std::invalid_argument naming the entry and the bound it breaks.
WeavingMatrix weaving_matrix_from_positions(const PositionMatrix& positions, int layers);

/// The inverse: warp positions of a weaving matrix whose picks are taken `layers` to a column. Empty when some warp's column of
/// entries is not "downs then ups", or the number of rows is not a multiple of `layers`.
std::optional<PositionMatrix> positions_from_weaving_matrix(const WeavingMatrix& matrix, int layers);

/// Weaving matrix from text rows, one per pick, characters '+' and '-' (blanks ignored), e.g. "+--". Throws std::invalid_argument.
WeavingMatrix weaving_matrix_from_rows(const std::vector<std::string>& rows);

/// Text rows of a matrix, entries '+' and '-' separated by one blank.
std::vector<std::string> rows_of(const WeavingMatrix& matrix);

/// Side by side assembly of the sections' matrices, in the order given. All must have the same number of rows
/// (std::invalid_argument).
WeavingMatrix assemble(const std::vector<WeavingMatrix>& sections);

}  // namespace weave
