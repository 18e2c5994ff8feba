#include "weave/neighbor_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weave {
namespace {

/// The angle between two fibers may change meanwhile; contacts of either kind are picked this far beyond their range of sine^2.
constexpr double angle_margin = 0.08;
/// Fibers nearer to parallel than this sine^2 do not come to cross between two searches.
constexpr double parallel = 0.005;

/// Cell size over the distance that is searched: smaller cells follow the searched ball more closely.
constexpr double cell_share = 0.35;

struct Candidate {
  std::uint32_t fiber;
  std::int32_t image_key;  ///< image of an open fiber; 0 for a closed one, whose images are one chain
  std::int64_t chain;      ///< number of the bar along the chain
  std::uint32_t segment;
  std::int32_t image;
  double distance2;
};

int wrapped_difference(std::int64_t a, std::int64_t b, std::int64_t period) {
  std::int64_t d = std::abs(a - b);
  if (period > 0) d = std::min(d % period, period - d % period);
  return static_cast<int>(std::min<std::int64_t>(d, 1000));
}

std::int64_t chain_period(const Model& m, std::uint32_t fiber) { return m.periodic[fiber] ? m.own_nodes(fiber) : 0; }

bool same_line(const Model& m, const LineContact& a, const LineContact& b) {
  const std::uint32_t f = m.fiber_of[a.segment];
  if (a.node != b.node || f != m.fiber_of[b.segment]) return false;
  if (!m.periodic[f] && a.image != b.image) return false;
  return wrapped_difference(a.segment, b.segment, chain_period(m, f)) <= 2;
}

bool same_crossing(const Model& m, const CrossingContact& a, const CrossingContact& b) {
  const std::uint32_t fa = m.fiber_of[a.segment_a], fb = m.fiber_of[a.segment_b];
  return fb == m.fiber_of[b.segment_b] && wrapped_difference(a.segment_a, b.segment_a, chain_period(m, fa)) <= 2 &&
         wrapped_difference(a.segment_b, b.segment_b, chain_period(m, fb)) <= 2;
}

/// Two crossings of the same two fibers that have ended at the same bars or at neighbors.
bool same_place(const Model& m, const CrossingContact& a, const CrossingContact& b) {
  const std::uint32_t fa = m.fiber_of[a.segment_a], fb = m.fiber_of[a.segment_b];
  if (fb != m.fiber_of[b.segment_b]) return false;
  if (!m.periodic[fa] && !m.periodic[fb] && a.image != b.image) return false;
  return wrapped_difference(a.segment_a, b.segment_a, chain_period(m, fa)) <= 1 &&
         wrapped_difference(a.segment_b, b.segment_b, chain_period(m, fb)) <= 1;
}

double distance2_to_bar(const FiberGeometry& g, const Vec3& point, std::uint32_t s) {
  Vec3 r = point - g.x[s];
  const double along = std::clamp(r.dot(g.bar_tangent[s]), 0.0, g.bar_length[s]);
  r -= along * g.bar_tangent[s];
  return r.squaredNorm();
}

void sort_targets(std::size_t fibers, std::size_t contacts, auto&& fiber_of_contact, std::vector<std::uint32_t>& start,
                  std::vector<std::uint32_t>& order) {
  start.assign(fibers + 1, 0);
  for (std::size_t i = 0; i < contacts; ++i) ++start[fiber_of_contact(i) + 1];
  for (std::size_t f = 0; f < fibers; ++f) start[f + 1] += start[f];
  order.resize(contacts);
  std::vector<std::uint32_t> at(start.begin(), start.end() - 1);
  for (std::size_t i = 0; i < contacts; ++i) order[at[fiber_of_contact(i)]++] = static_cast<std::uint32_t>(i);
}

}  // namespace

