#include "weave/snapshot.hpp"

#include <utility>

#include "weave/axis.hpp"

namespace weave {

namespace {

/// Poly-lines through points of the axes; `closed`: where a line's last node is its first one's image a period later.
struct AxisLines {
  std::vector<std::int64_t> offset = {0};
  std::vector<Vec3> x;
  std::vector<double> tension, arc;

  void add(const Vec3& at, double pull, double length) {
    x.push_back(at);
    tension.push_back(pull);
    arc.push_back(length);
  }
  /// Nodes begin ... end - 1 of a snapshot or of its continuation.
  template <typename Lines>
  void add_fiber(const Lines& s, std::int64_t begin, std::int64_t end, bool closed, const Vec3& period) {
    const auto last = end - 1;
    if (begin < end) {
      const Vec3 seam = closed && last > begin + 1 ? span_between(s.x[last - 1] - period, s.x[begin], s.x[begin + 1]).middle : s.x[begin];
      add(seam, s.tension[begin], s.arc[begin]);
      for (auto p = begin; p < last; ++p) {
        add(0.5 * (s.x[p] + s.x[p + 1]), 0.5 * (s.tension[p] + s.tension[p + 1]), 0.5 * (s.arc[p] + s.arc[p + 1]));
        if (p + 1 < last) add(span_between(s.x[p], s.x[p + 1], s.x[p + 2]).middle, s.tension[p + 1], s.arc[p + 1]);
      }
      if (last > begin) add(closed ? seam + period : s.x[last], s.tension[last], s.arc[last]);
    }
    offset.push_back(static_cast<std::int64_t>(x.size()));
  }
};

}  // namespace

Snapshot on_axis(const Snapshot& s) {
  if (s.along_axis) return s;
  const Vec3 period(0, s.cell_width, 0);
  AxisLines lines, beyond;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    lines.add_fiber(s, s.offset[f], s.offset[f + 1], s.weft[f] != 0, period);
    if (s.beyond.known()) beyond.add_fiber(s.beyond, s.beyond.offset[f], s.beyond.offset[f + 1], false, period);
  }
  Snapshot r = s;
  r.along_axis = true;
  r.offset = std::move(lines.offset);
  r.x = std::move(lines.x);
  r.tension = std::move(lines.tension);
  r.arc = std::move(lines.arc);
  if (s.beyond.known())
    r.beyond = {s.beyond.length, std::move(beyond.offset), std::move(beyond.x), std::move(beyond.tension), std::move(beyond.arc)};
  return r;
}

}  // namespace weave
