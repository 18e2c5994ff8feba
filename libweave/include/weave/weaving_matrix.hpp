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

/// In which order the wefts of a column are inserted.
enum class InsertionOrder {
  top_first,    ///< the top layer first in every column (Yang 2015, 3.3)
  alternating,  ///< the top layer first in the first column, the bottom layer first in the second, and so on: straight warps then change
                ///< the shed one after another all the time, instead of all at once after each column
};

/// Layer, counted from the top from 0, of a pick counted from 0 within the unit cell.
int layer_of_pick(int pick, int layers, InsertionOrder order);

/// Weaving matrix of a section from its warp positions: where the layer i (1-based, from the top) of L is inserted the heddle is up if
/// i > L - p, else down.
/// positions: (n_warps x n_columns), entries 0...layers. Returns (n_columns*layers x n_warps).
/// Throws std::invalid_argument naming the entry and the bound it breaks.
WeavingMatrix weaving_matrix_from_positions(const PositionMatrix& positions, int layers, InsertionOrder order = InsertionOrder::top_first);

/// The inverse: warp positions of a weaving matrix whose picks are taken `layers` to a column. Empty when some warp's column of
/// entries, from the top layer to the bottom one, is not "downs then ups", or the number of rows is not a multiple of `layers`.
std::optional<PositionMatrix> positions_from_weaving_matrix(const WeavingMatrix& matrix, int layers,
                                                            InsertionOrder order = InsertionOrder::top_first);

/// Weaving matrix from text rows, one per pick, characters '+' and '-' (blanks ignored), e.g. "+--". Throws std::invalid_argument.
WeavingMatrix weaving_matrix_from_rows(const std::vector<std::string>& rows);

/// Text rows of a matrix, entries '+' and '-' separated by one blank.
std::vector<std::string> rows_of(const WeavingMatrix& matrix);

/// Side by side assembly of the sections' matrices, in the order given. All must have the same number of rows
/// (std::invalid_argument).
WeavingMatrix assemble(const std::vector<WeavingMatrix>& sections);

}  // namespace weave
