#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <utility>
#include <vector>

#include "relax/cell.hpp"

namespace relax {

/// Upper triangle of a cell's Hessian by columns: 3 x 3 blocks between nodes, then one column for each of the other unknowns (the borders).
/// The pattern is given once and holds explicit zeros, so that a symbolic factorization lasts as long as it.
class SparseHessian {
 public:
  /// pairs: nodes that are coupled (in any order, repeats allowed); border_nodes: for each border the nodes that it is coupled to;
  /// full_borders: as many of the last borders are coupled to every border before them, too.
  SparseHessian(Eigen::Index nodes, std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs,
                std::vector<std::vector<std::uint32_t>> border_nodes, Eigen::Index full_borders = 0);

  void set_zero();
  /// Adds d2U / dx_a dx_b to the block of two nodes. For a != b it stands for both triangles: add each pair once. The other order of the
  /// nodes takes the transpose. A pair outside the pattern is left out, and `complete` becomes false.
  void add(std::uint32_t a, std::uint32_t b, const Eigen::Matrix3d& block);
  void add_border(Eigen::Index border, std::uint32_t node, const Vec3& column);
  void add_corner(Eigen::Index border, double value);
  /// Between two different borders, the later of which is a full one; it stands for both triangles.
  void add_corner(Eigen::Index border_a, Eigen::Index border_b, double value);

  /// Adds a share of another one of the same pattern.
  void add(const SparseHessian& other, double share);

  [[nodiscard]] bool complete() const { return complete_; }
  [[nodiscard]] Eigen::Index size() const { return static_cast<Eigen::Index>(column_.size()) - 1; }
  [[nodiscard]] Eigen::Index nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<std::int64_t>& column() const { return column_; }  ///< size() + 1 starts
  [[nodiscard]] const std::vector<std::int64_t>& row() const { return row_; }
  [[nodiscard]] const std::vector<double>& value() const { return value_; }
  /// Node graph, upper triangle without the diagonal: rows block_row[block_column[j]] ... are coupled to node j.
  [[nodiscard]] const std::vector<std::int64_t>& block_column() const { return block_column_; }
  [[nodiscard]] const std::vector<std::uint32_t>& block_row() const { return block_row_; }

  /// Holds an unknown: its row and column become those of a diagonal matrix with the entry `diagonal`.
  void pin(const std::vector<Eigen::Index>& unknowns, double diagonal);
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& v) const;

 private:
  Eigen::Index nodes_;
  bool complete_ = true;
  std::vector<std::int64_t> block_column_, column_, row_, border_start_;
  std::vector<std::uint32_t> block_row_, border_node_;
  std::vector<double> value_;
};

}  // namespace relax
