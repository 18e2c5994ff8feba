#include "cell_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

namespace relax {
namespace {

constexpr double snap_share = 0.02;  // of the shortest edge at a point; two yarns a gap apart must not both reach a side

/// A point, some whole periods along x and y away.
struct Place {
  std::uint32_t point = 0;
  std::array<int, 2> periods{0, 0};
  auto operator<=>(const Place&) const = default;
};
using PlaceTriangle = std::array<Place, 3>;

class Cutter {
 public:
  explicit Cutter(const CompositeCell& cell) {
    out_.low = cell.low;
    out_.high = cell.high;
  }

  void add(const YarnEnvelope& yarn, std::int32_t index) {
    for (const PlaceTriangle& t : unrolled(yarn)) {
      std::vector<PlaceTriangle> pieces = {t};
      for (int axis = 0; axis < 2; ++axis) pieces = cut(pieces, axis);
      for (const PlaceTriangle& piece : pieces) put(piece, index);
    }
  }

  CellSurfaces take() {
    for (int axis = 0; axis < 2; ++axis) out_.side_edges[axis].assign(edges_[axis].begin(), edges_[axis].end());
    return std::move(out_);
  }

 private:
  [[nodiscard]] double period(int axis) const { return out_.high[axis] - out_.low[axis]; }
  [[nodiscard]] bool on_side(std::uint32_t point, int axis) const { return out_.points[point][axis] == out_.low[axis]; }

  /// Adds a point at x; what lies within `near` of a side goes onto it.
  Place new_point(Vec3 x, double near) {
    Place place;
    for (int axis = 0; axis < 2; ++axis) {
      const double periods = (x[axis] - out_.low[axis]) / period(axis);
      const double nearest = std::round(periods);
      const bool onto = std::abs(periods - nearest) * period(axis) <= near;
      place.periods[axis] = static_cast<int>(onto ? nearest : std::floor(periods));
      x[axis] = onto ? out_.low[axis] : x[axis] - place.periods[axis] * period(axis);
      // Rounding must not take it out of low <= x < high.
      x[axis] = std::clamp(x[axis], out_.low[axis], std::nextafter(out_.high[axis], out_.low[axis]));
    }
    place.point = static_cast<std::uint32_t>(out_.points.size());
    out_.points.push_back(x);
    return place;
  }

  /// Side triangles of a yarn over points that the two ends of its period share.
  std::vector<PlaceTriangle> unrolled(const YarnEnvelope& yarn) {
    const SurfaceMesh& surface = yarn.surface;
    const YarnEnds ends = ends_of(yarn);
    std::vector<double> shortest(surface.points.size(), 1e300);
    for (const auto& t : surface.triangles)
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t a = t[i], b = t[(i + 1) % 3];
        const double length = (surface.points[a] - surface.points[b]).norm();
        for (const std::uint32_t p : {a, b}) shortest[p] = std::min(shortest[p], length);
      }

    std::vector<Place> places(surface.points.size());
    std::map<std::pair<double, double>, Place> first_end;
    const auto across = [&](std::uint32_t p) { return std::pair(surface.points[p][1 - ends.along], surface.points[p].z()); };
    for (std::uint32_t p = 0; p < places.size(); ++p) {
      if (ends.at(surface.points[p], ends.high)) continue;
      places[p] = new_point(surface.points[p], snap_share * shortest[p]);
      if (ends.at(surface.points[p], ends.low)) first_end[across(p)] = places[p];
    }
    for (std::uint32_t p = 0; p < places.size(); ++p) {
      if (!ends.at(surface.points[p], ends.high)) continue;
      const auto image = first_end.find(across(p));
      if (image == first_end.end())
        throw std::runtime_error("the surface of yarn " + std::to_string(yarn.yarn) + " does not end as it begins: no point at " +
                                 std::to_string(1e3 * across(p).first) + ", " + std::to_string(1e3 * across(p).second) + " mm");
      places[p] = image->second;
      ++places[p].periods[ends.along];
    }

    std::vector<PlaceTriangle> triangles;
    for (const auto& t : side_triangles(surface, ends)) triangles.push_back({places[t[0]], places[t[1]], places[t[2]]});
    return triangles;
  }

  /// First period that a triangle lies in along an axis, and the one after the last.
  [[nodiscard]] std::pair<int, int> span(const PlaceTriangle& t, int axis) const {
    int first = t[0].periods[axis], end = first;
    for (const Place& p : t) {
      first = std::min(first, p.periods[axis]);
      end = std::max(end, p.periods[axis] + (on_side(p.point, axis) ? 0 : 1));
    }
    return {first, end};
  }

