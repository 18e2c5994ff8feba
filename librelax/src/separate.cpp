#include "separate.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "box_grid.hpp"
#include "closest.hpp"

namespace relax {
namespace {

/// A yarn's periodic image: moved by whole cells along x and y.
struct Image {
  std::uint32_t side;
  int i, j;
};

/// A triangle or an edge of an image.
struct Piece {
  Image image;
  std::uint32_t index;
};

struct Neighbors {
  std::vector<std::uint32_t> first;  ///< of item p: pieces[first[p]] ... pieces[first[p + 1] - 1]
  std::vector<Piece> pieces;         ///< with images relative to the item's own yarn
};

/// All that is moved, and what it is moved by.
class Separation {
 public:
  Separation(std::vector<YarnSide>& sides, const Lattice& lattice, double gap) : sides_(sides), lattice_(lattice), gap_(gap) {
    for (const YarnSide& side : sides) {
      diameter_ = std::max(diameter_, side.diameter);
      std::vector<std::array<std::uint32_t, 2>> edges;
      for (const auto& t : side.triangles)
        for (std::size_t c = 0; c < 3; ++c) {
          // Once from the two triangles beside an edge, in which it runs both ways; the last ring is the first one's image.
          const std::uint32_t a = t[c], b = t[(c + 1) % 3];
          if ((a < b && a < side.x.size()) || (a + 1 == side.points && b == 0)) edges.push_back({a, b});
        }
      edges_.push_back(std::move(edges));
    }
  }

  double run() {
    constexpr int rounds_max = 60;
    for (int round = 0; round < rounds_max; ++round) {
      const double moved_points = part_points();
      const double moved_edges = part_edges();
      if (moved_points == 0 && moved_edges == 0) break;
    }
    return least_;
  }

 private:
  [[nodiscard]] Vec3 shift(const Image& image) const { return {image.i * lattice_.length_x, image.j * lattice_.length_y, 0}; }

  [[nodiscard]] Box box_of(const YarnSide& side, const std::uint32_t* points, int count) const {
    Box box;
    for (int c = 0; c < count; ++c) box.extend(side.at(points[c]));
    return box;
  }

  /// Is the image of a yarn another one, and not that of its own period?
  [[nodiscard]] bool foreign(std::size_t side, const Image& image) const {
    return image.side != side || (sides_[side].weft ? image.i : image.j) != 0;
  }

  /// For each item of each side the pieces of other yarns nearer than `reach`.
  template <class Boxes>
  std::vector<Neighbors> find_neighbors(const Boxes& item_boxes, const Boxes& piece_boxes, double reach) const {
    std::vector<Box> boxes;
    std::vector<Piece> pieces;
    Box cell(Vec3(lattice_.x_min - reach, -reach, -1e9), Vec3(lattice_.x_min + lattice_.length_x + reach, lattice_.length_y + reach, 1e9));
    for (std::uint32_t s = 0; s < sides_.size(); ++s) {
      Box whole;
      for (const Box& box : piece_boxes[s]) whole.extend(box);
      const auto low = [&](int axis, double period) {
        return static_cast<int>(std::ceil((cell.min()[axis] - whole.max()[axis]) / period));
      };
      const auto high = [&](int axis, double period) {
        return static_cast<int>(std::floor((cell.max()[axis] - whole.min()[axis]) / period));
      };
      // Images along the yarn's own period follow one another: together they are one endless yarn.
      const int along = sides_[s].axis(), beside = 1 - along;
      const std::array<double, 2> lengths = {lattice_.length_x, lattice_.length_y};
      for (int l = low(beside, lengths[beside]); l <= high(beside, lengths[beside]); ++l)
        for (int k = low(along, lengths[along]); k <= high(along, lengths[along]); ++k) {
          const Image image = along == 0 ? Image{s, k, l} : Image{s, l, k};
          const Vec3 by = shift(image);
          for (std::uint32_t p = 0; p < piece_boxes[s].size(); ++p) {
            const Box box(piece_boxes[s][p].min() + by, piece_boxes[s][p].max() + by);
            if (!cell.intersects(box)) continue;
            boxes.push_back(box);
            pieces.push_back({image, p});
          }
        }
    }
    const BoxGrid grid(std::move(boxes), diameter_);
    std::vector<Neighbors> result(sides_.size());
    std::vector<std::uint32_t> found;
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      result[s].first.push_back(0);
      for (const Box& own : item_boxes[s]) {
        // The item is looked for where its middle lies in the cell.
        const Vec3 middle = own.center();
        const Image home{static_cast<std::uint32_t>(s), -static_cast<int>(std::floor((middle.x() - lattice_.x_min) / lattice_.length_x)),
                         -static_cast<int>(std::floor(middle.y() / lattice_.length_y))};
        const Vec3 by = shift(home), margin = Vec3::Constant(reach);
        grid.find(Box(own.min() + by - margin, own.max() + by + margin), found);
        for (const std::uint32_t f : found) {
          const Piece& p = pieces[f];
          const Image relative{p.image.side, p.image.i - home.i, p.image.j - home.j};
          if (foreign(s, relative)) result[s].pieces.push_back({relative, p.index});
        }
        result[s].first.push_back(static_cast<std::uint32_t>(result[s].pieces.size()));
      }
    }
    return result;
  }

