#include "weave/neighbor_search.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace weave {
namespace {

/// Cell size over the distance that is searched: smaller cells follow the searched ball more closely.
constexpr double cell_share = 0.35;
/// A contact found anew goes on with the friction of an old one of the same point and fiber if their touched spans are not farther apart.
constexpr std::int64_t old_place_limit = 2;
/// Along x; each thread has an array of them on its stack.
constexpr int slabs_at_most = 4096;

/// Whether a node is searched for, and why.
enum Staleness : std::uint8_t { up_to_date, has_moved, placed };

struct Candidate {
  std::uint32_t fiber;
  std::int32_t image_key;  ///< image of an open fiber; 0 for a closed one, whose images are one chain
  std::int64_t chain;      ///< number of the span along the chain
  std::uint32_t span;
  std::int32_t image;
};

std::uint32_t node_of(const FoundContact& f) {
  return f.line.node;
}

/// Lower bound of the distance of a point from a span, by its chord [m].
double distance_to_span(const Span& s, const Vec3& point) {
  const Vec3 start = s.point(s.low), chord = s.point(s.high) - start;
  Vec3 r = point - start;
  r -= std::clamp(r.dot(chord) / chord.squaredNorm(), 0.0, 1.0) * chord;
  return std::max(r.norm() - s.sag(), 0.0);
}

}  // namespace

