#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "chain.hpp"
#include "contact_samples.hpp"
#include "relax/energy.hpp"

namespace relax {
namespace {

struct SpanBall {
  Vec3 center;         ///< moved into the cell
  int wrap_x, wrap_y;  ///< periods by which it was moved
  double radius;       ///< that holds the span
};

/// Cells of a grid that holds the balls; `reach` is the farthest that two centers of a contact can be apart.
struct Grid {
  double reach;
  int nx, ny, nz;
  double low_z, size_x, size_y, size_z;
  std::vector<std::vector<std::uint32_t>> bin;

  Grid(const Cell& cell, const Eigen::VectorXd& q, const std::vector<SpanBall>& balls, double reach_of) : reach(reach_of) {
    const double length_x = cell.length_x_at(q), length_y = cell.length_y_at(q);
    double high_z = -1e300;
    low_z = 1e300;
    for (const SpanBall& b : balls) {
      low_z = std::min(low_z, b.center.z());
      high_z = std::max(high_z, b.center.z());
    }
    const auto count = [&](double extent) { return std::max(1, static_cast<int>(extent / reach)); };
    nx = count(length_x);
    ny = count(length_y);
    nz = count(high_z - low_z);
    size_x = length_x / nx;
    size_y = length_y / ny;
    size_z = std::max((high_z - low_z) / nz, reach);
    bin.resize(static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz));
    for (std::uint32_t i = 0; i < balls.size(); ++i) {
      bin[number(index_x(balls[i]), index_y(balls[i]), index_z(balls[i]))].push_back(i);
    }
  }
  [[nodiscard]] std::size_t number(int ix, int iy, int iz) const {
    return (static_cast<std::size_t>(iz) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(iy)) * static_cast<std::size_t>(nx) +
           static_cast<std::size_t>(ix);
  }
  [[nodiscard]] int index_x(const SpanBall& b) const { return std::clamp(static_cast<int>(b.center.x() / size_x), 0, nx - 1); }
  [[nodiscard]] int index_y(const SpanBall& b) const { return std::clamp(static_cast<int>(b.center.y() / size_y), 0, ny - 1); }
  [[nodiscard]] int index_z(const SpanBall& b) const { return std::clamp(static_cast<int>((b.center.z() - low_z) / size_z), 0, nz - 1); }

  /// Calls with each ball near to `a` and the image of it that is near.
  template <class Visit>
  void near(const SpanBall& a, Visit&& visit) const {
    const int ix = index_x(a), iy = index_y(a), iz = index_z(a);
    const int mx = static_cast<int>(std::ceil(reach / size_x)), my = static_cast<int>(std::ceil(reach / size_y));
    for (int z = std::max(iz - 1, 0); z <= std::min(iz + 1, nz - 1); ++z) {
      for (int y = iy - my; y <= iy + my; ++y) {
        const int wrap_y = static_cast<int>(std::floor(static_cast<double>(y) / ny));
        for (int x = ix - mx; x <= ix + mx; ++x) {
          const int wrap_x = static_cast<int>(std::floor(static_cast<double>(x) / nx));
          for (const std::uint32_t b : bin[number(x - wrap_x * nx, y - wrap_y * ny, z)]) visit(b, wrap_x, wrap_y);
        }
      }
    }
  }
};

std::vector<SpanBall> balls_of(const Cell& cell, const Eigen::VectorXd& q) {
  std::vector<SpanBall> balls;
  balls.reserve(cell.nodes());
  const double length_x = cell.length_x_at(q), length_y = cell.length_y_at(q);
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const Span span(cell, q, i);
    const Vec3 c = span.point(0.5);
    const int wx = static_cast<int>(std::floor(c.x() / length_x)), wy = static_cast<int>(std::floor(c.y() / length_y));
    const double radius = std::max((span.start - c).norm(), (span.point(1) - c).norm());
    balls.push_back({c - image_shift(cell, q, wx, wy), wx, wy, radius});
  }
  return balls;
}

/// The nearest span of one endless chain, or of a leg of it: a fiber that turns around another may touch it on either side.
struct Candidate {
  std::uint32_t fiber;
  std::int32_t across;  ///< image across the fiber's own period: tells the chain
  double distance2;
  SpanContact contact;
};

