#include "surface_distance.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace relax {
namespace {

constexpr std::uint32_t leaf_size = 4;

double squared_distance_to_segment(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 d = b - a;
  const double length2 = d.squaredNorm();
  const double t = length2 > 0 ? std::clamp((p - a).dot(d) / length2, 0.0, 1.0) : 0;
  return (p - a - t * d).squaredNorm();
}

double squared_distance(const Vec3& p, const std::array<Vec3, 3>& t) {
  const Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double norm2 = normal.squaredNorm();
  bool over = norm2 > 0;
  for (std::size_t i = 0; over && i < 3; ++i) over = normal.cross(t[(i + 1) % 3] - t[i]).dot(p - t[i]) >= 0;
  if (over) {
    const double height = normal.dot(p - t[0]);
    return height * height / norm2;
  }
  return std::min(
      {squared_distance_to_segment(p, t[0], t[1]), squared_distance_to_segment(p, t[1], t[2]), squared_distance_to_segment(p, t[2], t[0])});
}

}  // namespace

SurfaceDistance::SurfaceDistance(const std::vector<std::array<Vec3, 3>>& triangles) : triangles_(triangles) {
  if (!triangles_.empty()) build(0, static_cast<std::uint32_t>(triangles_.size()));
}

void SurfaceDistance::build(std::uint32_t first, std::uint32_t end) {
  const std::size_t here = boxes_.size();
  Box box{triangles_[first][0], triangles_[first][0], first, end - first, 0};
  for (std::uint32_t i = first; i < end; ++i)
    for (const Vec3& x : triangles_[i]) {
      box.low = box.low.cwiseMin(x);
      box.high = box.high.cwiseMax(x);
    }
  boxes_.push_back(box);
  if (end - first <= leaf_size) return;
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const std::uint32_t middle = first + (end - first) / 2;
  const auto at = [this](std::uint32_t i) { return triangles_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(first), at(middle), at(end), [axis](const auto& a, const auto& b) {
    return a[0][axis] + a[1][axis] + a[2][axis] < b[0][axis] + b[1][axis] + b[2][axis];
  });
  boxes_[here].count = 0;
  build(first, middle);
  boxes_[here].right = static_cast<std::uint32_t>(boxes_.size());
  build(middle, end);
}

double SurfaceDistance::from(const Vec3& point, double bound) const {
  if (boxes_.empty()) return bound;
  double best = bound * bound;
  std::vector<std::uint32_t> stack{0};
  while (!stack.empty()) {
    const std::uint32_t index = stack.back();
    stack.pop_back();
    const Box& box = boxes_[index];
    if ((point - point.cwiseMax(box.low).cwiseMin(box.high)).squaredNorm() >= best) continue;
    for (std::uint32_t i = box.first; i < box.first + box.count; ++i) best = std::min(best, squared_distance(point, triangles_[i]));
    if (box.count > 0) continue;
    // The nearer child is looked into first.
    const Box &left = boxes_[index + 1], &right = boxes_[box.right];
    const double to_left = (point - 0.5 * (left.low + left.high)).squaredNorm(),
                 to_right = (point - 0.5 * (right.low + right.high)).squaredNorm();
    stack.push_back(to_left < to_right ? box.right : index + 1);
    stack.push_back(to_left < to_right ? index + 1 : box.right);
  }
  return std::sqrt(best);
}

}  // namespace relax
