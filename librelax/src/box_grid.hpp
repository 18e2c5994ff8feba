#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

namespace relax {

using Box = Eigen::AlignedBox3d;

/// Boxes sorted into the cubes of a grid, to find those that overlap a box.
class BoxGrid {
 public:
  /// `cube`: edge of the cubes [m]; made larger where there would be more cubes than are worth it.
  BoxGrid(std::vector<Box> boxes, double cube);

  /// Indices of the boxes that overlap `box`, each once.
  void find(const Box& box, std::vector<std::uint32_t>& found) const;

 private:
  struct Range {
    Eigen::Array3i low, high;
  };
  [[nodiscard]] Eigen::Array3i cube_of(const Eigen::Vector3d& x) const;
  [[nodiscard]] Range cubes_of(const Box& box) const;
  [[nodiscard]] std::size_t index(int i, int j, int k) const { return (static_cast<std::size_t>(k) * size_.y() + j) * size_.x() + i; }

  std::vector<Box> boxes_;
  Box bounds_;
  double cube_ = 1;                   ///< [m]
  Eigen::Array3i size_{1, 1, 1};      ///< cubes along each axis
  std::vector<std::uint32_t> first_;  ///< boxes of cube c: entries_[first_[c]] ... entries_[first_[c + 1] - 1]
  std::vector<std::uint32_t> entries_;
};

}  // namespace relax
