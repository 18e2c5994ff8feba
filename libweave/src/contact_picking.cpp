#include "weave/contact_picking.hpp"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace weave {

void pick_active(const Model& m, const FiberGeometry& g, double skin, ContactList& contacts) {
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  ActiveContacts& active = contacts.active;
  const std::vector<std::uint32_t> number_before = std::move(active.number), of_before = std::move(active.of);
  const std::vector<LineContact> line_before = std::move(active.line);
  const std::vector<Touch> touch_before = std::move(active.touch);
  std::vector<std::uint8_t> keep(contacts.line.size());
  active.of.assign(fibers + 1, 0);
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    std::uint32_t before = of_before[f], kept = 0;
    for (std::uint32_t i = contacts.line_of[f]; i < contacts.line_of[f + 1]; ++i) {
      LineContact& c = contacts.line[i];
      bool held = false;
      if (before < of_before[f + 1] && number_before[before] == i) {
        c = line_before[before];
        held = touch_before[before++].is_held();
      }
      if (g.travel[c.node] + g.travel[c.span] < c.asleep_until - skin) {
        keep[i] = false;
        continue;
      }
      const double left = c.asleep_until - g.travel[c.span];
      const AxisPoint q = walk_to_point(m, g, contact_point(m, g, c), c.span, c.image);
      const double gap = std::sqrt(q.distance2) - touch_reach(m, f, m.fiber_of[c.span]);
      if (!m.node_contact && !held) {
        const double known_before = c.asleep_until != 0 ? left + g.travel[c.span] : -std::numeric_limits<double>::infinity();
        let_sleep(g, gap, c);
        c.asleep_until = std::max(c.asleep_until, known_before);
      }
      keep[i] = gap < skin || held;
      kept += keep[i];
    }
    active.of[f + 1] = kept;
  }
  for (std::uint32_t f = 0; f < fibers; ++f) active.of[f + 1] += active.of[f];
  active.number.resize(active.of[fibers]);
  active.line.resize(active.of[fibers]);
  active.touch.resize(active.of[fibers]);
#pragma omp parallel for schedule(static)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    std::uint32_t before = of_before[f], k = active.of[f];
    for (std::uint32_t i = contacts.line_of[f]; i < contacts.line_of[f + 1]; ++i) {
      const bool was_active = before < of_before[f + 1] && number_before[before] == i;
      if (keep[i]) {
        active.number[k] = i;
        active.line[k] = contacts.line[i];
        active.touch[k++] = was_active ? touch_before[before] : Touch{};
      }
      before += was_active;
    }
  }
  index_targets(m, active);
}

void pick_on_reed(const Model& m, const FiberGeometry& g, double skin, double active_x_max, ContactList& contacts) {
  ActiveContacts& active = contacts.on_reed;
  const ActiveContacts before = std::move(active);
  active = {};
  const auto fibers = static_cast<std::uint32_t>(m.fibers());
  std::vector<std::vector<FoundContact>> found(fibers);
  const auto add = [&](std::uint32_t f, LineContact contact, double gap) {
    Touch touch;
    if (!before.of.empty()) {
      const auto end = before.line.begin() + before.of[f + 1];
      const auto same = [&](const LineContact& c) {
        return c.node == contact.node && c.at == contact.at && m.fiber_of[c.span] == m.fiber_of[contact.span] && c.image == contact.image;
      };
      const auto old =
          std::find_if(std::ranges::lower_bound(before.line.begin() + before.of[f], end, contact.node, {}, &LineContact::node), end, same);
      if (old != end) touch = before.touch[static_cast<std::size_t>(old - before.line.begin())];
    }
    if (gap >= skin && !touch.is_held()) return;
    if (!touch.is_held()) let_sleep(g, gap, contact);
    found[f].push_back({contact, touch});
  };
  // A point of the node's span against a reed bar and its images.
  const auto add_point = [&](std::uint32_t f, LineContact contact, double touch) {
    const double reach = touch + skin;
    const Vec3 point = contact_point(m, g, contact), r = point - g.x[contact.span];
    if (std::abs(r.x()) > reach) return;
    const double from = m.period_y > 0 ? std::ceil((r.y() - reach) / m.period_y) : 0;
    const double to = m.period_y > 0 ? std::floor((r.y() + reach) / m.period_y) : 0;
    for (auto image = static_cast<std::int32_t>(from); image <= static_cast<std::int32_t>(to); ++image) {
      LineContact c = contact;
      c.image = image;
      const AxisPoint q = walk_to_point(m, g, point, c.span, c.image);
      add(f, c, std::sqrt(q.distance2) - touch);
    }
  };
#pragma omp parallel for schedule(dynamic, 1)
  for (std::uint32_t f = 0; f < fibers; ++f) {
    const std::uint32_t end = m.first[f] + (m.role[f] == Role::reed ? 0 : m.own_nodes(f));
    for (std::uint32_t p = m.first[f]; p < end; ++p) {
      if (g.x[p].x() > active_x_max) continue;
      const Span here = g.span(m, f, p);
      const double half = 0.5 * here.slope.norm() + here.sag();
      for (std::uint32_t bar = 0; bar < fibers && m.role[bar] == Role::reed; ++bar) {
        LineContact contact;
        contact.node = p;
        contact.span = m.first[bar];
        const double touch = touch_reach(m, f, bar);
        if (std::abs(here.middle.x() - g.x[contact.span].x()) > touch + skin + half) continue;
        for (std::uint32_t k = 0; k < m.points[f]; ++k) {
          contact.at = static_cast<float>((k + 0.5) / m.points[f] - 0.5);
          if (contact.at >= here.low && contact.at <= here.high) add_point(f, contact, touch);
        }
      }
    }
  }
  active.of.assign(fibers + 1, 0);
  for (std::uint32_t f = 0; f < fibers; ++f) {
    for (const auto& [line, touch] : found[f]) {
      active.number.push_back(static_cast<std::uint32_t>(active.number.size()));
      active.line.push_back(line);
      active.touch.push_back(touch);
    }
    active.of[f + 1] = static_cast<std::uint32_t>(active.line.size());
  }
  index_targets(m, active);
}

void index_targets(const Model& m, ActiveContacts& active) {
  const auto count = static_cast<std::uint32_t>(active.number.size());
  active.reacts.assign(count, {});
  active.reaction.resize(2 * active.number.size());
  const auto touched = [&](std::uint32_t i) { return m.fiber_of[active.line[i].span]; };
  active.place.resize(count);
  active.place_of.assign(m.fibers() + 1, 0);
  // Each thread counts, and then places, the contacts of a share of its own, one share after the other.
  std::vector<std::vector<std::uint32_t>> next_place(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel num_threads(static_cast <int>(next_place.size()))
  {
    const auto team = static_cast<std::size_t>(omp_get_num_threads()), thread = static_cast<std::size_t>(omp_get_thread_num());
    const auto begin = static_cast<std::uint32_t>(count * thread / team), end = static_cast<std::uint32_t>(count * (thread + 1) / team);
    std::vector<std::uint32_t>& at = next_place[thread];
    at.assign(m.fibers(), 0);
    for (std::uint32_t i = begin; i < end; ++i) ++at[touched(i)];
#pragma omp barrier
#pragma omp single
    {
      std::uint32_t next = 0;
      for (std::size_t f = 0; f < m.fibers(); ++f) {
        for (std::size_t t = 0; t < team; ++t) next += std::exchange(next_place[t][f], next);
        active.place_of[f + 1] = next;
      }
    }
    for (std::uint32_t i = begin; i < end; ++i) active.place[i] = at[touched(i)]++;
  }
}

}  // namespace weave
