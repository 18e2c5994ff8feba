#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace relax {

using Vec2 = Eigen::Vector2d;

struct Disc {
  Vec2 center;
  double radius;
};

/// A piece of an outline: an arc on a disc, or one of the ball that touches two discs.
struct OutlineArc {
  Vec2 center;
  double radius = 0;
  double from = 0;   ///< direction from the center to the arc's start [rad]
  double sweep = 0;  ///< counterclockwise > 0: on a disc; < 0: of the ball [rad]

  [[nodiscard]] double length() const;
  [[nodiscard]] Vec2 at(double share) const;
};

/// Outline of a set of discs, counterclockwise: the path of the points where a ball touches them as it is rolled around from outside. It is
/// the boundary of the alpha shape of the discs' centers (Edelsbrunner, Kirkpatrick & Seidel 1983), with arcs in place of its edges.
struct Outline {
  std::vector<OutlineArc> arcs;
  double length = 0;

  /// `count` points, evenly spaced along the outline from the one at `start` (0 ... 1 of the length).
  [[nodiscard]] std::vector<Vec2> points(std::size_t count, double start = 0) const;
  /// Share of the length at which the outline comes farthest out on the ray from `origin` along +u.
  [[nodiscard]] double share_on_ray(const Vec2& origin) const;
};

/// Rolls a ball of the given radius around the discs. Empty if it leaves a disc outside, or passes through a neck narrower than itself,
/// so that the outline would cross itself.
std::optional<Outline> roll_ball(const std::vector<Disc>& discs, double ball_radius);

/// Area, centroid and second moments of a polygon.
struct PolygonMoments {
  double area = 0;  ///< > 0 if counterclockwise
  Vec2 centroid = Vec2::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();  ///< integral of (x - centroid)(x - centroid)^T
};
PolygonMoments moments_of(const std::vector<Vec2>& polygon);

/// Does no side of a closed polygon cross another?
bool is_simple(const std::vector<Vec2>& polygon);

/// Area of the union of discs of which no three overlap.
double union_area(const std::vector<Disc>& discs);

}  // namespace relax