  /// Where the edge between two places passes the side of a period; the same point from both triangles of the edge.
  Place crossing(Place a, Place b, int axis, int side) {
    if (b < a) std::swap(a, b);
    const Place relative{b.point, {b.periods[0] - a.periods[0], b.periods[1] - a.periods[1]}};
    const auto [found, added] = crossings_.try_emplace({a.point, relative, axis, side - a.periods[axis]});
    if (added) {
      const Vec3 from = out_.points[a.point];
      Vec3 to = out_.points[b.point];
      for (int i = 0; i < 2; ++i) to[i] += relative.periods[i] * period(i);
      const double plane = out_.low[axis] + (side - a.periods[axis]) * period(axis);
      Vec3 x = from + (plane - from[axis]) / (to[axis] - from[axis]) * (to - from);
      x[axis] = plane;
      found->second = new_point(x, 1e-9 * period(axis));
    }
    Place place = found->second;
    for (int i = 0; i < 2; ++i) place.periods[i] += a.periods[i];
    return place;
  }

  std::vector<PlaceTriangle> cut(std::vector<PlaceTriangle> rest, int axis) {
    std::vector<PlaceTriangle> whole;
    while (!rest.empty()) {
      const PlaceTriangle t = rest.back();
      rest.pop_back();
      const auto [first, end] = span(t, axis);
      if (end - first <= 1) {
        whole.push_back(t);
        continue;
      }
      const int side = first + 1;
      const auto place = [&](const Place& p) {  // before, on or after the side
        if (p.periods[axis] != side) return p.periods[axis] < side ? -1 : 1;
        return on_side(p.point, axis) ? 0 : 1;
      };
      std::array<std::vector<Place>, 2> halves;
      for (std::size_t i = 0; i < 3; ++i) {
        const Place &a = t[i], &b = t[(i + 1) % 3];
        const int at = place(a), next = place(b);
        if (at <= 0) halves[0].push_back(a);
        if (at >= 0) halves[1].push_back(a);
        if (at * next < 0)
          for (auto& half : halves) half.push_back(crossing(a, b, axis, side));
      }
      for (const auto& half : halves)
        for (std::size_t i = 1; i + 1 < half.size(); ++i) rest.push_back({half[0], half[i], half[i + 1]});
    }
    return whole;
  }

  void put(const PlaceTriangle& t, std::int32_t yarn) {
    std::array<std::pair<int, int>, 2> spans = {span(t, 0), span(t, 1)};
    BoxTriangle triangle;
    triangle.yarn = yarn;
    for (std::size_t i = 0; i < 3; ++i) {
      triangle.corners[i].point = t[i].point;
      for (std::size_t axis = 0; axis < 2; ++axis)
        triangle.corners[i].high[axis] = static_cast<std::uint8_t>(t[i].periods[axis] - spans[axis].first);
    }
    // One that lies in a side is left out: there the surface is the side's own triangles between its edges.
    if (spans[0].second > spans[0].first && spans[1].second > spans[1].first) out_.triangles.push_back(triangle);
    for (std::size_t i = 0; i < 3; ++i)
      for (int axis = 0; axis < 2; ++axis) {
        std::array<BoxCorner, 2> edge = {triangle.corners[i], triangle.corners[(i + 1) % 3]};
        if (!on_side(edge[0].point, axis) || !on_side(edge[1].point, axis) || edge[0].high[axis] != edge[1].high[axis]) continue;
        for (BoxCorner& corner : edge) corner.high[axis] = 0;
        std::sort(edge.begin(), edge.end());
        edges_[axis].insert(edge);
      }
  }

  struct EdgeCrossing {
    std::uint32_t from;
    Place to;
    int axis, side;
    auto operator<=>(const EdgeCrossing&) const = default;
  };
  CellSurfaces out_;
  std::map<EdgeCrossing, Place> crossings_;
  std::array<std::set<std::array<BoxCorner, 2>>, 2> edges_;
};

}  // namespace

Vec3 CellSurfaces::position(const BoxCorner& corner) const {
  Vec3 x = points[corner.point];
  for (int axis = 0; axis < 3; ++axis)
    if (corner.high[static_cast<std::size_t>(axis)] != 0) x[axis] = high[axis];
  return x;
}

CellSurfaces surfaces_in_box(const CompositeCell& cell) {
  Cutter cutter(cell);
  for (std::size_t y = 0; y < cell.yarns.size(); ++y) cutter.add(*cell.yarns[y], static_cast<std::int32_t>(y));
  return cutter.take();
}

}  // namespace relax
