#pragma once
#include "outline.hpp"
#include "relax/envelope.hpp"
#include "yarn_fibers.hpp"

namespace relax {

/// A plane across a yarn, with axes in it.
struct Station {
  double share = 0;  ///< of the fibers' lengths from the first face
  double arc = 0;    ///< along the centroid path [m]
  Vec3 origin, normal, u, v;

  [[nodiscard]] Vec3 point(const Vec2& p) const { return origin + p.x() * u + p.y() * v; }
  [[nodiscard]] Vec2 plane(const Vec3& x) const { return {u.dot(x - origin), v.dot(x - origin)}; }
};

/// The fibers of a yarn at a station.
struct FiberSection {
  std::vector<Disc> discs;    ///< one for a fiber normal to the plane, some side by side for one that crosses it at a slant
  std::vector<Disc> circles;  ///< of the fibers, one each, as if normal to the plane
  double stretch = 0;         ///< mean over the fibers of the area of the slanting section to that of the circle
  double solid = 0;           ///< area of the solid fibers [m^2]

  /// Area of the union of the fibers [m^2].
  [[nodiscard]] double space() const { return stretch * union_area(circles); }
};
FiberSection cut_fibers(const YarnFibers& yarn, const Station& station);

/// Rings of points around a yarn over one period, the last ring left out: it is the first one's image.
struct Rings {
  std::vector<Station> stations;     ///< (rings)
  std::vector<Outline> outlines;     ///< (rings)
  std::vector<double> solid, space;  ///< of FiberSection (rings) [m^2]
  std::size_t points = 0;            ///< of a ring
  std::vector<Vec3> x;               ///< (rings x points) [m]
  std::size_t turn = 0;              ///< point j of the last ring goes on in point j + turn of the first one's image
  double length = 0;                 ///< of the centroid path [m]
  double ball_radius = 0;            ///< largest that was needed [m]

  [[nodiscard]] std::size_t rings() const { return stations.size(); }
};

/// Throws std::runtime_error naming fiber and place if a fiber has left its yarn, or does not cross a station's plane, as where a yarn
/// turns back on itself.
Rings ring_yarn(const YarnFibers& yarn, const EnvelopeOptions& options);

/// Outline of a yarn's fibers at a plane of its own, with the ball that fits there. Used to measure how a surface fits between its rings.
Outline outline_at(const YarnFibers& yarn, const Station& station, double ball_radius);

}  // namespace relax
