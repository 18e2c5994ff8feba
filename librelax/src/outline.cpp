#include "outline.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relax {
namespace {

constexpr double pi = std::numbers::pi;

double cross(const Vec2& a, const Vec2& b) {
  return a.x() * b.y() - a.y() * b.x();
}

/// An angle moved to 0 ... 2 pi.
double turned(double angle) {
  angle = std::fmod(angle, 2 * pi);
  return angle < 0 ? angle + 2 * pi : angle;
}

bool contains(const std::vector<Vec2>& polygon, const Vec2& p) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const Vec2 &a = polygon[i], &b = polygon[j];
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < (b.x() - a.x()) * (p.y() - a.y()) / (b.y() - a.y()) + a.x()) inside = !inside;
  }
  return inside;
}

/// The next disc that a ball meets as it rolls counterclockwise around a disc.
struct Meeting {
  std::size_t disc = 0;
  double turn = 2 * pi;  ///< of the ball about the center of the disc it rolls on [rad]
};

Meeting next_meeting(const std::vector<Disc>& discs, std::size_t on, std::size_t last, double direction, double ball) {
  constexpr double tie = 1e-9;  // a ball that touches several discs at once goes on to each in turn; rounding is far below [rad]
  const double reach = discs[on].radius + ball;
  Meeting first{on, 2 * pi};
  for (std::size_t i = 0; i < discs.size(); ++i) {
    if (i == on) continue;
    const Vec2 gap = discs[i].center - discs[on].center;
    const double distance = gap.norm(), other = discs[i].radius + ball;
    if (distance >= reach + other || distance <= std::abs(reach - other) || distance == 0) continue;
    const double half = std::acos(std::clamp((reach * reach + distance * distance - other * other) / (2 * reach * distance), -1.0, 1.0));
    double turn = turned(std::atan2(gap.y(), gap.x()) - half - direction);
    if (i != last && turn > 2 * pi - tie) turn = 0;
    if (turn < first.turn) first = {i, turn};
  }
  return first;
}

}  // namespace

double OutlineArc::length() const {
  return radius * std::abs(sweep);
}

Vec2 OutlineArc::at(double share) const {
  const double angle = from + share * sweep;
  return center + radius * Vec2(std::cos(angle), std::sin(angle));
}

std::vector<Vec2> Outline::points(std::size_t count, double start) const {
  std::vector<Vec2> result;
  result.reserve(count);
  std::size_t arc = 0;
  double before = 0;  // length of the arcs up to `arc`
  int rounds = 0;
  start -= std::floor(start);
  for (std::size_t k = 0; k < count; ++k) {
    const double wanted = (start + static_cast<double>(k) / static_cast<double>(count)) * length;
    while (before + arcs[arc].length() < wanted && rounds < 2) {
      before += arcs[arc].length();
      if (++arc == arcs.size()) {
        arc = 0;
        ++rounds;
      }
    }
    const double along = arcs[arc].length();
    result.push_back(arcs[arc].at(along > 0 ? std::min(1.0, (wanted - before) / along) : 0));
  }
  return result;
}

double Outline::share_on_ray(const Vec2& origin) const {
  constexpr int pieces = 8;  // of an arc; the ray's place on a chord is as good as on the arc
  double farthest = -INFINITY, share = 0, before = 0;
  for (const OutlineArc& arc : arcs) {
    for (int i = 0; i < pieces; ++i) {
      const Vec2 a = arc.at(static_cast<double>(i) / pieces) - origin, b = arc.at(static_cast<double>(i + 1) / pieces) - origin;
      if ((a.y() < 0) == (b.y() < 0)) continue;
      const double u = a.y() / (a.y() - b.y());
      const double out = a.x() + u * (b.x() - a.x());
      if (out <= farthest) continue;
      farthest = out;
      share = (before + (i + u) / pieces * arc.length()) / length;
    }
    before += arc.length();
  }
  return share;
}

