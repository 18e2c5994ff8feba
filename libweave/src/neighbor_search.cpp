#include "weave/neighbor_search.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace weave {
namespace {

/// Cell size over the distance that is searched: smaller cells follow the searched ball more closely.
constexpr double cell_share = 0.35;
/// A contact found anew goes on with the friction of an old one of the same point and fiber if their touched bars are not farther apart.
constexpr std::int64_t old_place_limit = 2;

struct Candidate {
  std::uint32_t fiber;
  std::int32_t image_key;  ///< image of an open fiber; 0 for a closed one, whose images are one chain
  std::int64_t chain;      ///< number of the bar along the chain
  std::uint32_t segment;
  std::int32_t image;
};

double distance2_to_bar(const FiberGeometry& g, const Vec3& point, std::uint32_t s) {
  Vec3 r = point - g.x[s];
  const double along = std::clamp(r.dot(g.bar_tangent[s]), 0.0, g.bar_length[s]);
  r -= along * g.bar_tangent[s];
  return r.squaredNorm();
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
                                  const std::vector<std::uint8_t>& stale, const ContactList& old, std::vector<LineContact>& found) const {
  found.clear();
  if (m.role[fiber] == Role::reed) return;
  const std::uint32_t begin = m.first[fiber], end = begin + m.own_nodes(fiber);
  const double bar_fiber = m.rest_length[begin];
  const double line_reach = reach_max_ + skin;
  const double half_bar = 0.55 * bar_fiber;  // the points around a node are looked for with it; a bar may be stretched
  const double reach_node = line_reach + half_bar;
  const double reach_middle = reach_node + 0.55 * bar_max_;
  const auto points = static_cast<int>(m.points[fiber]);
  const bool periodic = m.period_y > 0;
  const int range_y = static_cast<int>(std::ceil(reach_middle / bins_.size.y()));
  std::vector<Candidate> candidates;
  const auto old_begin = old.line.begin() + (old.line_of.empty() ? 0 : old.line_of[fiber]);
  const auto old_end = old.line.begin() + (old.line_of.empty() ? 0 : old.line_of[fiber + 1]);
  std::vector<std::uint8_t> taken(static_cast<std::size_t>(old_end - old_begin), 0);
  const auto add_line = [&](LineContact contact, double distance2) {
    if (!m.node_contact) let_sleep(g, std::sqrt(distance2) - touch_reach(m, fiber, m.fiber_of[contact.segment]), contact);
    auto o = std::lower_bound(old_begin, old_end, contact.node, [](const LineContact& c, std::uint32_t node) { return c.node < node; });
    auto same = old_end;
    std::int64_t apart = old_place_limit + 1;
    for (; o != old_end && o->node == contact.node; ++o) {
      if (o->spring.stiffness <= 0 || taken[static_cast<std::size_t>(o - old_begin)]) continue;
      const std::int64_t bars = bars_apart(m, *o, contact);
      if (bars >= apart) continue;
      apart = bars;
      same = o;
    }
    if (same != old_end) {
      contact = *same;  // with the bar it had followed
      taken[static_cast<std::size_t>(same - old_begin)] = 1;
    }
    found.push_back(contact);
  };
  // A bent fiber may be near a point at several places, which become contacts of their own: bars nearer than the one before and after.
  std::vector<double> bar_distance2;
  const auto each_place = [&](const Vec3& point, std::span<const Candidate> run, double reach, auto&& add) {
    bar_distance2.clear();
    for (const Candidate& c : run) bar_distance2.push_back(distance2_to_bar(g, point - Vec3(0, c.image * m.period_y, 0), c.segment));
    for (std::size_t i = 0; i < run.size(); ++i) {
      const double here = bar_distance2[i];
      if (here >= reach * reach || (i > 0 && here >= bar_distance2[i - 1]) || (i + 1 < run.size() && here > bar_distance2[i + 1])) continue;
      add(run[i], here);
    }
  };

  // Reed bars: long and few, so every bar is asked for its distance in the plane normal to it.
  const auto find_reed = [&](std::uint32_t p) {
    for (std::uint32_t bar = 0; bar < m.fibers() && m.role[bar] == Role::reed; ++bar) {
      const std::uint32_t s = m.first[bar];
      const Vec3 r = g.x[p] - g.x[s];
      const double reach = touch_reach(m, fiber, bar) + skin + half_bar;
      if (std::abs(r.x()) > reach) continue;
      const double from = periodic ? std::ceil((r.y() - reach) / m.period_y) : 0, to = periodic ? std::floor((r.y() + reach) / m.period_y) : 0;
      for (auto image = static_cast<std::int32_t>(from); image <= static_cast<std::int32_t>(to); ++image) {
        candidates.push_back({bar, image, 0, s, image});
      }
    }
  };
  // The contacts of a node: of its own and at the points of the halves of the bars that meet in it.
  const auto keep_old = [&](std::uint32_t p) {
    const auto keep = [&](std::uint32_t bar, bool second_half) {
      auto o = std::lower_bound(old_begin, old_end, bar, [](const LineContact& c, std::uint32_t node) { return c.node < node; });
      for (; o != old_end && o->node == bar; ++o) {
        if ((o->fraction >= 0.5F) == second_half && m.role[m.fiber_of[o->segment]] != Role::reed) found.push_back(*o);
      }
    };
    keep(p, false);
    if (p > begin) {
      keep(p - 1, true);
    } else if (m.periodic[fiber]) {
      keep(m.last(fiber) - 1, true);
    }
  };

  // Makes contacts of the bars near a node, run by run along the fibers that they belong to.
  const auto add_candidates = [&](std::uint32_t p) {
    const Vec3& x = g.x[p];
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
      if (a.fiber != b.fiber) return a.fiber < b.fiber;
      if (a.image_key != b.image_key) return a.image_key < b.image_key;
      return a.chain < b.chain;
    });
    for (std::size_t i = 0; i < candidates.size();) {
      std::size_t j = i + 1;
      while (j < candidates.size() && candidates[j].fiber == candidates[i].fiber && candidates[j].image_key == candidates[i].image_key &&
             candidates[j].chain <= candidates[j - 1].chain + 1) {
        ++j;
      }
      const std::span<const Candidate> run(candidates.data() + i, j - i);
      i = j;
      const double reach = touch_reach(m, fiber, run.front().fiber) + skin;
      if (meets_at_nodes(m, fiber, run.front().fiber)) {
        each_place(x, run, reach, [&](const Candidate& c, double d2) {
          add_line({.node = p, .segment = c.segment, .image = c.image, .spring = {}}, d2);
        });
        continue;
      }
      // The points on the halves of the two bars that meet in p.
      for (int k = 0; k < points; ++k) {
        const double eta = (k + 0.5) / points;
        LineContact contact;
        contact.fraction = static_cast<float>(eta);
        Vec3 point;
        std::int32_t seam = 0;
        if (eta < 0.5) {
          if (m.rest_length[p] <= 0) continue;
          contact.node = p;
          point = contact_point(g, contact);
        } else {
          if (p == begin && !m.periodic[fiber]) continue;
          contact.node = p > begin ? p - 1 : m.last(fiber) - 1;
          seam = p > begin ? 0 : 1;
          point = contact_point(g, contact) - Vec3(0, seam * m.period_y, 0);
        }
        each_place(point, run, reach, [&](const Candidate& c, double d2) {
          contact.segment = c.segment;
          contact.image = c.image + seam;
          add_line(contact, d2);
        });
      }
    }
  };

  for (std::uint32_t p = begin; p < end; ++p) {
    const Vec3& x = g.x[p];
    if (x.x() > active_x_max) continue;
    candidates.clear();
    if (!stale[p]) {
      keep_old(p);
      find_reed(p);
      add_candidates(p);
      continue;
    }
    std::int32_t wrap = 0;
    Vec3 folded = x;
    if (periodic) {
      wrap = static_cast<std::int32_t>(std::floor(x.y() / m.period_y));
      folded.y() -= wrap * m.period_y;
    }
    const auto cell_range = [&](int axis, int n) {
      const double u = (folded[axis] - bins_.origin[axis]) / bins_.size[axis];
      const double r = reach_middle / bins_.size[axis];
      const double low = std::max(0.0, std::min<double>(n, std::floor(u - r)));  // n, an empty range, where u is not a number
      const double high = std::max(-1.0, std::min(n - 1.0, std::floor(u + r)));
      return std::pair(static_cast<int>(low), static_cast<int>(high));
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
          const double along = from_middle.dot(g.bar_tangent[s]);
          const double cosine = g.node_tangent[p].dot(g.bar_tangent[s]);
          const double off_line = line_reach + half_bar * std::sqrt(std::max(0.0, 1 - cosine * cosine)) + 0.1 * bar_fiber;
          if (middle2 - along * along > off_line * off_line) continue;
          const std::int32_t image = wrap + turns - bins_.wrap[slot];
          Vec3 point = x;
          point.y() -= image * m.period_y;
          const double d2 = distance2_to_bar(g, point, s);
          if (d2 > reach_node * reach_node) continue;
          const std::uint32_t other = m.fiber_of[s];
          const bool closed = m.periodic[other];
          const std::int64_t chain = static_cast<std::int64_t>(s) - m.first[other] + (closed ? static_cast<std::int64_t>(image) * m.own_nodes(other) : 0);
          if (other == fiber && within_own_bend(m, fiber, p, s, image)) continue;
          candidates.push_back({other, closed ? 0 : image, chain, s, image});
        }
      }
    }
    find_reed(p);
    add_candidates(p);
  }

  std::stable_sort(found.begin(), found.end(), [](const LineContact& a, const LineContact& b) { return a.node < b.node; });
}