void NeighborSearch::bin_spans(const Model& m, const FiberGeometry& g, double reach, double active_x_max) {
  const auto nodes = static_cast<std::uint32_t>(m.nodes());
  const auto is_searched = [&](std::uint32_t s) {
    return m.tributary[s] > 0 && m.role[m.fiber_of[s]] != Role::reed && g.x[s].x() <= active_x_max;
  };
  double low_x = 1e300, low_y = 1e300, low_z = 1e300, high_x = -1e300, high_y = -1e300, high_z = -1e300;
#pragma omp parallel for schedule(static) reduction(min : low_x, low_y, low_z) reduction(max : high_x, high_y, high_z)
  for (std::uint32_t s = 0; s < nodes; ++s) {
    if (!is_searched(s)) continue;
    const Vec3 middle = g.span(m, m.fiber_of[s], s).middle;
    low_x = std::min(low_x, middle.x());
    low_y = std::min(low_y, middle.y());
    low_z = std::min(low_z, middle.z());
    high_x = std::max(high_x, middle.x());
    high_y = std::max(high_y, middle.y());
    high_z = std::max(high_z, middle.z());
  }
  Vec3 low(low_x, low_y, low_z), high(high_x, high_y, high_z);
  if (low_x > high_x) {
    bins_ = {};
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
  const auto cells = static_cast<std::uint32_t>(bins_.nx) * bins_.ny * bins_.nz;
  const auto wrap_of = [&](const Vec3& middle) { return periodic ? static_cast<std::int32_t>(std::floor(middle.y() / m.period_y)) : 0; };
  cell_.resize(nodes);
#pragma omp parallel for schedule(static)
  for (std::uint32_t s = 0; s < nodes; ++s) {
    if (!is_searched(s)) {
      cell_[s] = cells;
      continue;
    }
    Vec3 middle = g.span(m, m.fiber_of[s], s).middle;
    middle.y() -= wrap_of(middle) * m.period_y;
    const auto index = [&](int axis, int n) {
      return std::clamp(static_cast<int>((middle[axis] - bins_.origin[axis]) / bins_.size[axis]), 0, n - 1);
    };
    cell_[s] = static_cast<std::uint32_t>((index(0, bins_.nx) * bins_.ny + index(1, bins_.ny)) * bins_.nz + index(2, bins_.nz));
  }
  bins_.start.assign(cells + 1, 0);
  for (const std::uint32_t cell : cell_) {
    if (cell < cells) ++bins_.start[cell + 1];
  }
  for (std::uint32_t c = 0; c < cells; ++c) bins_.start[c + 1] += bins_.start[c];
  const std::uint32_t searched = bins_.start[cells];
  bins_.span.resize(searched);
  bins_.fiber.resize(searched);
  bins_.wrap.resize(searched);
  bins_.middle.resize(searched);
  bins_.tangent.resize(searched);
  std::vector<std::uint32_t> at(bins_.start.begin(), bins_.start.end() - 1);
  for (std::uint32_t s = 0; s < nodes; ++s) {
    if (cell_[s] < cells) bins_.span[at[cell_[s]]++] = s;
  }
#pragma omp parallel for schedule(static)
  for (std::uint32_t slot = 0; slot < searched; ++slot) {
    const std::uint32_t s = bins_.span[slot];
    bins_.fiber[slot] = m.fiber_of[s];
    const Span span = g.span(m, m.fiber_of[s], s);
    bins_.wrap[slot] = wrap_of(span.middle);
    bins_.middle[slot] = span.middle;
    bins_.middle[slot].y() -= bins_.wrap[slot] * m.period_y;
    bins_.tangent[slot] = span.slope.normalized();
  }
}

void NeighborSearch::search_fiber(const Model& m, const FiberGeometry& g, std::uint32_t fiber, double skin, double active_x_max,
                                  const std::vector<std::uint8_t>& stale, const ContactList& old, std::vector<FoundContact>& found) const {
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
  // What touched, and whether each is already found again.
  std::vector<FoundContact> held;
  if (!old.active.of.empty()) {
    for (std::uint32_t i = old.active.of[fiber]; i < old.active.of[fiber + 1]; ++i) {
      if (old.active.touch[i].is_held()) held.push_back({old.active.line[i], old.active.touch[i]});
    }
  }
  std::vector<std::uint8_t> taken(held.size(), 0);
  const auto add_line = [&](LineContact contact, double distance) {
    if (!m.node_contact) {
      // What is put into place counts as it lies; what has moved there was apart before the last step.
      const double gap = distance - touch_reach(m, fiber, m.fiber_of[contact.span]);
      const bool was_apart = stale[contact.node] == has_moved;
      let_sleep(g, was_apart ? std::max(gap, -approach(g, contact.node, contact.span)) : gap, contact);
    }
    auto same = held.end();
    std::int64_t apart = old_place_limit + 1;
    for (auto o = std::ranges::lower_bound(held, contact.node, {}, node_of); o != held.end() && o->line.node == contact.node; ++o) {
      if (taken[static_cast<std::size_t>(o - held.begin())]) continue;
      const std::int64_t spans = spans_apart(m, o->line, contact);
      if (spans >= apart) continue;
      apart = spans;
      same = o;
    }
    if (same == held.end()) {
      found.push_back({contact, {}});
    } else {
      found.push_back(*same);  // with the span it had followed
      taken[static_cast<std::size_t>(same - held.begin())] = 1;
    }
  };
  // A bent fiber may be near a point at several places, which become contacts of their own: spans nearer than the one before and after.
  std::vector<double> distance;
  const auto each_place = [&](const Vec3& point, std::span<const Candidate> run, double reach, auto&& add) {
    distance.clear();
    for (const Candidate& c : run)
      distance.push_back(distance_to_span(g.span(m, c.fiber, c.span), point - Vec3(0, c.image * m.period_y, 0)));
    for (std::size_t i = 0; i < run.size(); ++i) {
      const double here = distance[i];
      if (here >= reach || (i > 0 && here >= distance[i - 1]) || (i + 1 < run.size() && here > distance[i + 1])) continue;
      add(run[i], here);
    }
  };

  const auto keep_old = [&](std::uint32_t p) {
    const auto end_old = old.line.begin() + old.line_of[fiber + 1];
    for (auto o = std::ranges::lower_bound(old.line.begin() + old.line_of[fiber], end_old, p, {}, &LineContact::node);
         o != end_old && o->node == p; ++o) {
      const auto number = static_cast<std::uint32_t>(o - old.line.begin());
      const auto picked_end = old.active.number.begin() + old.active.of[fiber + 1];
      const auto picked = std::lower_bound(old.active.number.begin() + old.active.of[fiber], picked_end, number);
      if (picked != picked_end && *picked == number) {
        const auto i = picked - old.active.number.begin();
        found.push_back({old.active.line[i], old.active.touch[i]});
      } else {
        found.push_back({*o, {}});
      }
    }
  };

  // Makes contacts of the spans near a node's, run by run along the fibers that they belong to.
  const auto add_candidates = [&](std::uint32_t p, const Span& here) {
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
      const bool at_nodes = meets_at_nodes(m, fiber, run.front().fiber);
      for (int k = 0; k < (at_nodes ? 1 : points); ++k) {
        LineContact contact;
        contact.node = p;
        contact.at = at_nodes ? 0 : static_cast<float>((k + 0.5) / points - 0.5);
        if (contact.at < here.low || contact.at > here.high) continue;
        each_place(here.point(contact.at), run, reach, [&](const Candidate& c, double distance_there) {
          contact.span = c.span;
          contact.image = c.image;
          add_line(contact, distance_there);
        });
      }
    }
  };

  for (std::uint32_t p = begin; p < end; ++p) {
    if (g.x[p].x() > active_x_max) continue;
    candidates.clear();
    if (!stale[p]) {
      keep_old(p);
      continue;
    }
    const Span here = g.span(m, fiber, p);
    const Vec3& x = here.middle;
    const Vec3 along_p = here.slope.normalized();
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
        const Vec3 shifted = folded - Vec3(0, turns * m.period_y, 0);
        const std::size_t column = (static_cast<std::size_t>(ix) * bins_.ny + cy) * bins_.nz;
        for (std::uint32_t slot = bins_.start[column + iz0]; slot < bins_.start[column + iz1 + 1]; ++slot) {
          const Vec3 from_middle = shifted - bins_.middle[slot];
          const double middle2 = from_middle.squaredNorm();
          if (middle2 > reach_middle * reach_middle) continue;
          const std::uint32_t s = bins_.span[slot], other = bins_.fiber[slot];
          if (share_of_points(m, fiber, other) == 0) continue;  // the other's own points stand for the contact
          const double along = from_middle.dot(bins_.tangent[slot]);
          const double cosine = along_p.dot(bins_.tangent[slot]);
          const double off_line = line_reach + half_bar * std::sqrt(std::max(0.0, 1 - cosine * cosine)) + 0.1 * bar_fiber;
          if (middle2 - along * along > off_line * off_line) continue;
          const std::int32_t image = wrap + turns - bins_.wrap[slot];
          Vec3 point = x;
          point.y() -= image * m.period_y;
          if (distance_to_span(g.span(m, other, s), point) > reach_node) continue;
          const bool closed = m.periodic[other];
          const std::int64_t chain =
              static_cast<std::int64_t>(s) - m.first[other] + (closed ? static_cast<std::int64_t>(image) * m.own_nodes(other) : 0);
          if (other == fiber && within_own_bend(m, fiber, p, s, image)) continue;
          candidates.push_back({other, closed ? 0 : image, chain, s, image});
        }
      }
    }
    add_candidates(p, here);
  }

  std::ranges::stable_sort(found, {}, node_of);
}

