#include "separate.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "box_grid.hpp"
#include "closest.hpp"

namespace relax {
namespace {

using Boxes = std::vector<std::vector<Box>>;     ///< (sides x items)
using Vectors = std::vector<std::vector<Vec3>>;  ///< (sides x points)
using Normals = std::vector<SideNormals>;        ///< (sides)
using Edge = std::array<std::uint32_t, 2>;

/// A triangle or an edge of a yarn's periodic image, which is moved by whole cells along x and y.
struct Piece {
  std::uint32_t side;
  int i, j;
  std::uint32_t index;
};

/// The pieces of other yarns near items of one: pieces[first[p]] ... pieces[first[p + 1] - 1] for item p. Those of images along a yarn's
/// own period follow one another: together they are one endless yarn.
struct Neighbors {
  std::vector<std::uint32_t> first = {0};
  std::vector<Piece> pieces;
};

Vec3 shift_of(const Piece& piece, const Lattice& lattice) {
  return {piece.i * lattice.length_x, piece.j * lattice.length_y, 0};
}

template <class Corners>
Box box_around(const YarnSide& side, const Corners& corners) {
  Box box;
  for (const std::uint32_t c : corners) box.extend(side.at(c));
  return box;
}

Boxes boxes_of_triangles(const std::vector<YarnSide>& sides) {
  Boxes boxes(sides.size());
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (const auto& t : sides[s].triangles) boxes[s].push_back(box_around(sides[s], t));
  return boxes;
}

/// For each item of each side the pieces nearer than `reach` [m] of other yarns, and of the same one's images beside it.
std::vector<Neighbors> find_neighbors(const std::vector<YarnSide>& sides, const Lattice& lattice, const Boxes& items, const Boxes& pieces,
                                      double reach) {
  std::vector<BoxGrid> grids;
  std::vector<Box> whole(sides.size());
  for (std::size_t s = 0; s < sides.size(); ++s) {
    for (const Box& box : pieces[s]) whole[s].extend(box);
    grids.emplace_back(pieces[s], 0.5 * sides[s].diameter);
  }
  const Vec3 margin = Vec3::Constant(reach);
  const std::array<double, 2> lengths = {lattice.length_x, lattice.length_y};
  std::vector<Neighbors> result(sides.size());
  std::vector<std::uint32_t> found;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    for (const Box& item : items[s]) {
      const Box wide(item.min() - margin, item.max() + margin);
      for (std::uint32_t other = 0; !item.isEmpty() && other < sides.size(); ++other) {
        if (wide.min().z() > whole[other].max().z() || wide.max().z() < whole[other].min().z()) continue;
        const auto low = [&](int a) { return static_cast<int>(std::ceil((wide.min()[a] - whole[other].max()[a]) / lengths[a])); };
        const auto high = [&](int a) { return static_cast<int>(std::floor((wide.max()[a] - whole[other].min()[a]) / lengths[a])); };
        const int along = sides[other].axis(), beside = 1 - along;
        for (int b = low(beside), b_end = high(beside); b <= b_end; ++b) {
          if (other == s && b == 0) continue;
          for (int a = low(along), a_end = high(along); a <= a_end; ++a) {
            Piece piece{other, along == 0 ? a : b, along == 0 ? b : a, 0};
            const Vec3 shift = shift_of(piece, lattice);
            grids[other].find(Box(wide.min() - shift, wide.max() - shift), found);
            for (const std::uint32_t f : found) {
              piece.index = f;
              result[s].pieces.push_back(piece);
            }
          }
        }
      }
      result[s].first.push_back(static_cast<std::uint32_t>(result[s].pieces.size()));
    }
  }
  return result;
}

/// The surface that a point is deepest under, or else nearest to.
struct Above {
  double height = INFINITY;  ///< of the point above it; < 0: within [m]
  Vec3 normal = Vec3::Zero();
  std::size_t side = 0;       ///< that it belongs to
  Vec3 shift = Vec3::Zero();  ///< of its image [m]
};

/// Normal of a triangle's side where a place on it tells within from outside.
const Vec3& telling_normal(const SideNormals& normals, const YarnSide& side, std::size_t triangle, const PointOnTriangle& place) {
  constexpr double on_edge = 1e-12;  // share of the corner opposite
  const auto& share = place.share;
  for (std::size_t c = 0; c < 3; ++c)
    if (share[(c + 1) % 3] < on_edge && share[(c + 2) % 3] < on_edge) return normals.corner[side.own(side.triangles[triangle][c])];
  for (std::size_t c = 0; c < 3; ++c)
    if (share[(c + 2) % 3] < on_edge) return normals.edge[triangle][c];
  return normals.triangle[triangle];
}

/// Above the sides of which pieces have been found, as far as these are nearer than `reach` [m].
Above height_of(const Vec3& x, const std::vector<YarnSide>& sides, const Lattice& lattice, const Neighbors& near, std::size_t item,
                const Normals& normals, double reach) {
  Above deepest;
  for (std::uint32_t n = near.first[item]; n < near.first[item + 1];) {
    const Piece start = near.pieces[n];
    const YarnSide& other = sides[start.side];
    double least = reach * reach;
    Vec3 away = Vec3::Zero();
    PointOnTriangle at{Vec3::Zero(), {}};
    Vec3 shift = Vec3::Zero();
    std::uint32_t triangle = 0;
    for (; n < near.first[item + 1]; ++n) {
      const Piece& piece = near.pieces[n];
      if (piece.side != start.side || (other.weft ? piece.i != start.i : piece.j != start.j)) break;
      const Vec3 here = x - shift_of(piece, lattice);
      const auto& t = other.triangles[piece.index];
      const PointOnTriangle c = closest_on_triangle(here, other.at(t[0]), other.at(t[1]), other.at(t[2]));
      const double distance = (here - c.x).squaredNorm();
      if (distance >= least) continue;
      least = distance;
      away = here - c.x;
      at = c;
      shift = x - here;
      triangle = piece.index;
    }
    if (least >= reach * reach) continue;
    const SideNormals& of = normals[start.side];
    const double height = std::copysign(std::sqrt(least), telling_normal(of, other, triangle, at).dot(away));
    if (height >= deepest.height) continue;
    Vec3 normal = Vec3::Zero();
    for (std::size_t c = 0; c < 3; ++c) normal += at.share[c] * of.smooth[other.own(other.triangles[triangle][c])];
    deepest = {height, normal.normalized(), start.side, shift};
  }
  return deepest;
}

Normals normals_of(const std::vector<YarnSide>& sides) {
  Normals normals;
  for (const YarnSide& side : sides) normals.push_back(side.normals());
  return normals;
}

/// Each edge once, those of the last ring, the first one's image, left out.
std::vector<Edge> edges_of(const YarnSide& side) {
  std::vector<Edge> edges;
  for (const auto& t : side.triangles)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::uint32_t a = t[c], b = t[(c + 1) % 3];  // the other way round in the triangle beside this one
      if ((a < b && a < side.x.size()) || (a + 1 == side.points && b == 0)) edges.push_back({a, b});
    }
  return edges;
}

