#include "rings.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "weave/section.hpp"

namespace relax {
namespace {

constexpr double ball_growth = 1.25;  ///< from one try to the next, and from a section to its neighbor
constexpr int growths_max = 40;
constexpr double stray_max =
    5;  ///< gap between a fiber and the rest of its yarn in a section [fiber diameters]; of a loose woven one up to 3

/// The path of the fibers' centroid, finely sampled, and its length up to each sample.
struct CenterPath {
  std::vector<Vec3> x;
  std::vector<double> arc;  ///< [m]
  Vec3 period;

  [[nodiscard]] double share_at(double arc_wanted) const {
    const auto after = std::upper_bound(arc.begin() + 1, arc.end() - 1, arc_wanted);
    const auto i = static_cast<std::size_t>(after - arc.begin()) - 1;
    return (static_cast<double>(i) + (arc_wanted - arc[i]) / (arc[i + 1] - arc[i])) / static_cast<double>(x.size() - 1);
  }
};

CenterPath center_path(const YarnFibers& yarn, double spacing) {
  const auto pieces = static_cast<std::size_t>(std::max(16.0, std::ceil(4 * yarn.length.front() / spacing)));
  CenterPath path;
  path.period = yarn.period;
  for (std::size_t i = 0; i <= pieces; ++i) {
    path.x.push_back(yarn.center(static_cast<double>(i) / static_cast<double>(pieces)));
    path.arc.push_back(i == 0 ? 0 : path.arc.back() + (path.x[i] - path.x[i - 1]).norm());
  }
  return path;
}

/// Axes in the plane, u nearest to the direction across the yarn.
void set_axes(Station& station, bool weft) {
  const Vec3 lateral = weft ? Vec3(-1, 0, 0) : Vec3(0, 1, 0);
  station.u = (lateral - lateral.dot(station.normal) * station.normal).normalized();
  station.v = station.normal.cross(station.u);
}

/// A ring's neighbors must lie on the right sides of its plane.
bool crosses(const std::vector<Vec3>& ring, const std::vector<Vec3>& after, const Station& station, const Station& station_after) {
  const double least = 0.02 * (station_after.arc - station.arc);
  for (const Vec3& p : after)
    if (station.normal.dot(p - station.origin) < least) return true;
  for (const Vec3& p : ring)
    if (station_after.normal.dot(p - station_after.origin) > -least) return true;
  return false;
}

/// Rim points of the fibers at a station, in space.
std::vector<Vec3> rim_of(const FiberSection& section, const Station& station) {
  std::vector<Vec3> rim;
  for (const Disc& disc : section.discs)
    for (int i = 0; i < 8; ++i) {
      const double turn = std::numbers::pi * i / 4;
      rim.push_back(station.point(disc.center + 1.1 * disc.radius * Vec2(std::cos(turn), std::sin(turn))));
    }
  return rim;
}

std::vector<Vec3> moved(std::vector<Vec3> points, const Vec3& shift) {
  for (Vec3& p : points) p += shift;
  return points;
}

/// Planes along the yarn: normal to its path, turned parallel to the faces near these, and smoothed where neighbors would cross within the
/// yarn.
std::vector<Station> place_stations(const YarnFibers& yarn, double spacing, double& length, std::vector<FiberSection>& sections) {
  const CenterPath path = center_path(yarn, spacing);
  length = path.arc.back();
  const auto count = static_cast<std::size_t>(std::max(4L, std::lround(length / spacing)));
  const Vec3 along = yarn.period.normalized();
  double height = 0;  // of the fibers above and below the path, near enough
  for (std::size_t f = 0; f < yarn.size(); ++f)
    height = std::max(height, yarn.radius[f] + std::abs((yarn.points[f].front() - path.x.front()).z()));
  std::vector<Station> stations(count);
  for (std::size_t k = 0; k < count; ++k) {
    Station& s = stations[k];
    s.arc = length * static_cast<double>(k) / static_cast<double>(count);
    s.share = path.share_at(s.arc);
    s.origin = yarn.center(s.share);
    const double window = spacing / length;
    const Vec3 tangent = (yarn.center(s.share + window) - yarn.center(s.share - window)).normalized();
    const double from_face = std::min(s.arc, length - s.arc) / (2 * height);
    const double blend = from_face >= 1 ? 1 : from_face * from_face * (3 - 2 * from_face);
    s.normal = (blend * tangent + (1 - blend) * along).normalized();
  }
  stations.front().origin[yarn.axis()] = yarn.first_face;

  constexpr int rounds_max = 200;
  sections.resize(count);
  std::vector<std::vector<Vec3>> rims(count);
  std::vector<bool> changed(count, true);
  for (int round = 0;; ++round) {
    for (std::size_t k = 0; k < count; ++k) {
      if (!changed[k]) continue;
      set_axes(stations[k], yarn.weft);
      sections[k] = cut_fibers(yarn, stations[k]);
      rims[k] = rim_of(sections[k], stations[k]);
    }
    std::vector<bool> smooth(count, false);
    bool any = false;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t n = (k + 1) % count;
      Station after = stations[n];
      if (n == 0) {
        after.origin += yarn.period;
        after.arc += length;
      }
      if (!crosses(rims[k], n == 0 ? moved(rims[n], yarn.period) : rims[n], stations[k], after)) continue;
      any = smooth[k] = smooth[n] = true;
    }
    if (!any || round == rounds_max) return stations;
    const std::vector<Station> before = stations;
    changed.assign(count, false);
    for (std::size_t k = 1; k < count; ++k) {
      if (!smooth[k] && !smooth[k - 1] && !smooth[(k + 1) % count]) continue;
      stations[k].normal = (before[k - 1].normal + before[k].normal + before[(k + 1) % count].normal).normalized();
      changed[k] = true;
    }
  }
}

/// The fiber farthest from the others of a section.
struct Stray {
  std::size_t fiber = 0;
  double gap = 0;  ///< to the nearest of those that are nearer to the middle [m]
};

/// Joins the fibers from the one nearest to their middle on, each time the one nearest to those joined before (Prim 1957).
Stray farthest_off(const std::vector<Disc>& fibers) {
  Vec2 middle = Vec2::Zero();
  for (const Disc& d : fibers) middle += d.center / static_cast<double>(fibers.size());
  std::size_t next = 0;
  for (std::size_t f = 1; f < fibers.size(); ++f)
    if ((fibers[f].center - middle).squaredNorm() < (fibers[next].center - middle).squaredNorm()) next = f;
  std::vector<double> gap(fibers.size(), INFINITY);
  std::vector<bool> joined(fibers.size(), false);
  Stray stray;
  for (std::size_t count = 1; count < fibers.size(); ++count) {
    const Disc& last = fibers[next];
    joined[next] = true;
    std::size_t nearest = fibers.size();
    for (std::size_t f = 0; f < fibers.size(); ++f) {
      if (joined[f]) continue;
      gap[f] = std::min(gap[f], (fibers[f].center - last.center).norm() - fibers[f].radius - last.radius);
      if (nearest == fibers.size() || gap[f] < gap[nearest]) nearest = f;
    }
    if (gap[nearest] > stray.gap) stray = {nearest, gap[nearest]};
    next = nearest;
  }
  return stray;
}

/// A fiber that has left its yarn would be held by a ball far larger than the yarn, if by any.
void expect_together(const YarnFibers& yarn, const std::vector<Station>& stations, const std::vector<FiberSection>& sections) {
  Stray worst;
  std::size_t at = 0;
  for (std::size_t k = 0; k < sections.size(); ++k) {
    const Stray stray = farthest_off(sections[k].circles);
    if (stray.gap <= worst.gap) continue;
    worst = stray;
    at = k;
  }
  const double gap = worst.gap / (2 * yarn.radius[worst.fiber]);
  if (gap <= stray_max) return;
  throw std::runtime_error(fmt::format(
      "{} leaves its yarn: at {} it is {:.3g} fiber diameters away from the yarn's other fibers; at most {:g} are held in one surface",
      yarn.name_of(worst.fiber), place_text(stations[at].point(sections[at].circles[worst.fiber].center)), gap, stray_max));
}

/// How many growths the ball needs at each station; from one to the next it changes by one at most, so that the surface does not step.
std::vector<int> fit_balls(const YarnFibers& yarn, const std::vector<Station>& stations, const std::vector<FiberSection>& sections,
                           double ball, std::vector<Outline>& outlines) {
  const std::size_t count = sections.size();
  std::vector<int> growths(count, 0), tried(count, -1);
  outlines.assign(count, {});
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t k = 0; k < count; ++k) {
      for (; tried[k] != growths[k]; ++growths[k]) {
        if (growths[k] > growths_max)
          throw std::runtime_error(
              fmt::format("{}: no ball holds its fibers together in the section at {}", yarn.name(), place_text(stations[k].origin)));
        tried[k] = growths[k];
        if (std::optional<Outline> outline = roll_ball(sections[k].discs, ball * std::pow(ball_growth, growths[k]))) {
          outlines[k] = std::move(*outline);
          break;
        }
      }
    }
    for (std::size_t k = 0; k < count; ++k) {
      const int least = std::max(growths[(k + 1) % count], growths[(k + count - 1) % count]) - 1;
      if (growths[k] >= least) continue;
      growths[k] = least;
      changed = true;
    }
  }
  return growths;
}

