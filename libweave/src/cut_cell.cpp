// The unit cell, cut out of the cloth on the loom.
#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>

#include "weave/loom.hpp"

namespace weave {
namespace {

/// Mean x of the weft column that begins with a pick [m]; none if it is not on the loom.
std::optional<double> column_position(const Case& c, const Snapshot& loom, int pick) {
  const int begin = c.warps() + pick, end = begin + c.layers;
  double sum = 0, count = 0;
  for (std::size_t f = 0; f < loom.fibers(); ++f) {
    if (!loom.weft[f] || loom.yarn[f] < begin || loom.yarn[f] >= end) continue;
    for (auto p = loom.offset[f]; p + 1 < loom.offset[f + 1]; ++p) {
      sum += loom.x[p].x();
      ++count;
    }
  }
  return count > 0 ? std::optional(sum / count) : std::nullopt;
}

/// Length of a cell on the loom [m]: from the column before it to its last one, or, where that is longer, from its first column to that of
/// the next cell, unless this one lies at the fell and is still to be pressed on. Its image follows in the gap behind it as its own columns
/// do in the one before it, and neither of these gaps is to become narrower than it is.
double length_on_loom(const Case& c, const Snapshot& loom, int first_pick) {
  const auto distance = [&](int pick) {
    const auto from = column_position(c, loom, pick), to = column_position(c, loom, pick + c.picks_per_cell());
    return from && to ? *to - *from : 0;
  };
  const bool next_is_at_the_fell = !column_position(c, loom, first_pick + c.picks_per_cell() + c.layers);
  const double length = std::max(distance(first_pick - c.layers), next_is_at_the_fell ? 0 : distance(first_pick));
  return length > 0 ? length : c.cell_length();
}

/// A snapshot with all x drawn toward or away from one of them. Fibers stay stretched as they are.
Snapshot drawn(const Snapshot& loom, double fixed_x, double factor) {
  Snapshot result = loom;
  for (Vec3& x : result.x) x.x() = fixed_x + factor * (x.x() - fixed_x);
  const auto bar = [](const Snapshot& s, std::int64_t p) { return (s.x[p] - s.x[p - 1]).norm(); };
  for (std::size_t f = 0; f < loom.fibers(); ++f) {
    for (auto p = loom.offset[f] + 1; p < loom.offset[f + 1]; ++p)
      result.arc[p] = result.arc[p - 1] + bar(result, p) / bar(loom, p) * (loom.arc[p] - loom.arc[p - 1]);
  }
  return result;
}

/// Farthest x at which a warp's held end lies [m].
double held_end(const Snapshot& loom) {
  double x = -std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < loom.fibers(); ++f) {
    if (!loom.weft[f]) x = std::max(x, loom.x[loom.offset[f]].x());
  }
  return x;
}

void begin_fiber(const Snapshot& loom, std::size_t f, int yarn, Snapshot& snap) {
  if (snap.offset.empty()) snap.offset.push_back(0);
  snap.yarn.push_back(yarn);
  snap.fiber.push_back(loom.fiber[f]);
  snap.weft.push_back(loom.weft[f]);
  snap.radius.push_back(loom.radius[f]);
  snap.area.push_back(loom.area[f]);
}

template <typename Lines>
void add_node(const Vec3& x, double tension, double arc, Lines& snap) {
  snap.x.push_back(x);
  snap.tension.push_back(tension);
  snap.arc.push_back(arc);
}

template <typename Lines>
void end_fiber(Lines& snap) {
  snap.offset.push_back(static_cast<std::int64_t>(snap.x.size()));
}

/// The part of a warp from where it first comes to x_min to where it then first comes to x_max. A steep leg may lean back over either.
/// Lines: of a snapshot, or of what lies beyond it.
template <typename Lines>
void add_between_faces(const Snapshot& loom, std::size_t f, double x_min, double x_max, Lines& snap) {
  const auto end = loom.offset[f + 1];
  auto p = loom.offset[f];
  const auto crosses = [&](std::int64_t q, double face) { return loom.x[q].x() <= face && loom.x[q + 1].x() > face; };
  const auto add_within_bar = [&](std::int64_t q, double share, double arc_start) {
    add_node(loom.x[q] + share * (loom.x[q + 1] - loom.x[q]), loom.tension[q] + share * (loom.tension[q + 1] - loom.tension[q]),
             loom.arc[q] + share * (loom.arc[q + 1] - loom.arc[q]) - arc_start, snap);
  };
  const auto share_at = [&](std::int64_t q, double face) { return (face - loom.x[q].x()) / (loom.x[q + 1].x() - loom.x[q].x()); };
  while (p + 1 < end && loom.x[p].x() <= x_min && !crosses(p, x_min)) ++p;
  if (p + 1 >= end) return;
  const double share = std::max(0.0, share_at(p, x_min));  // 0: the warp's end is held within the cell
  const double arc_start = loom.arc[p] + share * (loom.arc[p + 1] - loom.arc[p]);
  add_within_bar(p, share, arc_start);
  while (p + 2 < end && !crosses(p, x_max)) add_within_bar(p++, 1, arc_start);
  add_within_bar(p, std::min(1.0, share_at(p, x_max)), arc_start);
}

}  // namespace

Snapshot cut_cell(const Case& c, const Snapshot& on_loom, int first_pick) {
  const int warps = c.warps(), picks = c.picks_per_cell();
  const std::optional<double> last_column = column_position(c, on_loom, first_pick + picks - c.layers);
  if (!last_column) throw std::runtime_error(fmt::format("the cell of picks {}... is no longer on the loom", first_pick + 1));
  Snapshot snap;
  snap.length_on_loom = length_on_loom(c, on_loom, first_pick);
  const Snapshot loom = drawn(on_loom, *last_column, c.cell_length() / snap.length_on_loom);
  snap.time = loom.time;
  snap.pick = first_pick + picks;
  snap.cell_width = loom.cell_width;
  snap.cell_length = c.cell_length();
  snap.x_min = std::max(*last_column - snap.cell_length, held_end(loom));
  snap.x_max = snap.x_min + snap.cell_length;
  snap.beyond.length = snap.cell_length / c.columns;
  snap.beyond.offset = {0};
  for (std::size_t f = 0; f < loom.fibers(); ++f) {
    if (!loom.weft[f]) {
      begin_fiber(loom, f, loom.yarn[f], snap);
      add_between_faces(loom, f, snap.x_min, snap.x_max, snap);
      end_fiber(snap);
      add_between_faces(loom, f, snap.x_max, snap.x_max + snap.beyond.length, snap.beyond);
      end_fiber(snap.beyond);
    } else if (loom.yarn[f] >= warps + first_pick && loom.yarn[f] < warps + first_pick + picks) {
      begin_fiber(loom, f, warps + (loom.yarn[f] - warps) % picks, snap);
      for (auto p = loom.offset[f]; p < loom.offset[f + 1]; ++p) add_node(loom.x[p], loom.tension[p], loom.arc[p], snap);
      end_fiber(snap);
      end_fiber(snap.beyond);
    }
  }
  return snap;
}

}  // namespace weave