/// Removes what stays farther away than a touch and the skin; what another candidate has too, where one chain goes on in another fiber; and
/// the span's own endless chain: to touch that, a fiber would have to turn back, which no fiber of a cloth does.
void remove_far_and_repeated(const Cell& cell, const Eigen::VectorXd& q, std::uint32_t span, double radius_of_span, double skin,
                             std::vector<Candidate>& candidates) {
  constexpr double same = 1e-6;  // [radii]
  const std::uint32_t f = cell.fiber_of[span];
  const double radius = cell.type_of(f).radius;
  const Vec3 middle = axis_point(cell, q, span, 0.5);
  std::vector<Vec3> met;
  std::erase_if(candidates, [&](const Candidate& c) {
    const ChainPoint at = closest_on_chain(cell, q, middle, c.contact.other, image_shift(cell, q, c.contact.image_x, c.contact.image_y));
    if (!at.found) return false;
    const double distance = at.separation.norm();
    if (distance > radius_of_span + cell.pair_law(f, c.fiber).reach + skin) return true;
    const bool known = distance < same * radius ||
                       std::any_of(met.begin(), met.end(), [&](const Vec3& o) { return (o - at.separation).norm() < same * radius; });
    met.push_back(at.separation);
    return known;
  });
}

/// Whether two spans of a chain are less than the arc apart that a fiber takes to turn around another.
bool on_one_leg(const Cell& cell, const Candidate& a, const Candidate& b, double reach) {
  const std::int64_t own_nodes = cell.first[a.fiber + 1] - cell.first[a.fiber];
  const auto along = [&](const Candidate& c) { return std::int64_t{cell.weft[c.fiber] ? c.contact.image_y : c.contact.image_x}; };
  const std::int64_t spans = std::int64_t{a.contact.other} - b.contact.other + (along(a) - along(b)) * own_nodes;
  return static_cast<double>(std::abs(spans)) * cell.span_length(a.contact.other) < std::numbers::pi * reach;
}

/// The nearest span of every leg of a chain that may come near span i.
void find_nearest(const Cell& cell, const Eigen::VectorXd& q, const Grid& grid, const std::vector<SpanBall>& balls, std::uint32_t i,
                  double skin, std::vector<Candidate>& nearest) {
  const std::uint32_t f = cell.fiber_of[i];
  nearest.clear();
  grid.near(balls[i], [&](std::uint32_t j, int wrap_x, int wrap_y) {
    const std::uint32_t g = cell.fiber_of[j];
    const Vec3 apart = balls[i].center - balls[j].center - image_shift(cell, q, wrap_x, wrap_y);
    const double distance2 = apart.squaredNorm(), limit = balls[i].radius + balls[j].radius + cell.pair_law(f, g).reach + skin;
    if (distance2 > limit * limit) return;
    Candidate c{g, 0, distance2, {i, j, balls[i].wrap_x - balls[j].wrap_x + wrap_x, balls[i].wrap_y - balls[j].wrap_y + wrap_y, 0.5}};
    c.across = cell.weft[g] ? c.contact.image_x : c.contact.image_y;
    if (g == f && c.across == 0) return;
    const double reach = cell.pair_law(f, g).reach;
    const auto known = std::find_if(nearest.begin(), nearest.end(), [&](const Candidate& o) {
      return o.fiber == g && o.across == c.across && on_one_leg(cell, o, c, reach);
    });
    if (known == nearest.end()) {
      nearest.push_back(c);
    } else if (distance2 < known->distance2) {
      *known = c;
    }
  });
  std::sort(nearest.begin(), nearest.end(),
            [](const Candidate& a, const Candidate& b) { return a.fiber != b.fiber ? a.fiber < b.fiber : a.across < b.across; });
}

}  // namespace

bool ContactList::late(const Cell& cell, const Eigen::VectorXd& q) const {
  const auto n = static_cast<Eigen::Index>(cell.nodes());
  const double left = 0.5 * skin - growth_since(cell, *this, q);
  if (left < 0) return true;
  for (Eigen::Index i = 0; i < n; ++i) {
    if ((q.segment<3>(3 * i) - built_at.segment<3>(3 * i)).squaredNorm() > left * left) return true;
  }
  return false;
}

double growth_since(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q) {
  return std::abs(cell.length_x_at(q) - cell.length_x_at(list.built_at)) + std::abs(cell.length_y_at(q) - cell.length_y_at(list.built_at));
}

