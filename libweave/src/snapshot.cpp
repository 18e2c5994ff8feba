#include "weave/snapshot.hpp"

#include "weave/axis.hpp"

namespace weave {

Snapshot on_axis(const Snapshot& s) {
  if (s.along_axis) return s;
  Snapshot r = s;
  r.along_axis = true;
  r.offset.assign(1, 0);
  r.x.clear();
  r.tension.clear();
  r.arc.clear();
  const auto add = [&](const Vec3& x, double tension, double arc) {
    r.x.push_back(x);
    r.tension.push_back(tension);
    r.arc.push_back(arc);
  };
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    const auto begin = s.offset[f], last = s.offset[f + 1] - 1;
    const Vec3 period(0, s.weft[f] ? s.cell_width : 0, 0);
    const Vec3 seam = s.weft[f] && last > begin + 1 ? span_between(s.x[last - 1] - period, s.x[begin], s.x[begin + 1]).middle : s.x[begin];
    add(seam, s.tension[begin], s.arc[begin]);
    for (auto p = begin; p < last; ++p) {
      add(0.5 * (s.x[p] + s.x[p + 1]), 0.5 * (s.tension[p] + s.tension[p + 1]), 0.5 * (s.arc[p] + s.arc[p + 1]));
      if (p + 1 < last) add(span_between(s.x[p], s.x[p + 1], s.x[p + 2]).middle, s.tension[p + 1], s.arc[p + 1]);
    }
    if (last > begin) add(s.weft[f] ? seam + period : s.x[last], s.tension[last], s.arc[last]);
    r.offset.push_back(static_cast<std::int64_t>(r.x.size()));
  }
  return r;
}

}  // namespace weave