/// Share of the outline from which its points lie nearest to those of the ring before, as vectors from the origins, by trying starts around
/// `guess`.
double fit_start(const Outline& outline, const std::vector<Vec2>& before, double guess) {
  const auto badness = [&](double start) {
    const std::vector<Vec2> points = outline.points(before.size(), start);
    double sum = 0;
    for (std::size_t j = 0; j < points.size(); ++j) sum += (points[j] - before[j]).squaredNorm();
    return sum;
  };
  const double step = 0.5 / static_cast<double>(before.size());
  double best = guess, least = badness(guess);
  for (const int direction : {1, -1}) {
    int worse = 0;
    for (double start = guess + direction * step; worse < 8 && std::abs(start - guess) < 0.5; start += direction * step) {
      const double b = badness(start);
      ++worse;
      if (b >= least) continue;
      least = b;
      best = start;
      worse = 0;
    }
  }
  return best;
}

}  // namespace

FiberSection cut_fibers(const YarnFibers& yarn, const Station& station) {
  constexpr double round = 1.01;  // a section this near to a circle is taken as one
  FiberSection section;
  for (std::size_t f = 0; f < yarn.size(); ++f) {
    const YarnFibers::Crossing c = yarn.crossing(f, station.share, station.origin, station.normal);
    if (!c.found)
      throw std::runtime_error(fmt::format("{} does not cross the section of its yarn at {}", yarn.name_of(f), place_text(station.origin)));
    const Vec2 center = station.plane(c.x), slant(station.u.dot(c.direction), station.v.dot(c.direction));
    const double slope = std::max(std::abs(station.normal.dot(c.direction)), 1 / weave::max_section_aspect);
    const double aspect = 1 / slope, r = yarn.radius[f];
    section.solid += yarn.area[f] * aspect;
    section.circles.push_back({center, r});
    section.stretch += aspect / static_cast<double>(yarn.size());
    if (aspect < round) {
      section.discs.push_back({center, r});
      continue;
    }
    const auto gaps = static_cast<int>(std::ceil(aspect - 1));  // between discs no farther apart than their diameter
    for (int i = 0; i <= gaps; ++i) section.discs.push_back({center + (2.0 * i / gaps - 1) * (aspect - 1) * r * slant.normalized(), r});
  }
  return section;
}