std::optional<Outline> roll_ball(const std::vector<Disc>& discs, double ball) {
  Outline outline;
  // From a disc that the ball surely touches: the one that comes farthest out along +u, with the ball beside it.
  std::size_t start = 0;
  const auto out = [&](std::size_t i) { return discs[i].center.x() + discs[i].radius; };
  for (std::size_t i = 1; i < discs.size(); ++i)
    if (out(i) > out(start)) start = i;
  std::size_t on = start, last = start;
  double direction = 0;
  const std::size_t steps_max = 8 * discs.size() + 8;
  for (std::size_t step = 0;; ++step) {
    if (step > steps_max) return std::nullopt;
    const Meeting next = next_meeting(discs, on, last, direction, ball);
    const Disc& disc = discs[on];
    // Back at the start when the ball comes by its first place.
    const double to_first = step == 0 ? 2 * pi : turned(-direction);
    if (on == start && next.turn >= to_first - 1e-12) {
      outline.arcs.push_back({disc.center, disc.radius, direction, to_first});
      break;
    }
    if (next.turn >= 2 * pi) return std::nullopt;
    outline.arcs.push_back({disc.center, disc.radius, direction, next.turn});
    const double toward = direction + next.turn;
    const Vec2 at = disc.center + (disc.radius + ball) * Vec2(std::cos(toward), std::sin(toward));
    const Vec2 back = disc.center - at, on_to = discs[next.disc].center - at;
    const double from = std::atan2(back.y(), back.x());
    double sweep = turned(std::atan2(on_to.y(), on_to.x()) - from);
    // The ball lies to the right of the outline, which runs around it clockwise.
    if (sweep > 0) sweep -= 2 * pi;
    if (sweep < -2 * pi + 1e-9) sweep = 0;
    outline.arcs.push_back({at, ball, from, sweep});
    last = on;
    on = next.disc;
    direction = std::atan2(-on_to.y(), -on_to.x());
  }
  for (const OutlineArc& arc : outline.arcs) outline.length += arc.length();

  constexpr double sample = 0.25;  // of the smallest radius: finer than any neck that matters
  double smallest = INFINITY;
  for (const Disc& disc : discs) smallest = std::min(smallest, disc.radius);
  const std::vector<Vec2> polygon =
      outline.points(static_cast<std::size_t>(std::max(16.0, std::ceil(outline.length / (sample * smallest)))));
  if (!is_simple(polygon) || moments_of(polygon).area <= 0) return std::nullopt;
  for (const Disc& disc : discs)
    if (!contains(polygon, disc.center)) return std::nullopt;
  return outline;
}

PolygonMoments moments_of(const std::vector<Vec2>& polygon) {
  PolygonMoments m;
  const Vec2 origin = polygon.front();
  Vec2 first = Vec2::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i] - origin, b = polygon[(i + 1) % polygon.size()] - origin;
    const double twice = cross(a, b);
    m.area += twice / 2;
    first += twice / 6 * (a + b);
    const Vec2 sum = a + b;
    second += twice / 24 * (a * a.transpose() + b * b.transpose() + sum * sum.transpose());
  }
  if (m.area == 0) return m;
  const Vec2 mean = first / m.area;
  m.centroid = origin + mean;
  m.second = second - m.area * mean * mean.transpose();
  return m;
}

bool is_simple(const std::vector<Vec2>& polygon) {
  // Sides sorted by their least u; each is compared with those that begin before it ends.
  struct Side {
    double low, high;
    std::size_t index;
  };
  const std::size_t n = polygon.size();
  std::vector<Side> sides;
  for (std::size_t i = 0; i < n; ++i) {
    const double a = polygon[i].x(), b = polygon[(i + 1) % n].x();
    sides.push_back({std::min(a, b), std::max(a, b), i});
  }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return a.low < b.low || (a.low == b.low && a.index < b.index); });
  for (std::size_t s = 0; s < n; ++s) {
    const Vec2 &a = polygon[sides[s].index], &b = polygon[(sides[s].index + 1) % n];
    for (std::size_t t = s + 1; t < n && sides[t].low <= sides[s].high; ++t) {
      const std::size_t i = sides[s].index, j = sides[t].index;
      if (i == j || (i + 1) % n == j || (j + 1) % n == i) continue;
      const Vec2 &c = polygon[j], &d = polygon[(j + 1) % n];
      if (cross(b - a, c - a) * cross(b - a, d - a) <= 0 && cross(d - c, a - c) * cross(d - c, b - c) <= 0) return false;
    }
  }
  return true;
}

double union_area(const std::vector<Disc>& discs) {
  double area = 0;
  for (std::size_t i = 0; i < discs.size(); ++i) {
    const double a = discs[i].radius;
    area += pi * a * a;
    for (std::size_t j = i + 1; j < discs.size(); ++j) {
      const double b = discs[j].radius, d = (discs[i].center - discs[j].center).norm();
      if (d >= a + b) continue;
      if (d <= std::abs(a - b)) {
        area -= pi * std::min(a, b) * std::min(a, b);
        continue;
      }
      const double at_a = std::acos((d * d + a * a - b * b) / (2 * d * a)), at_b = std::acos((d * d + b * b - a * a) / (2 * d * b));
      area -= a * a * (at_a - std::sin(at_a) * std::cos(at_a)) + b * b * (at_b - std::sin(at_b) * std::cos(at_b));
    }
  }
  return area;
}

}  // namespace relax