namespace {

struct Reach {
  double pair = 0, bar = 0;  ///< largest distance of a point from an axis at touch, longest bar [m]
};

Reach reach_of(const Model& m) {
  double pair = 0, bar = 0;
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
#pragma omp parallel for schedule(static) reduction(max : pair, bar)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    if (m.role[f] == Role::reed) continue;
    // A point stands for half a diameter at most, a quarter to either side.
    pair = std::max(pair, 2.5 * m.type_of(f).radius);
    for (std::uint32_t s = m.first[f]; s < m.last(f); ++s) bar = std::max(bar, m.rest_length[s]);
  }
  return {pair, bar};
}

}  // namespace

void NeighborSearch::note_motion(const Model& m, const FiberGeometry& g, std::span<const Vec3> x_before, double skin, double active_x_max,
                                 std::vector<double>& moved) {
  const Reach reach = reach_of(m);
  const auto nodes = static_cast<std::uint32_t>(m.nodes());
  double low = 1e300, high = -1e300;
#pragma omp parallel for schedule(static) reduction(min : low) reduction(max : high)
  for (std::uint32_t p = 0; p < nodes; ++p) {
    if (g.x[p].x() > active_x_max) continue;
    low = std::min(low, g.x[p].x());
    high = std::max(high, g.x[p].x());
  }
  if (low > high) return;
  const auto is_followed = [&](std::uint32_t p) { return g.x[p].x() <= active_x_max && m.role[m.fiber_of[p]] != Role::reed; };
  const double slab = std::max(reach.pair + skin + 2 * reach.bar, (high - low) / slabs_at_most);
  const auto slabs = static_cast<std::size_t>((high - low) / slab) + 1;
  const auto slab_at = [&](std::uint32_t p) { return static_cast<std::size_t>((g.x[p].x() - low) / slab); };
  std::vector<double> most_in(slabs + 2, 0);  // with an empty slab at either end
  double* most = most_in.data();
#pragma omp parallel for schedule(static) reduction(max : most[:slabs + 2])
  for (std::uint32_t p = 0; p < nodes; ++p) {
    if (!is_followed(p)) continue;
    double& s = most[slab_at(p) + 1];
    s = std::max(s, std::isinf(moved[p]) ? moved[p] : (g.x[p] - x_before[p]).norm());
  }
#pragma omp parallel for schedule(static)
  for (std::uint32_t p = 0; p < nodes; ++p) {
    if (!is_followed(p)) continue;
    const std::size_t s = slab_at(p);
    moved[p] += std::max({most[s], most[s + 1], most[s + 2]});
  }
}