Outline outline_at(const YarnFibers& yarn, const Station& station, double ball_radius) {
  const std::vector<Disc> discs = cut_fibers(yarn, station).discs;
  for (int growth = 0; growth <= growths_max; ++growth)
    if (std::optional<Outline> outline = roll_ball(discs, ball_radius * std::pow(ball_growth, growth))) return *outline;
  throw std::runtime_error(fmt::format("{}: no ball holds its fibers together at {}", yarn.name(), place_text(station.origin)));
}

Rings ring_yarn(const YarnFibers& yarn, const EnvelopeOptions& options) {
  const double diameter = 2 * *std::max_element(yarn.radius.begin(), yarn.radius.end());
  const double edge = options.edge_length_m > 0 ? options.edge_length_m : options.edge_length * diameter;
  Rings rings;
  std::vector<FiberSection> sections;
  rings.stations = place_stations(yarn, options.ring_distance > 0 ? options.ring_distance * diameter : std::min(2 * edge, diameter),
                                  rings.length, sections);
  expect_together(yarn, rings.stations, sections);
  const std::vector<int> growths = fit_balls(yarn, rings.stations, sections, options.ball_radius * diameter, rings.outlines);
  rings.ball_radius = options.ball_radius * diameter * std::pow(ball_growth, *std::max_element(growths.begin(), growths.end()));
  double longest = 0;
  for (std::size_t k = 0; k < rings.rings(); ++k) {
    longest = std::max(longest, rings.outlines[k].length);
    rings.solid.push_back(sections[k].solid);
    rings.space.push_back(sections[k].space());
  }
  rings.points = static_cast<std::size_t>(std::max(8.0, std::ceil(longest / edge)));

  // Each ring starts where it lies nearest to the one before, counted from where the outline passes the direction u. What the starts have
  // drifted by over the period is taken back evenly, but for whole points where a yarn turns around itself.
  std::vector<double> on_ray, start = {0};
  for (const Outline& outline : rings.outlines) on_ray.push_back(outline.share_on_ray(moments_of(outline.points(rings.points)).centroid));
  std::vector<Vec2> before = rings.outlines[0].points(rings.points, on_ray[0]);
  for (std::size_t k = 1; k <= rings.rings(); ++k) {
    const std::size_t ring = k % rings.rings();
    start.push_back(fit_start(rings.outlines[ring], before, on_ray[ring] + start.back()) - on_ray[ring]);
    before = rings.outlines[ring].points(rings.points, on_ray[ring] + start.back());
  }
  const auto points = static_cast<double>(rings.points);
  const double nearest_turn = std::round(start.back());
  const bool turns = std::abs(start.back() - nearest_turn) > 0.125;
  const double whole = turns ? std::round(start.back() * points) / points : nearest_turn;
  const double drift = start.back() - whole;
  const auto shift = static_cast<std::ptrdiff_t>(std::lround(whole * points)), count = static_cast<std::ptrdiff_t>(rings.points);
  rings.turn = static_cast<std::size_t>((shift % count + count) % count);
  for (std::size_t k = 0; k < rings.rings(); ++k) {
    const double share = on_ray[k] + start[k] - drift * static_cast<double>(k) / static_cast<double>(rings.rings());
    for (const Vec2& p : rings.outlines[k].points(rings.points, share)) {
      rings.x.push_back(rings.stations[k].point(p));
      if (k == 0) rings.x.back()[yarn.axis()] = yarn.first_face;
    }
  }
  return rings;
}

}  // namespace relax
