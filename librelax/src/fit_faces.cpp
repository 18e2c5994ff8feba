#include "fit_faces.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "yarn_fibers.hpp"

namespace relax {
namespace {

/// Within which shares of the way to the next column warps go over to their own paths: between two columns of wefts.
constexpr double gap_begin = 1.0 / 3, gap_end = 2.0 / 3;

struct Place {
  Vec3 x;
  double tension;
};

/// Place of the poly-line of nodes begin ... end - 1 at an arc length within it.
template <typename Lines>
Place place_at(const Lines& lines, std::int64_t begin, std::int64_t end, double arc) {
  const auto first = lines.arc.begin() + begin + 1;
  const auto p = std::min(std::upper_bound(first, lines.arc.begin() + end, arc) - lines.arc.begin(), end - 1) - 1;
  const double u = (arc - lines.arc[p]) / (lines.arc[p + 1] - lines.arc[p]);
  return {lines.x[p] + u * (lines.x[p + 1] - lines.x[p]), lines.tension[p] + u * (lines.tension[p + 1] - lines.tension[p])};
}

}  // namespace

std::vector<std::size_t> fibers_across_faces(const weave::Snapshot& s) {
  std::vector<std::size_t> next(s.fibers());
  const Vec3 period(s.x_max - s.x_min, 0, 0);
  for (std::size_t begin = 0; begin < s.fibers();) {
    std::size_t end = begin + 1;
    while (end < s.fibers() && s.yarn[end] == s.yarn[begin]) ++end;
    std::vector<Vec3> starts, ends;
    for (std::size_t f = begin; f < end; ++f) {
      next[f] = f;
      starts.push_back(s.x[s.offset[f]]);
      ends.push_back(s.x[s.offset[f + 1] - 1]);
    }
    if (!s.weft[begin]) {
      const std::vector<std::size_t> partner = fibers_that_go_on(starts, ends, period);
      for (std::size_t i = 0; i < partner.size(); ++i) next[begin + i] = begin + partner[i];
    }
    begin = end;
  }
  return next;
}

Vec3 mismatch_across_faces(const weave::Snapshot& s, std::size_t fiber, std::size_t next) {
  const Vec3 period = s.weft[fiber] ? Vec3(0, s.cell_width, 0) : Vec3(s.x_max - s.x_min, 0, 0);
  return s.x[s.offset[fiber + 1] - 1] - s.x[s.offset[next]] - period;
}

Vec3 lean_of(const weave::Snapshot& s, const std::vector<std::size_t>& next) {
  Vec3 lean = Vec3::Zero();
  int count = 0;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    if (s.weft[f]) continue;
    lean += mismatch_across_faces(s, f, next[f]);
    ++count;
  }
  return count > 0 ? Vec3(lean / count) : lean;
}

weave::Snapshot with_level_faces(const weave::Snapshot& cell) {
  constexpr int places = 16;                    // along the cell
  constexpr double steep = 1, as_level = 0.01;  // rise over run; of places that differ by less the first is taken
  const double length = cell.x_max - cell.x_min;
  std::array<double, places> steepest{};  // rise over run of the steepest warp at each place
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    for (auto p = cell.offset[f]; !cell.weft[f] && p + 1 < cell.offset[f + 1]; ++p) {
      const Vec3 along = cell.x[static_cast<std::size_t>(p + 1)] - cell.x[static_cast<std::size_t>(p)];
      const double from = (cell.x[static_cast<std::size_t>(p)].x() - cell.x_min) / length * places, to = from + along.x() / length * places;
      for (double k = std::ceil(std::min(from, to)); k <= std::max(from, to); ++k) {
        double& slope = steepest[static_cast<std::size_t>(k - places * std::floor(k / places))];
        slope = std::max(slope, along.tail<2>().norm() / std::abs(along.x()));
      }
    }
  }
  weave::Snapshot moved = cell;
  if (steepest[0] <= steep) return moved;
  const double least = std::ranges::min(steepest) + as_level;
  const auto best = std::ranges::find_if(steepest, [=](double slope) { return slope <= least; }) - steepest.begin();
  moved.x_min += static_cast<double>(best) / places * length;
  moved.x_max += static_cast<double>(best) / places * length;
  return moved;
}

weave::Snapshot fit_faces(const weave::Snapshot& nodes) {
  const weave::Snapshot cell = weave::on_axis(nodes);
  const weave::Continuation& beyond = cell.beyond;
  weave::Snapshot fitted = cell;
  if (!beyond.known()) return fitted;
  const std::vector<std::size_t> next = fibers_across_faces(cell);
  const Vec3 back = lean_of(cell, next) + Vec3(cell.x_max - cell.x_min, 0, 0);
  for (std::size_t before = 0; before < cell.fibers(); ++before) {
    const auto beyond_begin = beyond.offset[before], beyond_end = beyond.offset[before + 1];
    if (cell.weft[before] || beyond_end - beyond_begin < 2) continue;
    const std::size_t f = next[before];
    const auto begin = cell.offset[f], end = cell.offset[f + 1];
    // Past what is known beyond, the two paths differ as they do there.
    const double known = std::min(beyond.arc[beyond_end - 1], cell.arc[end - 1] - cell.arc[begin]);
    for (auto p = begin; p < end; ++p) {
      const double way = (cell.x[p].x() - cell.x[begin].x()) / beyond.length, arc = cell.arc[p] - cell.arc[begin];
      if (arc > 2 * known) break;  // a period later a steep leg may lean back as far
      const double u = std::clamp((gap_end - way) / (gap_end - gap_begin), 0.0, 1.0), share = u * u * (3 - 2 * u);
      const Place other = place_at(beyond, beyond_begin, beyond_end, std::min(arc, known));
      const Place own = place_at(cell, begin, end, cell.arc[begin] + std::min(arc, known));
      fitted.x[p] += share * (other.x - back - own.x);
      fitted.tension[p] += share * (other.tension - own.tension);
    }
  }
  return fitted;
}

}  // namespace relax