  /// Moves points out of, and away from, the triangles of other yarns. Returns the sum of the moves [m].
  double part_points() {
    const double reach = gap_ + diameter_, slack = 0.01 * gap_;
    std::vector<std::vector<Box>> points(sides_.size()), triangles(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s) {
      for (const Vec3& x : sides_[s].x) points[s].emplace_back(x);
      for (const auto& t : sides_[s].triangles) triangles[s].push_back(box_of(sides_[s], t.data(), 3));
    }
    const std::vector<Neighbors> near = find_neighbors(points, triangles, reach);
    constexpr int rounds_max = 100;
    double total = 0, travelled = 0;
    // A point that was farther off than others can have come since is not looked at again.
    std::vector<std::vector<double>> clear_until(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s) clear_until[s].assign(sides_[s].x.size(), -1);
    for (int round = 0; round < rounds_max; ++round) {
      std::vector<std::vector<Vec3>> normals;
      for (const YarnSide& side : sides_) normals.push_back(side.normals());
      std::vector<std::vector<Vec3>> move(sides_.size());
      double largest = 0;
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        move[s].assign(sides_[s].x.size(), Vec3::Zero());
        for (std::size_t p = 0; p < sides_[s].x.size(); ++p) {
          if (near[s].first[p] == near[s].first[p + 1] || clear_until[s][p] > travelled) continue;
          const Nearest n = nearest(sides_[s].x[p], near[s], p, normals);
          clear_until[s][p] = travelled + 0.5 * (std::min(n.height, reach) - gap_);
          if (n.height >= gap_ - slack) continue;
          Vec3 by = 0.5 * (gap_ - n.height) * n.normal;
          if (p < sides_[s].points) by[sides_[s].axis()] = 0;
          move[s][p] = by;
          largest = std::max(largest, by.norm());
        }
      }
      if (largest == 0) break;
      travelled += largest;
      for (std::size_t s = 0; s < sides_.size(); ++s)
        for (std::size_t p = 0; p < move[s].size(); ++p) {
          sides_[s].x[p] += move[s][p];
          total += move[s][p].norm();
        }
    }
    return total;
  }

  /// The surface nearest to a point.
  struct Nearest {
    double height = 1e300;  ///< of the point above it; < 0: within [m]
    Vec3 normal = Vec3::Zero();
  };