void NeighborSearch::bin_segments(const Model& m, const FiberGeometry& g, double reach, double active_x_max) {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);
  std::vector<std::uint32_t> active;
  for (std::uint32_t s = 0; s < m.nodes(); ++s) {
    if (m.rest_length[s] <= 0 || m.role[m.fiber_of[s]] == Role::reed || g.x[s].x() > active_x_max) continue;
    active.push_back(s);
    const Vec3 middle = 0.5 * (g.x[s] + g.x[s + 1]);
    low = low.cwiseMin(middle);
    high = high.cwiseMax(middle);
  }
  bins_ = {};
  if (active.empty()) {
    bins_.start.assign(2, 0);
    bins_.nx = bins_.ny = bins_.nz = 1;
    bins_.size = Vec3::Ones();
    bins_.origin = Vec3::Zero();
    return;
  }
  const auto count = [&](double extent) { return std::max(1, static_cast<int>(std::min(extent / reach, 400.0))); };
  const bool periodic = m.period_y > 0;
  if (periodic) {
    low.y() = 0;
    high.y() = m.period_y;
  }
  const Vec3 extent = (high - low).cwiseMax(1e-12);
  bins_.nx = count(extent.x());
  bins_.ny = count(extent.y());
  bins_.nz = count(extent.z());
  bins_.origin = low;
  bins_.size = Vec3(std::max(extent.x() / bins_.nx, reach), periodic ? extent.y() / bins_.ny : std::max(extent.y() / bins_.ny, reach),
                    std::max(extent.z() / bins_.nz, reach));
  std::vector<std::uint32_t> cell(active.size());
  std::vector<std::int32_t> wrap(active.size(), 0);
  bins_.start.assign(static_cast<std::size_t>(bins_.nx) * bins_.ny * bins_.nz + 1, 0);
  for (std::size_t i = 0; i < active.size(); ++i) {
    Vec3 middle = 0.5 * (g.x[active[i]] + g.x[active[i] + 1]);
    if (periodic) {
      wrap[i] = static_cast<std::int32_t>(std::floor(middle.y() / m.period_y));
      middle.y() -= wrap[i] * m.period_y;
    }
    const auto index = [&](int axis, int n) {
      return std::clamp(static_cast<int>((middle[axis] - bins_.origin[axis]) / bins_.size[axis]), 0, n - 1);
    };
    cell[i] = static_cast<std::uint32_t>((index(0, bins_.nx) * bins_.ny + index(1, bins_.ny)) * bins_.nz + index(2, bins_.nz));
    ++bins_.start[cell[i] + 1];
  }
  for (std::size_t c = 1; c < bins_.start.size(); ++c) bins_.start[c] += bins_.start[c - 1];
  bins_.segment.resize(active.size());
  bins_.wrap.resize(active.size());
  bins_.middle.resize(active.size());
  std::vector<std::uint32_t> at(bins_.start.begin(), bins_.start.end() - 1);
  for (std::size_t i = 0; i < active.size(); ++i) {
    const std::uint32_t slot = at[cell[i]]++;
    bins_.segment[slot] = active[i];
    bins_.wrap[slot] = wrap[i];
    bins_.middle[slot] = 0.5 * (g.x[active[i]] + g.x[active[i] + 1]);
    bins_.middle[slot].y() -= wrap[i] * m.period_y;
  }
}

