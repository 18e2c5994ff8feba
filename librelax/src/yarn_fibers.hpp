#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "weave/snapshot.hpp"
#include "weave/vec.hpp"

namespace relax {

using weave::Vec3;

/// The fibers of one yarn over one period, each from the first face to the last, going on in another fiber of the yarn.
struct YarnFibers {
  int yarn = 0;
  bool weft = false;
  Vec3 period = Vec3::Zero();               ///< along x or y [m]
  double first_face = 0, last_face = 0;     ///< coordinates of the faces that it runs through [m]
  std::vector<int> number;                  ///< of the fibers, as in weave::Snapshot
  std::vector<std::vector<Vec3>> points;    ///< (fibers x points) [m]
  std::vector<std::vector<double>> share;   ///< of the fiber's length up to a point, 0 ... 1
  std::vector<double> length;               ///< [m]
  std::vector<std::size_t> next, previous;  ///< fiber that goes on where this one ends, and its inverse
  std::vector<double> radius, area;         ///< [m], [m^2]

  [[nodiscard]] std::size_t size() const { return points.size(); }
  [[nodiscard]] int axis() const { return weft ? 1 : 0; }
  [[nodiscard]] std::string name() const;                      ///< "warp 3"
  [[nodiscard]] std::string name_of(std::size_t fiber) const;  ///< "fiber 5 of warp 3"
  /// Point of a fiber at a share of its length, which may reach into the periods before and after.
  [[nodiscard]] Vec3 at(std::size_t fiber, double share_wanted) const;
  /// Mean over the fibers [m].
  [[nodiscard]] Vec3 center(double share_wanted) const;

  /// Where a fiber passes a plane.
  struct Crossing {
    Vec3 x;          ///< [m]
    Vec3 direction;  ///< unit vector along the fiber
    bool found = false;
  };
  /// The crossing with the plane through `origin` nearest along the fiber to a share of its length, within half a period.
  [[nodiscard]] Crossing crossing(std::size_t fiber, double near_share, const Vec3& origin, const Vec3& normal) const;
};

/// Fiber in which each fiber of a yarn goes on a period later: the one that starts nearest to where it ends, the sum of squared distances
/// being least. starts, ends: the fibers' first and last points (fibers) [m].
std::vector<std::size_t> fibers_that_go_on(const std::vector<Vec3>& starts, const std::vector<Vec3>& ends, const Vec3& period);

struct PeriodicYarns {
  std::vector<YarnFibers> yarns;  ///< warps by rising number, then wefts
  double lean = 0;                ///< of the cell, in fiber diameters
  double mismatch = 0;            ///< largest across the faces as they were cut, in fiber diameters
};

/// Distance up to which a fiber's end is drawn to where it goes on a period later [fiber diameters]. Successive cells of a woven cloth that
/// is not quite steady differ by up to seven.
inline constexpr double mismatch_max = 10;

/// A place for a message: "(x, y, z) mm".
std::string place_text(const Vec3& x);

/// The yarns of a unit cell whose faces are x = x_min, x = x_max, y = 0 and y = cell_width. Throws std::invalid_argument naming what is
/// wrong if it is no unit cell, with the worst fiber where the cell is not periodic.
PeriodicYarns periodic_yarns(const weave::Snapshot& cell);

/// The fibers of yarns as a snapshot of the cell that they are of, without tensions.
weave::Snapshot snapshot_of(const std::vector<YarnFibers>& yarns, const weave::Snapshot& cell);

}  // namespace relax