  [[nodiscard]] Nearest nearest(const Vec3& x, const Neighbors& near, std::size_t item,
                                const std::vector<std::vector<Vec3>>& normals) const {
    // Of each endless yarn the nearest triangle; of those the one that the point is deepest under.
    Nearest deepest;
    for (std::uint32_t n = near.first[item]; n < near.first[item + 1];) {
      const Image first = near.pieces[n].image;
      const YarnSide& other = sides_[first.side];
      double least = INFINITY;
      Vec3 away = Vec3::Zero();
      PointOnTriangle at{Vec3::Zero(), {}};
      const std::array<std::uint32_t, 3>* triangle = nullptr;
      for (; n < near.first[item + 1]; ++n) {
        const Piece& piece = near.pieces[n];
        if (piece.image.side != first.side || (other.weft ? piece.image.i != first.i : piece.image.j != first.j)) break;
        const Vec3 here = x - shift(piece.image);
        const auto& t = other.triangles[piece.index];
        const PointOnTriangle c = closest_on_triangle(here, other.at(t[0]), other.at(t[1]), other.at(t[2]));
        const double distance = (here - c.x).squaredNorm();
        if (distance >= least) continue;
        least = distance;
        away = here - c.x;
        at = c;
        triangle = &t;
      }
      const std::vector<Vec3>& of = normals[first.side];
      const Vec3 normal = (at.share[0] * of[other.own((*triangle)[0])] + at.share[1] * of[other.own((*triangle)[1])] +
                           at.share[2] * of[other.own((*triangle)[2])])
                              .normalized();
      const double height = std::copysign(std::sqrt(least), normal.dot(away));
      if (height < deepest.height) deepest = {height, normal};
    }
    return deepest;
  }

  /// Moves edges off the edges of other yarns that they cross or come near. Returns the sum of the moves [m].
  double part_edges() {
    const double reach = 2 * gap_, slack = 0.01 * gap_;
    std::vector<std::vector<Box>> boxes(sides_.size());
    for (std::size_t s = 0; s < sides_.size(); ++s)
      for (const auto& e : edges_[s]) boxes[s].push_back(box_of(sides_[s], e.data(), 2));
    const std::vector<Neighbors> near = find_neighbors(boxes, boxes, reach);
    double total = 0;
    constexpr int rounds_max = 30;
    for (int round = 0; round < rounds_max; ++round) {
      std::vector<std::vector<Vec3>> normals, move(sides_.size());
      std::vector<std::vector<double>> parts(sides_.size());
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        normals.push_back(sides_[s].normals());
        move[s].assign(sides_[s].x.size(), Vec3::Zero());
      }
      bool any = false;
      least_ = reach;
      for (std::size_t s = 0; s < sides_.size(); ++s) {
        const YarnSide& side = sides_[s];
        for (std::size_t e = 0; e < edges_[s].size(); ++e) {
          for (std::uint32_t n = near[s].first[e]; n < near[s].first[e + 1]; ++n) {
            const Image& image = near[s].pieces[n].image;
            const YarnSide& other = sides_[image.side];
            const auto& own = edges_[s][e];
            const auto& facing = edges_[image.side][near[s].pieces[n].index];
            const Vec3 by = shift(image);
            const std::optional<EdgeGap> gap =
                gap_of_edges(side.at(own[0]), side.at(own[1]), other.at(facing[0]) + by, other.at(facing[1]) + by);
            if (!gap) continue;
            const Vec3 normal =
                ((1 - gap->share_b) * normals[image.side][other.own(facing[0])] + gap->share_b * normals[image.side][other.own(facing[1])])
                    .normalized();
            const double distance = gap->between.norm(), height = std::copysign(distance, normal.dot(gap->between));
            if (distance > reach || std::abs(normal.dot(gap->between)) < 0.5 * distance) continue;
            least_ = std::min(least_, height);
            if (height >= gap_ - slack) continue;
            any = true;
            for (const std::uint32_t p : own) {
              Vec3 push = 0.5 * (gap_ - height) * normal;
              const std::size_t point = side.own(p);
              if (point < side.points) push[side.axis()] = 0;
              if (push.squaredNorm() > move[s][point].squaredNorm()) move[s][point] = push;
            }
          }
        }
      }
      if (!any) break;
      for (std::size_t s = 0; s < sides_.size(); ++s)
        for (std::size_t p = 0; p < move[s].size(); ++p) {
          sides_[s].x[p] += move[s][p];
          total += move[s][p].norm();
        }
    }
    return total;
  }

  std::vector<YarnSide>& sides_;
  Lattice lattice_;
  double gap_, diameter_ = 0, least_ = 0;
  std::vector<std::vector<std::array<std::uint32_t, 2>>> edges_;
};

}  // namespace

double separate_yarns(std::vector<YarnSide>& sides, const Lattice& lattice, double gap) {
  return Separation(sides, lattice, gap).run();
}

}  // namespace relax
