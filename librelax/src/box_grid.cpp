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

BoxGrid::Range BoxGrid::cubes_of(const Box& box) const {
  const auto cube = [&](const Eigen::Vector3d& corner) {
    const Eigen::Array3d place = ((corner - bounds_.min()).array() / cube_).floor();
    return Eigen::Array3i(place.max(0.0).min(size_.cast<double>() - 1).cast<int>());
  };
  return {cube(box.min()), cube(box.max())};
}

void BoxGrid::find(const Box& box, std::vector<std::uint32_t>& found) const {
  found.clear();
  const Range r = cubes_of(box);
  for (int k = r.low.z(); k <= r.high.z(); ++k)
    for (int j = r.low.y(); j <= r.high.y(); ++j)
      for (int i = r.low.x(); i <= r.high.x(); ++i) {
        const std::size_t c = index(i, j, k);
        for (std::uint32_t e = first_[c]; e < first_[c + 1]; ++e)
          if (boxes_[entries_[e]].intersects(box)) found.push_back(entries_[e]);
      }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
}

}  // namespace relax
