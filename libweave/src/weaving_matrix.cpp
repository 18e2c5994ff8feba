#include "weave/weaving_matrix.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace weave {

int layer_of_pick(int pick, int layers, InsertionOrder order) {
  const bool bottom_first = order == InsertionOrder::alternating && pick / layers % 2 == 1;
  return bottom_first ? layers - 1 - pick % layers : pick % layers;
}

WeavingMatrix weaving_matrix_from_positions(const PositionMatrix& positions, int layers, InsertionOrder order) {
  if (layers < 1) throw std::invalid_argument(fmt::format("layers = {}: must be >= 1", layers));
  WeavingMatrix matrix(positions.cols() * layers, positions.rows());
  for (int warp = 0; warp < positions.rows(); ++warp) {
    for (int column = 0; column < positions.cols(); ++column) {
      const int p = positions(warp, column);
      if (p < 0 || p > layers) {
        throw std::invalid_argument(fmt::format("positions[{}][{}] = {}: must be from 0 to {} (layers)", warp, column, p, layers));
      }
      for (int pick = column * layers; pick < (column + 1) * layers; ++pick) {
        matrix(pick, warp) = layer_of_pick(pick, layers, order) >= layers - p ? 1 : -1;
      }
    }
  }
  return matrix;
}

std::optional<PositionMatrix> positions_from_weaving_matrix(const WeavingMatrix& matrix, int layers, InsertionOrder order) {
  if (layers < 1 || matrix.rows() % layers != 0) return std::nullopt;
  PositionMatrix positions(matrix.cols(), matrix.rows() / layers);
  for (Eigen::Index warp = 0; warp < positions.rows(); ++warp) {
    for (Eigen::Index column = 0; column < positions.cols(); ++column) {
      positions(warp, column) = static_cast<int>((matrix.col(warp).segment(column * layers, layers).array() == 1).count());
    }
  }
  // A column of entries is "downs then ups" exactly when it is the one that its number of ups gives.
  if (weaving_matrix_from_positions(positions, layers, order) != matrix) return std::nullopt;
  return positions;
}

WeavingMatrix weaving_matrix_from_rows(const std::vector<std::string>& rows) {
  if (rows.empty()) throw std::invalid_argument("matrix: no rows; one row per pick is expected");
  WeavingMatrix matrix;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    std::vector<int> entries;
    for (const char c : rows[row]) {
      if (c == ' ' || c == '\t') continue;
      if (c != '+' && c != '-') {
        throw std::invalid_argument(fmt::format("matrix[{}] = \"{}\": only '+' (up), '-' (down) and blanks are allowed", row, rows[row]));
      }
      entries.push_back(c == '+' ? 1 : -1);
    }
    if (entries.empty()) throw std::invalid_argument(fmt::format("matrix[{}]: no entries; one '+' or '-' per warp is expected", row));
    if (row == 0) matrix.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(entries.size()));
    if (static_cast<Eigen::Index>(entries.size()) != matrix.cols()) {
      throw std::invalid_argument(
          fmt::format("matrix[{}] = \"{}\": has {} entries, the first row has {}", row, rows[row], entries.size(), matrix.cols()));
    }
    for (std::size_t warp = 0; warp < entries.size(); ++warp) {
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(warp)) = entries[warp];
    }
  }
  return matrix;
}

std::vector<std::string> rows_of(const WeavingMatrix& matrix) {
  std::vector<std::string> rows(static_cast<std::size_t>(matrix.rows()));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    std::string& text = rows[static_cast<std::size_t>(row)];
    for (Eigen::Index warp = 0; warp < matrix.cols(); ++warp) {
      if (warp > 0) text += ' ';
      text += matrix(row, warp) > 0 ? '+' : '-';
    }
  }
  return rows;
}

WeavingMatrix assemble(const std::vector<WeavingMatrix>& sections) {
  if (sections.empty()) return {};
  Eigen::Index warps = 0;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    if (sections[s].rows() != sections[0].rows()) {
      throw std::invalid_argument(
          fmt::format("section {} has {} picks, section 0 has {}: must be the same", s, sections[s].rows(), sections[0].rows()));
    }
    warps += sections[s].cols();
  }
  WeavingMatrix fabric(sections[0].rows(), warps);
  Eigen::Index first = 0;
  for (const WeavingMatrix& section : sections) {
    fabric.middleCols(first, section.cols()) = section;
    first += section.cols();
  }
  return fabric;
}

}  // namespace weave
