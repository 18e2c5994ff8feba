#include "scenes/bundles.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace scenes {

using weave::Vec3;

std::vector<Eigen::Vector2d> hexagon(int rings) {
  std::vector<Eigen::Vector2d> places;
  for (int row = -rings; row <= rings; ++row) {
    const int count = 2 * rings + 1 - std::abs(row);
    for (int i = 0; i < count; ++i) places.emplace_back(2 * i - (count - 1), std::sqrt(3.0) * row);
  }
  return places;
}

weave::Snapshot empty_unit_cell(double length, double width) {
  weave::Snapshot cell;
  cell.cell_length = cell.x_max = length;
  cell.cell_width = width;
  cell.offset = {0};
  return cell;
}

void add_fiber(weave::Snapshot& cell, int yarn, bool weft, const std::vector<Vec3>& points, double radius) {
  int place = 0;
  for (const int other : cell.yarn) place += other == yarn;
  cell.yarn.push_back(yarn);
  cell.fiber.push_back(place);
  cell.weft.push_back(weft ? 1 : 0);
  cell.radius.push_back(radius);
  cell.area.push_back(std::numbers::pi * radius * radius);
  for (std::size_t i = 0; i < points.size(); ++i) {
    cell.arc.push_back(i == 0 ? 0 : cell.arc.back() + (points[i] - points[i - 1]).norm());
    cell.x.push_back(points[i]);
    cell.tension.push_back(0);
  }
  cell.offset.push_back(static_cast<std::int64_t>(cell.x.size()));
}

void add_bundle(weave::Snapshot& cell, const Bundle& b) {
  const double start = b.weft ? 0 : cell.x_min, period = b.weft ? cell.cell_width : cell.cell_length;
  for (const Eigen::Vector2d& place : b.places) {
    std::vector<Vec3> points;
    for (int i = 0; i <= b.nodes; ++i) {
      const double share = static_cast<double>(i) / b.nodes, along = start + share * period;
      const Eigen::Vector2d beside = b.radius * (Eigen::Rotation2Dd(share * b.twist) * place);
      const double z = b.height(along) + beside.y();
      points.push_back(b.weft ? Vec3(b.side - beside.x(), along, z) : Vec3(along, b.side + beside.x(), z));
    }
    add_fiber(cell, b.yarn, b.weft, points, b.radius);
  }
}

}  // namespace scenes