void NeighborSearch::search_fiber(const Model& m, const FiberGeometry& g, std::uint32_t fiber, double skin, double active_x_max,
                                  const ContactList& old, PerFiber& found) const {
  found.line.clear();
  found.crossing.clear();
  if (m.role[fiber] == Role::reed) return;
  const double radius = m.type_of(fiber).radius;
  const std::uint32_t begin = m.first[fiber], end = begin + m.own_nodes(fiber);
  const double bar_fiber = m.rest_length[begin];
  const double reach_cross = reach_max_ + skin + 0.75 * bar_fiber;  // a node this near may be next to a crossing
  const double reach_middle = reach_cross + 0.6 * bar_max_;
  const double rise2 = 0.75 * bar_fiber * 0.75 * bar_fiber;
  const bool periodic = m.period_y > 0;
  const int range_y = static_cast<int>(std::ceil(reach_middle / bins_.size.y()));
  std::vector<Candidate> candidates;
  // Old line contacts are sorted by node: walk along with them.
  std::uint32_t old_at = old.line_of.empty() ? 0 : old.line_of[fiber];
  const std::uint32_t old_end = old.line_of.empty() ? 0 : old.line_of[fiber + 1];

  const auto add_crossing = [&](std::uint32_t segment_a, std::uint32_t segment_b, std::int32_t image) {
    CrossingContact k;
    k.segment_a = segment_a;
    k.segment_b = segment_b;
    k.image = image;
    const PolylinePair q = walk_to_pair(m, g, k.segment_a, k.segment_b, k.image);
    const double reach = m.pair_law(fiber, m.fiber_of[k.segment_b]).reach + skin;
    if (q.distance2 < reach * reach) found.crossing.push_back(k);
  };

  for (std::uint32_t p = begin; p < end; ++p) {
    const Vec3& x = g.x[p];
    if (x.x() > active_x_max) continue;
    const std::uint32_t own_bar = m.rest_length[p] > 0 ? p : p - 1;
    std::int32_t wrap = 0;
    Vec3 folded = x;
    if (periodic) {
      wrap = static_cast<std::int32_t>(std::floor(x.y() / m.period_y));
      folded.y() -= wrap * m.period_y;
    }
    candidates.clear();
    const auto cell_range = [&](int axis, int n) {
      const double u = (folded[axis] - bins_.origin[axis]) / bins_.size[axis];
      const double r = reach_middle / bins_.size[axis];
      return std::pair(std::max(0, static_cast<int>(std::floor(u - r))), std::min(n - 1, static_cast<int>(std::floor(u + r))));
    };
    const auto [ix0, ix1] = cell_range(0, bins_.nx);
    const auto [iz0, iz1] = cell_range(2, bins_.nz);
    auto [iy0, iy1] = cell_range(1, bins_.ny);
    if (periodic) {
      const int middle = static_cast<int>(folded.y() / bins_.size.y());
      iy0 = middle - range_y;
      iy1 = middle + range_y;
    }
    for (int ix = ix0; ix <= ix1; ++ix) {
      for (int iy = iy0; iy <= iy1; ++iy) {
        int cy = iy;
        std::int32_t turns = 0;
        if (periodic) {
          turns = static_cast<std::int32_t>(std::floor(static_cast<double>(iy) / bins_.ny));
          cy = iy - turns * bins_.ny;
        }
        const std::size_t column = (static_cast<std::size_t>(ix) * bins_.ny + cy) * bins_.nz;
        for (std::uint32_t slot = bins_.start[column + iz0]; slot < bins_.start[column + iz1 + 1]; ++slot) {
          const Vec3 from_middle = folded - Vec3(0, turns * m.period_y, 0) - bins_.middle[slot];
          const double middle2 = from_middle.squaredNorm();
          if (middle2 > reach_middle * reach_middle) continue;
          const std::uint32_t s = bins_.segment[slot];
          // Nearest point of a fiber that crosses p's: no farther off its line than half a bar's rise.
          const double along = from_middle.dot(g.bar_tangent[s]);
          const double cosine = g.node_tangent[p].dot(g.bar_tangent[s]);
          const double line_reach = reach_max_ + skin;
          if (middle2 - along * along > line_reach * line_reach + rise2 * (1 - cosine * cosine)) continue;
          const std::int32_t image = wrap + turns - bins_.wrap[slot];
          Vec3 point = x;
          point.y() -= image * m.period_y;
          const double d2 = distance2_to_bar(g, point, s);
          if (d2 > reach_cross * reach_cross) continue;
          const std::uint32_t other = m.fiber_of[s];
          const bool closed = m.periodic[other];
          const std::int64_t chain = static_cast<std::int64_t>(s) - m.first[other] + (closed ? static_cast<std::int64_t>(image) * m.own_nodes(other) : 0);
          if (other == fiber && (closed || image == 0)) {
            // A bent fiber must not push itself: neighbors within half a turn of the tightest bend are no contacts.
            const double arc = (std::abs(static_cast<double>(chain - (p - begin))) - 1) * bar_fiber;
            if (arc < 2 * std::numbers::pi * radius) continue;
          }
          candidates.push_back({other, closed ? 0 : image, chain, s, image, d2});
        }
      }
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      if (a.fiber != b.fiber) return a.fiber < b.fiber;
      if (a.image_key != b.image_key) return a.image_key < b.image_key;
      return a.chain < b.chain;
    });
    while (old_at < old_end && old.line[old_at].node < p) ++old_at;
    for (std::size_t i = 0; i < candidates.size();) {
      std::size_t j = i + 1, best = i;
      while (j < candidates.size() && candidates[j].fiber == candidates[i].fiber && candidates[j].image_key == candidates[i].image_key &&
             candidates[j].chain <= candidates[j - 1].chain + 1) {
        if (candidates[j].distance2 < candidates[best].distance2) best = j;
        ++j;
      }
      const Candidate& c = candidates[best];
      i = j;
      const double cosine = g.node_tangent[p].dot(g.bar_tangent[c.segment]);
      const double sine2 = 1 - cosine * cosine;
      const double line_reach = m.pair_law(fiber, c.fiber).reach + skin;
      if (c.distance2 < line_reach * line_reach) {
        LineContact contact;
        contact.node = p;
        contact.segment = c.segment;
        contact.image = c.image;
        for (std::uint32_t o = old_at; o < old_end && old.line[o].node == p; ++o) {
          if (old.line[o].stiffness > 0 && same_line(m, old.line[o], contact)) {
            contact = old.line[o];  // with the bar it had followed
            break;
          }
        }
        found.line.push_back(contact);
      }
      if (!m.node_contact && c.fiber > fiber && sine2 > parallel) add_crossing(own_bar, c.segment, c.image);
    }
    // Reed bars: long and few, so every bar is asked for its distance in the plane normal to it.
    for (std::uint32_t bar = 0; bar < m.fibers() && m.role[bar] == Role::reed; ++bar) {
      const std::uint32_t s = m.first[bar];
      Vec3 r = x - g.x[s];
      const double turns = periodic ? std::round(r.y() / m.period_y) : 0;
      r.y() -= turns * m.period_y;
      const double reach = m.pair_law(fiber, bar).reach + skin + bar_fiber;
      if (r.x() * r.x() + r.y() * r.y() < reach * reach) add_crossing(own_bar, s, static_cast<std::int32_t>(turns));
    }
  }

  // One crossing may be found from several nodes: keep the first of those that ended in the same place.
  std::vector<CrossingContact> unique;
  for (const CrossingContact& k : found.crossing) {
    if (std::none_of(unique.begin(), unique.end(), [&](const CrossingContact& u) { return same_place(m, u, k); })) unique.push_back(k);
  }
  if (!old.crossing_of.empty()) {
    for (CrossingContact& k : unique) {
      for (std::uint32_t o = old.crossing_of[fiber]; o < old.crossing_of[fiber + 1]; ++o) {
        if (old.crossing[o].stiffness > 0 && same_crossing(m, old.crossing[o], k)) {
          k = old.crossing[o];
          break;
        }
      }
    }
  }
  found.crossing.swap(unique);
}