namespace {

struct Reach {
  double pair = 0, bar = 0;  ///< largest distance of a point from an axis at touch, longest bar [m]
};

Reach reach_of(const Model& m) {
  Reach r;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] == Role::reed) continue;
    // A point stands for half a diameter at most, a quarter to either side.
    r.pair = std::max(r.pair, 2.5 * m.type_of(f).radius);
    for (std::uint32_t s = m.first[f]; s < m.last(f); ++s) r.bar = std::max(r.bar, m.rest_length[s]);
  }
  return r;
}

}  // namespace

void NeighborSearch::note_motion(const Model& m, const FiberGeometry& g, std::span<const Vec3> x_before, double skin, double active_x_max,
                                 std::vector<double>& moved) {
  const Reach reach = reach_of(m);
  const double slab = reach.pair + skin + 2 * reach.bar;
  double low = 1e300, high = -1e300;
  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
    if (g.x[p].x() > active_x_max) continue;
    low = std::min(low, g.x[p].x());
    high = std::max(high, g.x[p].x());
  }
  if (low > high) return;
  const auto slabs = static_cast<std::size_t>((high - low) / slab) + 1;
  const auto slab_at = [&](std::uint32_t p) { return static_cast<std::size_t>((g.x[p].x() - low) / slab); };
  std::vector<double> most(slabs + 2, 0);  // with an empty slab at either end
  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
    if (g.x[p].x() > active_x_max) continue;
    double& s = most[slab_at(p) + 1];
    s = std::max(s, std::isinf(moved[p]) ? moved[p] : (g.x[p] - x_before[p]).norm());
  }
  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
    if (g.x[p].x() > active_x_max) continue;
    const std::size_t s = slab_at(p);
    moved[p] += std::max({most[s], most[s + 1], most[s + 2]});
  }
}