/// Where an edge of one side faces an edge of another.
struct Facing {
  double height = 0;  ///< of the first edge above the surface of the second [m]
  Vec3 normal = Vec3::Zero();
};

std::optional<Facing> facing_edges(const std::vector<YarnSide>& sides, const Lattice& lattice, std::size_t side, const Edge& own,
                                   const Piece& piece, const Edge& other_edge, const Normals& normals) {
  const YarnSide& other = sides[piece.side];
  const Vec3 shift = shift_of(piece, lattice);
  const std::optional<EdgeGap> gap =
      gap_of_edges(sides[side].at(own[0]), sides[side].at(own[1]), other.at(other_edge[0]) + shift, other.at(other_edge[1]) + shift);
  if (!gap) return std::nullopt;
  const std::vector<Vec3>& of = normals[piece.side].smooth;
  const Vec3 normal = ((1 - gap->share_b) * of[other.own(other_edge[0])] + gap->share_b * of[other.own(other_edge[1])]).normalized();
  const double distance = gap->between.norm(), along = normal.dot(gap->between);
  if (std::abs(along) < 0.5 * distance) return std::nullopt;  // beside rather than above one another
  return Facing{std::copysign(distance, along), normal};
}

/// The state of yarns that are being moved apart.
class Separation {
 public:
  Separation(std::vector<YarnSide>& sides, const Lattice& lattice, double gap)
      : sides_(sides), lattice_(lattice), gap_(gap), edges_(sides.size()), height_(sides.size()) {
    for (std::size_t s = 0; s < sides.size(); ++s) {
      diameter_ = std::max(diameter_, sides[s].diameter);
      edges_[s] = edges_of(sides[s]);
    }
  }

  std::optional<Intrusion> run() {
    constexpr int rounds_max = 20;
    for (int round = 0; round < rounds_max; ++round) {
      if (!part_points() || !part_edges()) break;
      if (worst_.depth == 0) return std::nullopt;
    }
    return worst_;
  }

