#pragma once
#include <vector>

#include "relax/envelope.hpp"

namespace relax {

/// Least distance from points to a set of triangles, found through a binary tree of boxes.
class SurfaceDistance {
 public:
  explicit SurfaceDistance(const std::vector<std::array<Vec3, 3>>& triangles);

  /// [m]; `bound` where the surface is no nearer than that.
  [[nodiscard]] double from(const Vec3& point, double bound) const;

 private:
  struct Box {
    Vec3 low, high;
    std::uint32_t first, count;  ///< triangles of a leaf; an inner box has none
    std::uint32_t right;         ///< second child; the first one follows its parent
  };
  void build(std::uint32_t first, std::uint32_t end);

  std::vector<std::array<Vec3, 3>> triangles_;
  std::vector<Box> boxes_;
};

}  // namespace relax
