#include "relax/envelope.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numbers>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "cap.hpp"
#include "fit_faces.hpp"
#include "part_intermixed.hpp"
#include "relax/surface_file.hpp"
#include "rings.hpp"
#include "separate.hpp"
#include "surface_check.hpp"
#include "touch_distance.hpp"
#include "triangle_crossings.hpp"
#include "yarn_fibers.hpp"
#include "yarn_side.hpp"

namespace relax {
namespace {

class Clock {
 public:
  /// Time since the last call or the start [s].
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double passed = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return passed;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// Triangles between the points of the first ring that close it, turned toward the yarn's end.
std::vector<std::array<std::uint32_t, 3>> cap_of(const YarnSide& side) {
  std::vector<Vec2> polygon;
  for (std::size_t j = 0; j < side.points; ++j) {
    const Vec3& x = side.x[j];
    polygon.push_back(side.weft ? Vec2(-x.x(), x.z()) : Vec2(x.y(), x.z()));
  }
  return triangulate_polygon(polygon);
}

SurfaceMesh close_side(const YarnSide& side, const std::vector<std::array<std::uint32_t, 3>>& cap) {
  SurfaceMesh surface{side.all(), side.triangles};
  for (const auto& t : cap) surface.triangles.push_back({t[0], t[2], t[1]});
  const auto on_last = [&](std::uint32_t j) {
    return static_cast<std::uint32_t>(side.x.size() + (j + side.points - side.turn) % side.points);
  };
  for (const auto& t : cap) surface.triangles.push_back({on_last(t[0]), on_last(t[1]), on_last(t[2])});
  return surface;
}

std::string describe(const Intrusion& intrusion, const std::vector<YarnSide>& sides) {
  const YarnSide &a = sides[intrusion.side_a], &b = sides[intrusion.side_b];
  return fmt::format(
      "{} {} and {} {}{} are intermixed: one lies within the other by {:.2f} fiber diameters at {}, so that no disjoint surfaces of these "
      "edge lengths hold their fibers",
      a.weft ? "weft" : "warp", a.yarn, b.weft ? "weft" : "warp", b.yarn, intrusion.side_a == intrusion.side_b ? " beside it" : "",
      intrusion.depth / a.diameter, place_text(intrusion.x));
}

YarnSection measure_section(const YarnSide& side, const Station& station, std::size_t ring, double solid) {
  std::vector<Vec2> polygon;
  for (std::size_t j = 0; j < side.points; ++j) polygon.push_back(station.plane(side.x[ring * side.points + j]));
  const PolygonMoments m = moments_of(polygon);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(m.second);
  Vec2 along = axes.eigenvectors().col(1);
  if (along.x() < 0) along = -along;
  const Vec2 across(-along.y(), along.x());
  YarnSection s;
  s.arc = station.arc;
  s.centroid = station.point(m.centroid);
  s.normal = station.normal;
  s.lateral = station.u;
  s.rotation = std::atan2(along.y(), along.x());
  s.area = m.area;
  s.fiber_volume_fraction = solid / m.area;
  Eigen::AlignedBox2d extent;
  for (const Vec2& p : polygon) extent.extend(Vec2(along.dot(p), across.dot(p)));
  s.width = extent.sizes().x();
  s.height = extent.sizes().y();
  return s;
}

/// How far a fiber's surface may lie within another yarn where these are moved apart as they are [fiber diameters]: its axis lies outside.
constexpr double intrusion_max = 0.5;
/// Of a yarn's fibers, how much may be left to other yarns where these are intermixed [of their length].
constexpr double stray_max = 0.02;

/// Largest share of a yarn's fibers whose axes lie within other yarns' sides [of their length].
double most_astray(const std::vector<YarnFibers>& yarns, const std::vector<YarnSide>& sides, const Lattice& lattice) {
  std::vector<double> astray(yarns.size(), 0);
  for (const Intrusion& i : find_intrusions(yarns, sides, lattice))
    if (i.axis_inside) astray[i.side_a] += i.length;
  double most = 0;
  for (std::size_t y = 0; y < yarns.size(); ++y) {
    most = std::max(most, astray[y] / std::accumulate(yarns[y].length.begin(), yarns[y].length.end(), 0.0));
  }
  return most;
}

/// Largest distance of a point of the last ring from its image on the first [m].
double face_mismatch(const YarnEnvelope& e, std::size_t turn) {
  double largest = 0;
  const Vec3* last = e.surface.points.data() + (e.rings - 1) * std::size_t{e.ring_points};
  for (std::size_t j = 0; j < e.ring_points; ++j)
    largest = std::max(largest, (last[j] - e.surface.points[(j + turn) % e.ring_points] - e.period).norm());
  return largest;
}

/// Envelopes with lengths as they are. unmoved_max: if given, where the largest distance of the surfaces from the fibers before yarns were
/// moved apart goes [fiber radii].
Envelopes envelopes_of(const weave::Snapshot& given, const EnvelopeOptions& options, double* unmoved_max) {
  Clock clock;
  Envelopes result;
  result.options = options;
  const bool as_woven = given.beyond.known();  // these have level faces
  const weave::Snapshot cell = as_woven ? given : with_level_faces(given);
  const PeriodicYarns periodic = periodic_yarns(cell);
  result.fibers = snapshot_of(periodic.yarns, cell);
  result.lean = periodic.lean;
  result.face_mismatch = periodic.mismatch;
  std::vector<Rings> rings;
  std::vector<YarnSide> sides;
  for (const YarnFibers& yarn : periodic.yarns) {
    rings.push_back(ring_yarn(yarn, options));
    sides.push_back(join_rings(yarn, rings.back()));
  }
  result.wall.sections = clock.lap();

  std::vector<YarnSide> before = sides;
  const double diameter = std::ranges::min(sides, {}, &YarnSide::diameter).diameter;
  const Lattice lattice{cell.x_max - cell.x_min, cell.cell_width};
  std::vector<Intrusion> places = find_intrusions(periodic.yarns, sides, lattice);
  Intrusion deepest;
  for (const Intrusion& place : places)
    if (place.depth > deepest.depth) deepest = place;
  result.intrusion = deepest.depth / diameter;
  std::ranges::copy(find_overlaps(sides, lattice), std::back_inserter(places));
  std::erase_if(places, [&](const Intrusion& place) { return place.depth <= intrusion_max * diameter; });
  if (!places.empty()) {
    part_intermixed(periodic.yarns, sides, lattice, places);
    result.stray_share = most_astray(periodic.yarns, sides, lattice);
    if (result.stray_share > stray_max) throw std::runtime_error(describe(deepest, sides));
  }
  if (const std::optional<Intrusion> left = separate_yarns(sides, lattice, options.gap * diameter))
    throw std::runtime_error(describe(*left, sides));
  result.wall.separation = clock.lap();

  for (std::size_t y = 0; y < sides.size(); ++y) {
    const YarnFibers& yarn = periodic.yarns[y];
    const YarnSide& side = sides[y];
    const std::vector<std::array<std::uint32_t, 3>> cap = cap_of(side);
    YarnEnvelope e;
    e.yarn = yarn.yarn;
    e.weft = yarn.weft;
    e.surface = close_side(side, cap);
    e.ring_points = static_cast<std::uint32_t>(side.points);
    e.rings = static_cast<std::uint32_t>(side.rings + 1);
    e.side_triangles = static_cast<std::uint32_t>(side.triangles.size());
    e.period = yarn.period;
    e.ball_radius = rings[y].ball_radius;
    for (std::size_t f = 0; f < yarn.size(); ++f) e.fiber_volume += yarn.length[f] * yarn.area[f];
    // What the fibers of a section share with one another they share along the yarn.
    double shared = 0;
    for (std::size_t k = 0; k < side.rings; ++k) shared += rings[y].space[k] / rings[y].solid[k] / static_cast<double>(side.rings);
    e.fiber_space = shared * e.fiber_volume;
    e.volume = enclosed_volume(e.surface);
    e.volume_moved = enclosed_volume({before[y].all(), e.surface.triangles}) - e.volume;
    for (std::size_t k = 0; k < side.rings; ++k) e.sections.push_back(measure_section(side, rings[y].stations[k], k, rings[y].solid[k]));
    e.sections.push_back(e.sections.front());
    e.sections.back().centroid += yarn.period;
    e.sections.back().arc = rings[y].length;
    result.yarns.push_back(std::move(e));
  }
  result.wall.caps = clock.lap();

  for (std::size_t y = 0; y < sides.size(); ++y) {
    const YarnEnvelope& e = result.yarns[y];
    result.report.periodic_mismatch = std::max(result.report.periodic_mismatch, face_mismatch(e, sides[y].turn));
    const SurfaceState state = check_surface(e.surface);
    result.report.closed = result.report.closed && state.closed;
    result.report.self_intersections += state.self_intersections;
  }
  const std::vector<TriangleCrossing> crossings = find_crossings(result.yarns, lattice);
  result.report.mutual_intersections = crossings.size();
  result.report.gap_min = crossings.empty() ? least_distance(sides, lattice, 2 * options.gap * diameter) : 0;
  result.wall.check = clock.lap();

  TouchDistance touch;
  for (std::size_t y = 0; y < sides.size(); ++y) {
    const double ball = options.ball_radius * sides[y].diameter;
    const TouchDistance t = measure_touch(periodic.yarns[y], rings[y], result.yarns[y].surface, result.yarns[y].side_triangles, ball);
    touch.sum += t.sum;
    touch.count += t.count;
    if (t.largest > touch.largest) {
      touch.largest = t.largest;
      result.report.distance_max_at = t.largest_at;
      result.report.distance_max_yarn = y;
    }
    if (unmoved_max != nullptr) {
      const SurfaceMesh unmoved{before[y].all(), before[y].triangles};
      *unmoved_max = std::max(*unmoved_max, measure_touch(periodic.yarns[y], rings[y], unmoved, unmoved.triangles.size(), ball).largest);
    }
    touch.protrusion = std::max(touch.protrusion, t.protrusion);
  }
  result.report.distance_mean = touch.sum / static_cast<double>(touch.count);
  result.report.distance_max = touch.largest;
  result.report.protrusion_max = touch.protrusion;
  result.wall.distance = clock.lap();
  return result;
}

}  // namespace

std::vector<double> continuous_rotation(const std::vector<YarnSection>& sections) {
  std::vector<double> rotation;
  for (const YarnSection& s : sections) {
    const double steps = rotation.empty() ? 0 : std::round((rotation.back() - s.rotation) / std::numbers::pi);
    rotation.push_back(s.rotation + steps * std::numbers::pi);
  }
  return rotation;
}

void check_options(const EnvelopeOptions& o, double diameter) {
  const auto expect = [](const char* name, double value, double low, double high) {
    if (!(value >= low) || !(value <= high))
      throw std::invalid_argument(fmt::format("{} = {}: must be {} to {} fiber diameters", name, value, low, high));
  };
  expect("edge length", o.edge_length, 0.02, 10);
  if (o.ring_distance != 0) expect("ring distance", o.ring_distance, 0.05, 20);
  expect("ball radius", o.ball_radius, 0.1, 1000);
  expect("gap", o.gap, 1e-4, 0.5);
  if (o.tolerance != 0 && (!(o.tolerance >= 1e-3) || !(o.tolerance <= 10)))
    throw std::invalid_argument(fmt::format("tolerance = {}: must be 0.001 to 10 fiber radii", o.tolerance));
  if (!(o.edge_length_m >= 0) || !std::isfinite(o.edge_length_m))
    throw std::invalid_argument(fmt::format("edge length = {} m: must be > 0", o.edge_length_m));
  if (o.edge_length_m > 0 && diameter > 0) expect("edge length", o.edge_length_m / diameter, 0.02, 10);
}

Envelopes make_envelopes(const weave::Snapshot& cell, const EnvelopeOptions& options) {
  const double diameter = cell.radius.empty() ? 0 : 2 * *std::min_element(cell.radius.begin(), cell.radius.end());
  check_options(options, diameter);
  if (options.tolerance == 0) return envelopes_of(cell, options, nullptr);
  constexpr double edge_least = 0.05;  // [fiber diameters]
  EnvelopeOptions tried = options;
  for (;;) {
    double unmoved = 0;
    Envelopes result = envelopes_of(cell, tried, &unmoved);
    const EnvelopeReport& r = result.report;
    if (r.distance_max <= options.tolerance) return result;
    // What shorter edges leave, but for about as much as they can bring: yarns that overlap, or touch, give way to one another.
    const double moved = r.distance_max - unmoved;
    const double edge = tried.edge_length_m > 0 ? tried.edge_length_m / diameter : tried.edge_length;
    if (moved - unmoved > options.tolerance || edge <= 1.001 * edge_least) {
      const YarnEnvelope& e = result.yarns[r.distance_max_yarn];
      throw std::runtime_error(fmt::format(
          "tolerance of {:g} fiber radii: the surface of {} {} is {:.3g} fiber radii from its fibers at {}, with edges of {:.3g} "
          "fiber diameters; {:.3g} of them are what yarns are moved apart by, which no shorter edges change",
          options.tolerance, e.weft ? "weft" : "warp", e.yarn, r.distance_max, place_text(r.distance_max_at), edge, moved));
    }
    // Chords miss arcs by the square of their length.
    const double room = options.tolerance > moved ? options.tolerance - moved : 0.25 * options.tolerance;
    const double shorter = std::max(std::clamp(std::sqrt(0.9 * room / unmoved), 0.5, 0.9), edge_least / edge);
    tried.edge_length *= shorter;
    tried.edge_length_m *= shorter;
    if (tried.ring_distance > 0) tried.ring_distance = std::max(0.05, shorter * tried.ring_distance);
  }
}

}  // namespace relax
