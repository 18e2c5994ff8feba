#pragma once
#include <functional>
#include <vector>

#include "weave/snapshot.hpp"

namespace scenes {

/// Centers of a hexagonal packing of 1 + 3 k (k + 1) fibers of radius 1 that touch, k the number of rings around the middle one.
std::vector<Eigen::Vector2d> hexagon(int rings);

/// A unit cell without fibers [m].
weave::Snapshot empty_unit_cell(double length, double width);

/// Adds a fiber along points [m].
void add_fiber(weave::Snapshot& cell, int yarn, bool weft, const std::vector<weave::Vec3>& points, double radius);

/// A yarn whose fibers run through the cell at places beside its path. A warp's path at x is (x, side, height(x)), a weft's
/// at y (side, y, height(y)); a place (u, v) lies beside it by u along y, or -x, and by v upward, after a turn that grows evenly to `twist`
/// [rad] over the period. `nodes` per fiber; fibers of solid area pi radius^2.
struct Bundle {
  int yarn = 0;
  bool weft = false;
  double side = 0;                                                  ///< [m]
  std::function<double(double)> height = [](double) { return 0; };  ///< [m]
  std::vector<Eigen::Vector2d> places;                              ///< in radii
  double radius = 5e-5;                                             ///< [m]
  double twist = 0;
  int nodes = 40;
};
void add_bundle(weave::Snapshot& cell, const Bundle& bundle);

}  // namespace scenes
