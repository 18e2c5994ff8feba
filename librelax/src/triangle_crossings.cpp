#include "triangle_crossings.hpp"

#include <algorithm>
#include <cmath>

#include "box_grid.hpp"
#include "surface_check.hpp"

namespace relax {
namespace {

std::array<Vec3, 3> corners(const SurfaceMesh& surface, std::size_t index, const Vec3& shift) {
  const auto& t = surface.triangles[index];
  return {surface.points[t[0]] + shift, surface.points[t[1]] + shift, surface.points[t[2]] + shift};
}

std::vector<Box> boxes_of(const SurfaceMesh& surface) {
  std::vector<Box> boxes;
  for (const auto& t : surface.triangles) {
    boxes.emplace_back(surface.points[t[0]]);
    boxes.back().extend(surface.points[t[1]]).extend(surface.points[t[2]]);
  }
  return boxes;
}

}  // namespace

std::vector<TriangleCrossing> find_crossings(const std::vector<YarnEnvelope>& yarns, const Lattice& lattice) {
  std::vector<TriangleCrossing> crossings;
  std::vector<std::vector<Box>> boxes;
  std::vector<Box> whole(yarns.size());
  for (std::size_t y = 0; y < yarns.size(); ++y) {
    boxes.push_back(boxes_of(yarns[y].surface));
    for (const Box& box : boxes[y]) whole[y].extend(box);
  }
  std::vector<std::uint32_t> found;
  for (std::size_t a = 0; a < yarns.size(); ++a) {
    double edge = 0;
    for (const Box& box : boxes[a]) edge += 2 * box.sizes().maxCoeff() / static_cast<double>(boxes[a].size());
    const BoxGrid grid(boxes[a], edge);
    for (std::size_t b = a; b < yarns.size(); ++b) {
      const auto first = [&](int axis, double period) {
        return static_cast<int>(std::ceil((whole[a].min() - whole[b].max())[axis] / period));
      };
      const auto last = [&](int axis, double period) {
        return static_cast<int>(std::floor((whole[a].max() - whole[b].min())[axis] / period));
      };
      for (int i = first(0, lattice.length_x); i <= last(0, lattice.length_x); ++i) {
        for (int j = first(1, lattice.length_y); j <= last(1, lattice.length_y); ++j) {
          if (a == b && (yarns[a].weft ? i <= 0 : j <= 0)) continue;  // itself, its own next period, and what the opposite image finds
          const Vec3 shift(i * lattice.length_x, j * lattice.length_y, 0);
          for (std::size_t t = 0; t < boxes[b].size(); ++t) {
            const Box moved(boxes[b][t].min() + shift, boxes[b][t].max() + shift);
            if (!moved.intersects(whole[a])) continue;
            grid.find(moved, found);
            for (const std::uint32_t f : found) {
              if (!triangles_meet(corners(yarns[a].surface, f, Vec3::Zero()), corners(yarns[b].surface, t, shift))) continue;
              crossings.push_back({a, b, boxes[a][f].center()});
            }
          }
        }
      }
    }
  }
  return crossings;
}

}  // namespace relax