 private:
  /// Moves points out of, and away from, the triangles of other yarns. False if they do not come apart.
  bool part_points() {
    // Farther in than half a diameter would be no contact; the wider reach keeps the lists good while points move.
    const double reach = 0.75 * diameter_ + gap_;
    Boxes points(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (const Vec3& x : sides_[s].x) points[s].emplace_back(x);
    const std::vector<Neighbors> near = find_neighbors(sides_, lattice_, points, boxes_of_triangles(sides_), reach);
    // A point that is farther off than it and all others can have come since is not looked at again.
    double travelled = 0;
    std::vector<std::vector<double>> clear_until(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      clear_until[s].assign(sides_[s].x.size(), -1);
      height_[s].assign(sides_[s].x.size(), reach);
    }
    constexpr int rounds_max = 60;
    for (int round = 0; round < rounds_max; ++round) {
      const Normals normals = normals_of(sides_);
      Vectors move(sides_.size());
      double largest = 0;
      worst_ = {};
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        const YarnSide& side = sides_[s];
        move[s].assign(side.x.size(), Vec3::Zero());
        for (std::size_t p = 0; p < side.x.size(); ++p) {
          if (near[s].first[p] == near[s].first[p + 1] || clear_until[s][p] > travelled) continue;
          const Above above = height_of(side.x[p], sides_, lattice_, near[s], p, normals, reach);
          height_[s][p] = std::min(above.height, reach);
          clear_until[s][p] = travelled + 0.5 * (height_[s][p] - gap_);
          if (above.height >= gap_) continue;
          const double lack = aim() - above.height;
          move[s][p] = push(side, p, lack, above.normal);
          largest = std::max(largest, move[s][p].norm());
          if (lack > worst_.depth) worst_ = {s, above.side, side.x[p], lack};
        }
      }
      if (worst_.depth == 0) return true;
      travelled += largest;
      if (travelled > 3 * diameter_) return false;
      apply(move);
    }
    return false;
  }

  /// Moves edges off the edges of other yarns that they cross or come near to. False if they do not come apart; `worst_` tells whether any
  /// moved.
  bool part_edges() {
    const double reach = 2 * gap_;
    Boxes items(sides_.size()), pieces(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (const Edge& e : edges_[s]) {
        const YarnSide& side = sides_[s];
        pieces[s].push_back(box_around(side, e));
        const double length = (side.at(e[0]) - side.at(e[1])).norm();
        const bool far = std::min(height_[s][side.own(e[0])], height_[s][side.own(e[1])]) > length + reach;
        items[s].push_back(far ? Box() : pieces[s].back());
      }
    const std::vector<Neighbors> near = find_neighbors(sides_, lattice_, items, pieces, reach);
    Intrusion first;
    constexpr int rounds_max = 40;
    for (int round = 0; round < rounds_max; ++round) {
      const Normals normals = normals_of(sides_);
      Vectors move(sides_.size());
      worst_ = {};
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        const YarnSide& side = sides_[s];
        move[s].assign(side.x.size(), Vec3::Zero());
        for (std::size_t e = 0; e < edges_[s].size(); ++e) {
          for (std::uint32_t n = near[s].first[e]; n < near[s].first[e + 1]; ++n) {
            const Piece& piece = near[s].pieces[n];
            const Edge& own = edges_[s][e];
            const std::optional<Facing> facing = facing_edges(sides_, lattice_, s, own, piece, edges_[piece.side][piece.index], normals);
            if (!facing || std::abs(facing->height) > reach) continue;
            if (facing->height >= gap_) continue;
            const double lack = aim() - facing->height;
            if (lack > worst_.depth) worst_ = {s, piece.side, side.at(own[0]), lack};
            for (const std::uint32_t end : own) {
              const std::size_t p = side.own(end);
              const Vec3 by = push(side, p, lack, facing->normal);
              if (by.squaredNorm() > move[s][p].squaredNorm()) move[s][p] = by;
            }
          }
        }
      }
      if (round == 0) first = worst_;
      if (worst_.depth == 0) {
        worst_ = first;
        return true;
      }
      apply(move);
    }
    return false;
  }

  /// Moves come near to it from below, and so reach the gap after a few rounds.
  [[nodiscard]] double aim() const { return 1.01 * gap_; }

  /// Half of what is lacking: the other yarn moves likewise. Points of the first ring stay on their face.
  [[nodiscard]] static Vec3 push(const YarnSide& side, std::size_t point, double lack, const Vec3& normal) {
    Vec3 by = 0.5 * lack * normal;
    if (point < side.points) by[side.axis()] = 0;
    return by;
  }

  void apply(const Vectors& move) {
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (std::size_t p = 0; p < move[s].size(); ++p) sides_[s].x[p] += move[s][p];
  }