ContactList find_contacts(const Cell& cell, const Eigen::VectorXd& q, double skin, const ContactSampling& sampling) {
  ContactList list{skin, sampling, {}, {}, {}, q};
  const std::vector<SpanBall> balls = balls_of(cell, q);
  double largest = 0, reach_max = 0;
  for (const SpanBall& b : balls) largest = std::max(largest, b.radius);
  for (const PairLaw& law : cell.pair_laws) reach_max = std::max(reach_max, law.reach);
  const Grid grid(cell, q, balls, 2 * largest + reach_max + skin);
  struct Found {
    std::vector<SpanContact> contacts;
    std::vector<double> gap;
  };
  std::vector<Found> of_fiber(cell.fibers());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < cell.fibers(); ++f) {
    std::vector<Candidate> nearest;
    std::vector<double> gap;
    for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) {
      find_nearest(cell, q, grid, balls, i, skin, nearest);
      remove_far_and_repeated(cell, q, i, balls[i].radius, skin, nearest);
      for (const Candidate& c : nearest) {
        measure_gaps(cell, q, c.contact, sampling, gap);
        if (*std::min_element(gap.begin(), gap.end()) > skin) continue;
        of_fiber[f].contacts.push_back(c.contact);
        of_fiber[f].gap.insert(of_fiber[f].gap.end(), gap.begin(), gap.end());
      }
    }
  }
  for (const Found& found : of_fiber) {
    list.contacts.insert(list.contacts.end(), found.contacts.begin(), found.contacts.end());
    list.gap.insert(list.gap.end(), found.gap.begin(), found.gap.end());
  }
  number_samples(cell, list);
  share_contacts(cell, q, list);
  return list;
}

SparseHessian hessian_for(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q) {
  constexpr double near_joint = 0.3;  // of a span: the closest point may pass to the next while the list lasts
  const Unknowns unknowns(cell);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  const auto couple_span = [&](const std::array<std::uint32_t, 3>& own, std::uint32_t other) {
    for (const std::uint32_t b : {cell.before(other).node, other, cell.after(other).node}) {
      for (const std::uint32_t a : own) pairs.emplace_back(a, b);
    }
  };
  std::vector<std::vector<std::uint32_t>> border_nodes(static_cast<std::size_t>(unknowns.borders()));
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
    const std::array<std::uint32_t, 3> own = {cell.before(i).node, i, cell.after(i).node};
    couple_span(own, i);
    const Eigen::Index drawn = unknowns.drawn[cell.fiber_of[i]];
    if (drawn >= 0) {  // a fiber's last bar ends in the fiber that goes on
      for (const std::uint32_t node : {i, cell.after(i).node})
        border_nodes[static_cast<std::size_t>(unknowns.border(drawn))].push_back(node);
    }
    for (const Eigen::Index length : unknowns.length) {
      if (length >= 0) border_nodes[static_cast<std::size_t>(unknowns.border(length))].push_back(i);
    }
    if (unknowns.platens < 0) continue;
    const Span span(cell, q, i);
    const double radius = cell.type_of(cell.fiber_of[i]).radius;
    for (int side = 0; side < 2; ++side) {
      const Eigen::Index platen = unknowns.platens + side;
      const double up = side == 0 ? -1 : 1;
      const double highest = std::max({up * span.point(0).z(), up * span.point(0.5).z(), up * span.point(1).z()});
      if (highest - up * q[platen] + radius < -list.skin) continue;
      for (const std::uint32_t node : own) border_nodes[static_cast<std::size_t>(unknowns.border(platen))].push_back(node);
    }
  }
  std::vector<std::uint32_t> touched;  // spans that one contact couples its own with
  const auto couple_once = [&](const std::array<std::uint32_t, 3>& own, std::uint32_t other) {
    if (std::find(touched.begin(), touched.end(), other) != touched.end()) return;
    touched.push_back(other);
    couple_span(own, other);
  };
  for (const SpanContact& c : list.contacts) {
    const Span own(cell, q, c.span);
    const Vec3 shift = image_shift(cell, q, c.image_x, c.image_y);
    touched.clear();
    for (const double u : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const ChainPoint at = closest_on_chain(cell, q, own.point(u), c.other, shift);
      if (!at.found) continue;
      const std::uint32_t middle = at.span.node[1];
      couple_once(own.node, middle);
      if (at.share < near_joint) couple_once(own.node, cell.before(middle).node);
      if (at.share > 1 - near_joint) couple_once(own.node, cell.after(middle).node);
    }
    // Where the other axis bends sharply, the points between these may be closest to another span.
    const int samples = samples_on(cell, c.span, c.other, list.sampling);
    for (int s = 0; s < samples; ++s) {
      const ChainPoint at = closest_on_chain(cell, q, own.point((s + 0.5) / samples), c.other, shift);
      if (at.found) couple_once(own.node, at.span.node[1]);
    }
  }
  // A length meets other unknowns that are no node's: rest lengths in the bars across a face, and the other length.
  const Eigen::Index lengths = (unknowns.length[0] >= 0) + (unknowns.length[1] >= 0);
  return {unknowns.nodes, std::move(pairs), std::move(border_nodes), lengths};
}

}  // namespace relax