void NeighborSearch::build(const Model& m, const FiberGeometry& g, double skin, double active_x_max, double moved_limit,
                           std::vector<double>& moved, ContactList& contacts) {
  const Reach longest = reach_of(m);
  reach_max_ = longest.pair;
  bar_max_ = longest.bar;
  bin_segments(m, g, cell_share * (reach_max_ + skin + bar_max_), active_x_max);
  stale_.resize(m.nodes());
  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
    stale_[p] = moved[p] > moved_limit && g.x[p].x() <= active_x_max;
    if (stale_[p]) moved[p] = 0;
  }
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  found_.resize(fibers);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) search_fiber(m, g, f, skin, active_x_max, stale_, contacts, found_[f]);

  contacts.line.clear();
  contacts.line_of.assign(fibers + 1, 0);
  for (std::uint32_t f = 0; f < fibers; ++f) {
    contacts.line.insert(contacts.line.end(), found_[f].begin(), found_[f].end());
    contacts.line_of[f + 1] = static_cast<std::uint32_t>(contacts.line.size());
  }
}

void pick_active(const Model& m, const FiberGeometry& g, double skin, ContactList& contacts) {
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  std::vector<std::uint32_t> near(fibers, 0);
  std::vector<std::uint8_t> keep(contacts.line.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    for (std::uint32_t i = contacts.line_of[f]; i < contacts.line_of[f + 1]; ++i) {
      LineContact& c = contacts.line[i];
      if (g.travel[c.node] + g.travel[c.segment] < c.asleep_until - skin) {
        keep[i] = false;
        continue;
      }
      const PolylinePoint q = walk_to_point(m, g, contact_point(g, c), c.segment, c.image);
      const double gap = std::sqrt(q.distance2) - touch_reach(m, f, m.fiber_of[c.segment]);
      if (!m.node_contact) let_sleep(g, gap, c);
      keep[i] = gap < skin;
      near[f] += keep[i];
    }
  }
  ActiveContacts& active = contacts.active;
  active.of.assign(fibers + 1, 0);
  for (std::uint32_t f = 0; f < fibers; ++f) active.of[f + 1] = active.of[f] + near[f];
  active.number.clear();
  for (std::uint32_t i = 0; i < keep.size(); ++i) {
    if (keep[i]) active.number.push_back(i);
  }
  index_targets(m, contacts);
}

void index_targets(const Model& m, ContactList& contacts) {
  ActiveContacts& active = contacts.active;
  active.reacts.assign(active.number.size(), {0, 0});
  active.reaction.resize(2 * active.number.size());
  const auto touched = [&](std::uint32_t i) { return m.fiber_of[contacts.line[active.number[i]].segment]; };
  const auto count = static_cast<std::uint32_t>(active.number.size());
  active.target_of.assign(m.fibers() + 1, 0);
  for (std::uint32_t i = 0; i < count; ++i) ++active.target_of[touched(i) + 1];
  for (std::size_t f = 0; f < m.fibers(); ++f) active.target_of[f + 1] += active.target_of[f];
  active.target.resize(count);
  std::vector<std::uint32_t> at(active.target_of.begin(), active.target_of.end() - 1);
  for (std::uint32_t i = 0; i < count; ++i) active.target[at[touched(i)]++] = i;
}

}  // namespace weave