  std::vector<YarnSide>& sides_;
  Lattice lattice_;
  double gap_, diameter_ = 0;
  std::vector<std::vector<Edge>> edges_;
  std::vector<std::vector<double>> height_;  ///< of points above other yarns when last looked at, at most the reach [m]
  Intrusion worst_;
};

/// A ball that belongs to a yarn.
struct Probe {
  Vec3 x;
  double radius = 0, length = 0;  ///< length: of fiber that it stands for [m]
};

/// Where balls (sides x balls) lie within the sides of other yarns.
std::vector<Intrusion> intrusions_of(const std::vector<std::vector<Probe>>& probes, const std::vector<YarnSide>& sides,
                                     const Lattice& lattice) {
  Boxes boxes(sides.size());
  double reach = 0;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    reach = std::max(reach, 1.5 * sides[s].diameter);
    for (const Probe& probe : probes[s]) boxes[s].emplace_back(probe.x);
  }
  const std::vector<Neighbors> near = find_neighbors(sides, lattice, boxes, boxes_of_triangles(sides), reach);
  const Normals normals = normals_of(sides);
  std::vector<Intrusion> intrusions;
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (std::size_t p = 0; p < probes[s].size(); ++p) {
      if (near[s].first[p] == near[s].first[p + 1]) continue;
      const Probe& probe = probes[s][p];
      const Above above = height_of(probe.x, sides, lattice, near[s], p, normals, reach);
      const double depth = probe.radius - above.height;
      if (depth > 0) intrusions.push_back({s, above.side, probe.x, depth, above.shift, above.height < 0, probe.length});
    }
  return intrusions;
}

}  // namespace

std::vector<Intrusion> find_intrusions(const std::vector<YarnFibers>& yarns, const std::vector<YarnSide>& sides, const Lattice& lattice) {
  std::vector<std::vector<Probe>> probes(sides.size());
  for (std::size_t s = 0; s < sides.size(); ++s) {
    for (std::size_t f = 0; f < yarns[s].size(); ++f) {
      const auto count = static_cast<int>(std::ceil(2 * yarns[s].length[f] / sides[s].diameter));
      for (int k = 0; k < count; ++k)
        probes[s].push_back({yarns[s].at(f, static_cast<double>(k) / count), yarns[s].radius[f], yarns[s].length[f] / count});
    }
  }
  return intrusions_of(probes, sides, lattice);
}

std::vector<Intrusion> find_overlaps(const std::vector<YarnSide>& sides, const Lattice& lattice) {
  std::vector<std::vector<Probe>> probes(sides.size());
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (const Vec3& x : sides[s].x) probes[s].push_back({x});
  return intrusions_of(probes, sides, lattice);
}

std::optional<Intrusion> separate_yarns(std::vector<YarnSide>& sides, const Lattice& lattice, double gap) {
  return Separation(sides, lattice, gap).run();
}

double least_distance(const std::vector<YarnSide>& sides, const Lattice& lattice, double reach) {
  Boxes points(sides.size()), edge_boxes(sides.size());
  std::vector<std::vector<Edge>> edges;
  for (std::size_t s = 0; s < sides.size(); ++s) {
    for (const Vec3& x : sides[s].x) points[s].emplace_back(x);
    edges.push_back(edges_of(sides[s]));
    for (const Edge& e : edges[s]) edge_boxes[s].push_back(box_around(sides[s], e));
  }
  const Normals normals = normals_of(sides);
  double least = reach;
  const std::vector<Neighbors> triangles = find_neighbors(sides, lattice, points, boxes_of_triangles(sides), reach);
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (std::size_t p = 0; p < points[s].size(); ++p)
      if (triangles[s].first[p] < triangles[s].first[p + 1])
        least = std::min(least, std::abs(height_of(sides[s].x[p], sides, lattice, triangles[s], p, normals, reach).height));
  const std::vector<Neighbors> beside = find_neighbors(sides, lattice, edge_boxes, edge_boxes, reach);
  for (std::size_t s = 0; s < sides.size(); ++s)
    for (std::size_t e = 0; e < edges[s].size(); ++e)
      for (std::uint32_t n = beside[s].first[e]; n < beside[s].first[e + 1]; ++n) {
        const Piece& piece = beside[s].pieces[n];
        const Edge& other = edges[piece.side][piece.index];
        const Vec3 shift = shift_of(piece, lattice);
        const YarnSide& to = sides[piece.side];
        const std::optional<EdgeGap> gap =
            gap_of_edges(sides[s].at(edges[s][e][0]), sides[s].at(edges[s][e][1]), to.at(other[0]) + shift, to.at(other[1]) + shift);
        if (gap) least = std::min(least, gap->between.norm());
      }
  return least;
}

}  // namespace relax
