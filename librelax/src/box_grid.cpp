#include "box_grid.hpp"

#include <algorithm>
#include <cmath>

namespace relax {

BoxGrid::BoxGrid(std::vector<Box> boxes, double cube) : boxes_(std::move(boxes)), cube_(cube) {
  constexpr double cubes_max = 4e6;
  for (const Box& box : boxes_) bounds_.extend(box);
  if (boxes_.empty()) bounds_.extend(Eigen::Vector3d::Zero());
  const Eigen::Array3d extent = bounds_.sizes().array();
  while ((extent / cube_ + 1).prod() > cubes_max) cube_ *= 1.25;
  size_ = (extent / cube_).floor().cast<int>() + 1;
  first_.assign(static_cast<std::size_t>(size_.prod()) + 1, 0);
  const auto each_cube = [&](const auto& visit) {
    for (std::size_t b = 0; b < boxes_.size(); ++b) {
      const Range r = cubes_of(boxes_[b]);
      for (int k = r.low.z(); k <= r.high.z(); ++k)
        for (int j = r.low.y(); j <= r.high.y(); ++j)
          for (int i = r.low.x(); i <= r.high.x(); ++i) visit(index(i, j, k), static_cast<std::uint32_t>(b));
    }
  };
  each_cube([&](std::size_t c, std::uint32_t) { ++first_[c + 1]; });
  for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
  entries_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  each_cube([&](std::size_t c, std::uint32_t b) { entries_[next[c]++] = b; });
}

Eigen::Array3i BoxGrid::cube_of(const Eigen::Vector3d& x) const {
  const Eigen::Array3d place = ((x - bounds_.min()).array() / cube_).floor();
  return place.max(0.0).min(size_.cast<double>() - 1).cast<int>();
}

BoxGrid::Range BoxGrid::cubes_of(const Box& box) const {
  return {cube_of(box.min()), cube_of(box.max())};
}

void BoxGrid::find(const Box& box, std::vector<std::uint32_t>& found) const {
  found.clear();
  if (!box.intersects(bounds_)) return;
  const Range r = cubes_of(box);
  for (int k = r.low.z(); k <= r.high.z(); ++k)
    for (int j = r.low.y(); j <= r.high.y(); ++j)
      for (int i = r.low.x(); i <= r.high.x(); ++i) {
        const std::size_t c = index(i, j, k);
        for (std::uint32_t e = first_[c]; e < first_[c + 1]; ++e) {
          const Box& other = boxes_[entries_[e]];
          if (!other.intersects(box)) continue;
          // Of the cubes that both boxes reach into, the one with the lowest corner of what they share.
          const Eigen::Array3i lowest = cube_of(box.min().cwiseMax(other.min()));
          if (lowest.x() == i && lowest.y() == j && lowest.z() == k) found.push_back(entries_[e]);
        }
      }
}

}  // namespace relax