void NeighborSearch::build(const Model& m, const FiberGeometry& g, double skin, double active_x_max, ContactList& contacts) {
  bar_max_ = 0;
  double radius_max = 0;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] == Role::reed) continue;
    radius_max = std::max(radius_max, m.type_of(f).radius);
    for (std::uint32_t s = m.first[f]; s < m.last(f); ++s) bar_max_ = std::max(bar_max_, m.rest_length[s]);
  }
  reach_max_ = 2 * radius_max;
  bin_segments(m, g, cell_share * (reach_max_ + skin + bar_max_), active_x_max);
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  found_.resize(fibers);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) search_fiber(m, g, f, skin, active_x_max, contacts, found_[f]);

  contacts.line.clear();
  contacts.crossing.clear();
  contacts.line_of.assign(fibers + 1, 0);
  contacts.crossing_of.assign(fibers + 1, 0);
  for (std::uint32_t f = 0; f < fibers; ++f) {
    contacts.line.insert(contacts.line.end(), found_[f].line.begin(), found_[f].line.end());
    contacts.crossing.insert(contacts.crossing.end(), found_[f].crossing.begin(), found_[f].crossing.end());
    contacts.line_of[f + 1] = static_cast<std::uint32_t>(contacts.line.size());
    contacts.crossing_of[f + 1] = static_cast<std::uint32_t>(contacts.crossing.size());
  }
}