void NeighborSearch::build(const Model& m, const FiberGeometry& g, double skin, double active_x_max, double moved_limit,
                           std::vector<double>& moved, ContactList& contacts) {
  const Reach longest = reach_of(m);
  reach_max_ = longest.pair;
  bar_max_ = longest.bar;
  bin_spans(m, g, cell_share * (reach_max_ + skin + bar_max_), active_x_max);
  const auto nodes = static_cast<std::uint32_t>(m.nodes());
  stale_.resize(nodes);
#pragma omp parallel for schedule(static)
  for (std::uint32_t p = 0; p < nodes; ++p) {
    const bool due = moved[p] > moved_limit && g.x[p].x() <= active_x_max;
    stale_[p] = !due ? up_to_date : std::isinf(moved[p]) ? placed : has_moved;
    if (due) moved[p] = 0;
  }
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  found_.resize(fibers);
  std::vector<std::uint32_t> holding(fibers);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    search_fiber(m, g, f, skin, active_x_max, stale_, contacts, found_[f]);
    holding[f] = static_cast<std::uint32_t>(std::ranges::count_if(found_[f], &Touch::is_held, &FoundContact::touch));
  }

  ActiveContacts& held = contacts.active;
  contacts.line_of.assign(fibers + 1, 0);
  held.of.assign(fibers + 1, 0);
  for (std::uint32_t f = 0; f < fibers; ++f) {
    contacts.line_of[f + 1] = contacts.line_of[f] + static_cast<std::uint32_t>(found_[f].size());
    held.of[f + 1] = held.of[f] + holding[f];
  }
  contacts.line.resize(contacts.line_of[fibers]);
  held.number.resize(held.of[fibers]);
  held.line.resize(held.of[fibers]);
  held.touch.resize(held.of[fibers]);
#pragma omp parallel for schedule(static)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    std::uint32_t i = contacts.line_of[f], k = held.of[f];
    for (const auto& [line, touch] : found_[f]) {
      if (touch.is_held()) {
        held.number[k] = i;
        held.line[k] = line;
        held.touch[k++] = touch;
      }
      contacts.line[i++] = line;
    }
  }
}

}  // namespace weave
