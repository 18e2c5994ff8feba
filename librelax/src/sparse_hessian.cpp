#include "relax/sparse_hessian.hpp"

#include <algorithm>
#include <cassert>

namespace relax {

SparseHessian::SparseHessian(Eigen::Index nodes, std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs,
                             std::vector<std::vector<std::uint32_t>> border_nodes, Eigen::Index full_borders)
    : nodes_(nodes) {
  for (auto& [a, b] : pairs) {
    if (a < b) std::swap(a, b);  // column, row
  }
  std::sort(pairs.begin(), pairs.end());
  pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
  const auto n = static_cast<std::size_t>(nodes);
  block_column_.assign(n + 1, 0);
  for (const auto& [column, row] : pairs) {
    if (column == row) continue;
    ++block_column_[column + 1];
    block_row_.push_back(row);
  }
  for (std::size_t j = 0; j < n; ++j) block_column_[j + 1] += block_column_[j];

  column_.push_back(0);
  for (std::size_t j = 0; j < n; ++j) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (auto k = block_column_[j]; k < block_column_[j + 1]; ++k) {
        for (int r = 0; r < 3; ++r) row_.push_back(3 * std::int64_t{block_row_[static_cast<std::size_t>(k)]} + r);
      }
      for (std::size_t r = 0; r <= c; ++r) row_.push_back(static_cast<std::int64_t>(3 * j + r));
      column_.push_back(static_cast<std::int64_t>(row_.size()));
    }
  }
  border_start_.push_back(0);
  for (std::size_t e = 0; e < border_nodes.size(); ++e) {
    std::vector<std::uint32_t>& coupled = border_nodes[e];
    std::sort(coupled.begin(), coupled.end());
    coupled.erase(std::unique(coupled.begin(), coupled.end()), coupled.end());
    for (const std::uint32_t node : coupled) {
      border_node_.push_back(node);
      for (int r = 0; r < 3; ++r) row_.push_back(3 * std::int64_t{node} + r);
    }
    border_start_.push_back(static_cast<std::int64_t>(border_node_.size()));
    const bool full = e + static_cast<std::size_t>(full_borders) >= border_nodes.size();
    for (std::size_t before = 0; full && before < e; ++before) row_.push_back(static_cast<std::int64_t>(3 * n + before));
    row_.push_back(static_cast<std::int64_t>(3 * n + e));
    column_.push_back(static_cast<std::int64_t>(row_.size()));
  }
  value_.assign(row_.size(), 0);
}

void SparseHessian::set_zero() {
  std::fill(value_.begin(), value_.end(), 0.0);
  complete_ = true;
}

void SparseHessian::add(std::uint32_t a, std::uint32_t b, const Eigen::Matrix3d& block) {
  const std::uint32_t j = std::max(a, b), i = std::min(a, b);
  const auto begin = block_row_.begin() + block_column_[j], end = block_row_.begin() + block_column_[j + 1];
  const auto offset_of_diagonal = 3 * (end - begin);
  if (a == b) {
    for (std::size_t c = 0; c < 3; ++c) {
      double* at = value_.data() + column_[3 * j + c] + offset_of_diagonal;
      for (std::size_t r = 0; r <= c; ++r) at[r] += block(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c));
    }
    return;
  }
  const auto found = std::lower_bound(begin, end, i);
  if (found == end || *found != i) {
    complete_ = false;
    return;
  }
  const auto offset = 3 * (found - begin);
  for (std::size_t c = 0; c < 3; ++c) {
    double* at = value_.data() + column_[3 * j + c] + offset;
    for (std::size_t r = 0; r < 3; ++r) {
      const auto br = static_cast<Eigen::Index>(r), bc = static_cast<Eigen::Index>(c);
      at[r] += a < b ? block(br, bc) : block(bc, br);
    }
  }
}

void SparseHessian::add_border(Eigen::Index border, std::uint32_t node, const Vec3& column) {
  const auto e = static_cast<std::size_t>(border);
  const auto begin = border_node_.begin() + border_start_[e], end = border_node_.begin() + border_start_[e + 1];
  const auto found = std::lower_bound(begin, end, node);
  if (found == end || *found != node) {
    complete_ = false;
    return;
  }
  double* at = value_.data() + column_[static_cast<std::size_t>(3 * nodes_) + e] + 3 * (found - begin);
  for (Eigen::Index r = 0; r < 3; ++r) at[r] += column[r];
}

void SparseHessian::add_corner(Eigen::Index border, double value) {
  value_[static_cast<std::size_t>(column_[static_cast<std::size_t>(3 * nodes_ + border) + 1] - 1)] += value;
}

void SparseHessian::add_corner(Eigen::Index border_a, Eigen::Index border_b, double value) {
  const Eigen::Index later = std::max(border_a, border_b), earlier = std::min(border_a, border_b);
  const std::int64_t end = column_[static_cast<std::size_t>(3 * nodes_ + later) + 1];
  value_[static_cast<std::size_t>(end - 1 - (later - earlier))] += value;
}

void SparseHessian::add(const SparseHessian& other, double share) {
  assert(other.row_ == row_);
  for (std::size_t i = 0; i < value_.size(); ++i) value_[i] += share * other.value_[i];
  complete_ = complete_ && other.complete_;
}

void SparseHessian::pin(const std::vector<Eigen::Index>& unknowns, double diagonal) {
  std::vector<std::uint8_t> pinned(static_cast<std::size_t>(size()), 0);
  for (const Eigen::Index u : unknowns) pinned[static_cast<std::size_t>(u)] = 1;
  for (std::size_t c = 0; c + 1 < column_.size(); ++c) {
    for (auto k = static_cast<std::size_t>(column_[c]); k < static_cast<std::size_t>(column_[c + 1]); ++k) {
      const auto r = static_cast<std::size_t>(row_[k]);
      if (pinned[c] || pinned[r]) value_[k] = r == c ? diagonal : 0;
    }
  }
}

Eigen::VectorXd SparseHessian::times(const Eigen::VectorXd& v) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(size());
  for (Eigen::Index c = 0; c < size(); ++c) {
    for (auto k = static_cast<std::size_t>(column_[static_cast<std::size_t>(c)]);
         k < static_cast<std::size_t>(column_[static_cast<std::size_t>(c) + 1]); ++k) {
      const Eigen::Index r = row_[k];
      result[r] += value_[k] * v[c];
      if (r != c) result[c] += value_[k] * v[r];
    }
  }
  return result;
}

}  // namespace relax