void pick_active(const Model& m, const FiberGeometry& g, double skin, ContactList& contacts) {
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  std::vector<std::uint32_t> near_line(fibers, 0), near_crossing(fibers, 0);
  std::vector<std::uint8_t> keep_line(contacts.line.size()), keep_crossing(contacts.crossing.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    for (std::uint32_t i = contacts.line_of[f]; i < contacts.line_of[f + 1]; ++i) {
      LineContact& c = contacts.line[i];
      const PolylinePoint q = walk_to_point(m, g, g.x[c.node], c.segment, c.image);
      const double reach = m.pair_law(f, m.fiber_of[c.segment]).reach + skin;
      const double cosine = g.node_tangent[c.node].dot(g.bar_tangent[c.segment]);
      const bool near = q.distance2 < reach * reach && (m.node_contact || 1 - cosine * cosine < AngleBlend::upper + angle_margin);
      keep_line[i] = near;
      near_line[f] += near;
    }
    for (std::uint32_t i = contacts.crossing_of[f]; i < contacts.crossing_of[f + 1]; ++i) {
      CrossingContact& c = contacts.crossing[i];
      const PolylinePair q = walk_to_pair(m, g, c.segment_a, c.segment_b, c.image);
      const double reach = m.pair_law(f, m.fiber_of[c.segment_b]).reach + skin;
      const double cosine = g.bar_tangent[c.segment_a].dot(g.bar_tangent[c.segment_b]);
      bool near = q.distance2 < reach * reach && 1 - cosine * cosine > AngleBlend::lower - angle_margin;
      // Two that have come to the same place are one: the one that has been touching stays.
      for (std::uint32_t o = contacts.crossing_of[f]; near && o < i; ++o) {
        if (keep_crossing[o] && same_place(m, contacts.crossing[o], c)) {
          if (c.stiffness > contacts.crossing[o].stiffness) std::swap(c, contacts.crossing[o]);
          near = false;
        }
      }
      keep_crossing[i] = near;
      near_crossing[f] += near;
    }
  }
  const auto collect = [&](const std::vector<std::uint8_t>& keep, const std::vector<std::uint32_t>& count, ActiveContacts& active) {
    active.of.assign(fibers + 1, 0);
    for (std::uint32_t f = 0; f < fibers; ++f) active.of[f + 1] = active.of[f] + count[f];
    active.number.clear();
    for (std::uint32_t i = 0; i < keep.size(); ++i) {
      if (keep[i]) active.number.push_back(i);
    }
  };
  collect(keep_line, near_line, contacts.active_line);
  collect(keep_crossing, near_crossing, contacts.active_crossing);
  index_targets(m, contacts);
}

void index_targets(const Model& m, ContactList& contacts) {
  const auto index = [&](ActiveContacts& active, auto&& touched_bar) {
    active.reaction.resize(active.number.size());
    sort_targets(m.fibers(), active.number.size(), [&](std::size_t i) { return m.fiber_of[touched_bar(active.number[i])]; }, active.target_of,
                 active.target);
  };
  index(contacts.active_line, [&](std::uint32_t i) { return contacts.line[i].segment; });
  index(contacts.active_crossing, [&](std::uint32_t i) { return contacts.crossing[i].segment_b; });
}

}  // namespace weave
