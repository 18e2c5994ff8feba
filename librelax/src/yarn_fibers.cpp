#include "yarn_fibers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>

#include "fit_faces.hpp"
#include "weave/assignment.hpp"

namespace relax {
namespace {

/// A fiber's share of its length as whole periods and the fiber in which they end.
struct Place {
  std::size_t fiber;
  double share;
  int periods;
};

Place place_of(const YarnFibers& yarn, std::size_t fiber, double share) {
  int periods = 0;
  for (; share >= 1; share -= 1, ++periods) fiber = yarn.next[fiber];
  for (; share < 0; share += 1, --periods) fiber = yarn.previous[fiber];
  return {fiber, share, periods};
}

std::size_t segment_at(const std::vector<double>& shares, double share) {
  const auto after = std::upper_bound(shares.begin() + 1, shares.end() - 1, share);
  return static_cast<std::size_t>(after - shares.begin()) - 1;
}

void measure(YarnFibers& yarn) {
  yarn.share.assign(yarn.size(), {});
  yarn.length.assign(yarn.size(), 0);
  for (std::size_t f = 0; f < yarn.size(); ++f) {
    const std::vector<Vec3>& x = yarn.points[f];
    std::vector<double>& share = yarn.share[f];
    share.push_back(0);
    for (std::size_t i = 1; i < x.size(); ++i) share.push_back(share.back() + (x[i] - x[i - 1]).norm());
    yarn.length[f] = share.back();
    for (double& s : share) s /= yarn.length[f];
    share.back() = 1;
  }
}

void pair_ends(YarnFibers& yarn) {
  std::vector<Vec3> starts, ends;
  for (const std::vector<Vec3>& x : yarn.points) {
    starts.push_back(x.front());
    ends.push_back(x.back());
  }
  yarn.next = fibers_that_go_on(starts, ends, yarn.period);
  yarn.previous.resize(yarn.size());
  for (std::size_t f = 0; f < yarn.size(); ++f) yarn.previous[yarn.next[f]] = f;
}

Vec3 mismatch_of(const YarnFibers& yarn, std::size_t f) {
  return yarn.points[f].back() - yarn.points[yarn.next[f]].front() - yarn.period;
}

/// Names the fiber of a cell that is farthest from periodic. mismatch: in fiber diameters.
[[noreturn]] void refuse_mismatch(const YarnFibers& yarn, std::size_t fiber, double mismatch) {
  throw std::invalid_argument(fmt::format(
      "the cell is not periodic: {} ends at {}, {:.3g} fiber diameters from where a fiber of its yarn begins a period later; at "
      "most {:g} are spread along a fiber",
      yarn.name_of(fiber), place_text(yarn.points[fiber].back()), mismatch, mismatch_max));
}

/// Makes each fiber end exactly where the next begins, a period later.
void close_ends(YarnFibers& yarn) {
  std::vector<Vec3> mismatch;
  for (std::size_t f = 0; f < yarn.size(); ++f) mismatch.push_back(mismatch_of(yarn, f));
  for (std::size_t f = 0; f < yarn.size(); ++f)
    for (std::size_t i = 0; i < yarn.points[f].size(); ++i) yarn.points[f][i] -= yarn.share[f][i] * mismatch[f];
  for (std::size_t f = 0; f < yarn.size(); ++f) yarn.points[f].back() = yarn.points[yarn.next[f]].front() + yarn.period;
}

/// A fiber and those that it goes on in, until it comes back to itself: one chain over as many periods.
struct Cycle {
  std::vector<std::size_t> fibers;
  std::vector<Vec3> x;  ///< [m]
};

std::vector<Cycle> cycles_of(const YarnFibers& yarn) {
  std::vector<Cycle> cycles;
  std::vector<bool> seen(yarn.size(), false);
  for (std::size_t first = 0; first < yarn.size(); ++first) {
    if (seen[first]) continue;
    Cycle cycle;
    for (std::size_t f = first; !seen[f]; f = yarn.next[f]) {
      const Vec3 shift = static_cast<double>(cycle.fibers.size()) * yarn.period;
      for (std::size_t i = 0; i + 1 < yarn.points[f].size(); ++i) cycle.x.push_back(yarn.points[f][i] + shift);
      cycle.fibers.push_back(f);
      seen[f] = true;
    }
    cycle.x.push_back(cycle.x.front() + static_cast<double>(cycle.fibers.size()) * yarn.period);
    cycles.push_back(std::move(cycle));
  }
  return cycles;
}

/// Cuts the chains of a yarn, those of a weft start anywhere, where they first pass each image of its first face.
void cut_at_faces(YarnFibers& yarn) {
  const int axis = yarn.axis();
  const double width = yarn.period[axis];
  for (const Cycle& cycle : cycles_of(yarn)) {
    const std::vector<Vec3>& x = cycle.x;
    const auto periods = static_cast<double>(cycle.fibers.size());
    // From the first point, of which the last is the image exactly: so a face through that, to round-off, is met at one of the two.
    const auto way = [&](std::size_t i) { return i + 1 < x.size() ? x[i][axis] - x.front()[axis] : periods * width; };
    const double to_face = (yarn.first_face - x.front()[axis]) / width, way_to_face = (to_face - std::floor(to_face)) * width;
    const double first_way = way_to_face < width ? way_to_face : 0;
    struct Passage {
      std::size_t before;  ///< point of the chain
      Vec3 x;
    };
    std::vector<Passage> passages;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) {
      while (passages.size() < cycle.fibers.size()) {
        const double face = first_way + static_cast<double>(passages.size()) * width;
        if (way(i) > face || way(i + 1) <= face) break;
        passages.push_back({i, x[i] + (face - way(i)) / (way(i + 1) - way(i)) * (x[i + 1] - x[i])});
      }
    }
    if (passages.size() != cycle.fibers.size())
      throw std::invalid_argument(fmt::format("{} does not pass the cell's face at {} = {:.4g} mm once each period",
                                              yarn.name_of(cycle.fibers.front()), "xy"[axis], 1e3 * yarn.first_face));
    const Vec3 around = x.back() - x.front();
    for (std::size_t k = 0; k < passages.size(); ++k) {
      const bool last = k + 1 == passages.size();
      const Vec3 to_cell = (yarn.first_face - x.front()[axis] - first_way - static_cast<double>(k) * width) * yarn.period.normalized();
      Vec3 start = passages[k].x, end_point = (last ? passages.front() : passages[k + 1]).x;
      start[axis] = yarn.first_face;
      end_point[axis] = yarn.last_face;
      std::vector<Vec3> points = {start};
      const auto add = [&](const Vec3& p) {
        if ((p - points.back()).norm() > 1e-9 * width) points.push_back(p);
      };
      const std::size_t end = last ? x.size() : passages[k + 1].before + 1;
      for (std::size_t i = passages[k].before + 1; i < end; ++i) add(x[i] + to_cell);
      for (std::size_t i = 1; last && i <= passages.front().before; ++i) add(x[i] + around + to_cell);
      add(end_point);
      points.back() = end_point;
      yarn.points[cycle.fibers[k]] = std::move(points);
    }
  }
}

}  // namespace

std::vector<std::size_t> fibers_that_go_on(const std::vector<Vec3>& starts, const std::vector<Vec3>& ends, const Vec3& period) {
  const auto n = static_cast<Eigen::Index>(starts.size());
  Eigen::MatrixXd cost(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      cost(i, j) = (ends[static_cast<std::size_t>(i)] - starts[static_cast<std::size_t>(j)] - period).squaredNorm();
  const std::vector<Eigen::Index> partner = weave::cheapest_assignment(cost);
  return {partner.begin(), partner.end()};
}

std::string place_text(const Vec3& x) {
  return fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z());
}

std::string YarnFibers::name() const {
  return fmt::format("{} {}", weft ? "weft" : "warp", yarn);
}

std::string YarnFibers::name_of(std::size_t fiber) const {
  return fmt::format("fiber {} of {}", number[fiber], name());
}

Vec3 YarnFibers::at(std::size_t fiber, double share_wanted) const {
  const Place p = place_of(*this, fiber, share_wanted);
  const std::size_t i = segment_at(share[p.fiber], p.share);
  const double u = (p.share - share[p.fiber][i]) / (share[p.fiber][i + 1] - share[p.fiber][i]);
  return points[p.fiber][i] + u * (points[p.fiber][i + 1] - points[p.fiber][i]) + p.periods * period;
}

Vec3 YarnFibers::center(double share_wanted) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t f = 0; f < size(); ++f) sum += at(f, share_wanted);
  return sum / static_cast<double>(size());
}

YarnFibers::Crossing YarnFibers::crossing(std::size_t fiber, double near_share, const Vec3& origin, const Vec3& normal) const {
  Crossing best;
  double nearest = 0.5;
  const Place middle = place_of(*this, fiber, near_share);
  const auto look = [&](std::size_t f, std::size_t i, int periods) {
    const Vec3 shift = periods * period;
    const Vec3 a = points[f][i] + shift, b = points[f][i + 1] + shift;
    const double height_a = normal.dot(a - origin), height_b = normal.dot(b - origin);
    if ((height_a < 0) == (height_b < 0)) return;
    const double u = height_a / (height_a - height_b);
    const double away = std::abs(periods - middle.periods + share[f][i] + u * (share[f][i + 1] - share[f][i]) - middle.share);
    if (away >= nearest) return;
    nearest = away;
    best = {a + u * (b - a), (b - a).normalized(), true};
  };
  for (const int step : {1, -1}) {
    std::size_t f = middle.fiber, i = segment_at(share[f], middle.share);
    int periods = middle.periods;
    for (;;) {
      const double gone =
          step > 0 ? periods - middle.periods + share[f][i] - middle.share : middle.share - share[f][i + 1] - periods + middle.periods;
      if (gone >= nearest) break;
      look(f, i, periods);
      if (step > 0) {
        if (++i + 1 == points[f].size()) {
          f = next[f];
          i = 0;
          ++periods;
        }
      } else if (i-- == 0) {
        f = previous[f];
        i = points[f].size() - 2;
        --periods;
      }
    }
  }
  return best;
}

PeriodicYarns periodic_yarns(const weave::Snapshot& cell) {
  if (!(cell.cell_length > 0) || !(cell.cell_width > 0) || !(cell.x_max > cell.x_min))
    throw std::invalid_argument("envelopes need a unit cell, with a period along x and one along y; this is a whole loom or cloth");
  if (cell.fibers() == 0) throw std::invalid_argument("the unit cell holds no fibers");
  const weave::Snapshot fitted = cell.beyond.known() ? fit_faces(cell) : cell;
  std::map<std::pair<bool, int>, std::vector<std::size_t>> fibers;
  for (std::size_t f = 0; f < cell.fibers(); ++f) fibers[{cell.weft[f] != 0, cell.yarn[f]}].push_back(f);
  PeriodicYarns result;
  std::vector<std::vector<std::size_t>> in_cell;  // fibers of the yarns
  for (const auto& [key, members] : fibers) {
    YarnFibers yarn;
    yarn.weft = key.first;
    yarn.yarn = key.second;
    yarn.period = yarn.weft ? Vec3(0, cell.cell_width, 0) : Vec3(cell.x_max - cell.x_min, 0, 0);
    yarn.first_face = yarn.weft ? 0 : cell.x_min;
    yarn.last_face = yarn.weft ? cell.cell_width : cell.x_max;
    for (const std::size_t f : members) {
      const auto begin = static_cast<std::size_t>(fitted.offset[f]), end = static_cast<std::size_t>(fitted.offset[f + 1]);
      const std::string name = "fiber " + std::to_string(cell.fiber[f]) + " of yarn " + std::to_string(cell.yarn[f]);
      std::vector<Vec3> x;
      for (std::size_t i = begin; i < end; ++i) {
        if (!fitted.x[i].allFinite()) throw std::invalid_argument(name + ": point " + std::to_string(i - begin) + " is not finite");
        if (x.empty() || x.back() != fitted.x[i]) x.push_back(fitted.x[i]);
      }
      if (x.size() < 2) throw std::invalid_argument(name + " has fewer than two points");
      if (!(cell.radius[f] > 0)) throw std::invalid_argument(name + ": radius = " + std::to_string(cell.radius[f]) + " m, must be > 0");
      const double run = (x.back() - x.front())[yarn.axis()];
      if (std::abs(run - yarn.period[yarn.axis()]) > 0.25 * yarn.period[yarn.axis()])
        throw std::invalid_argument(name + " runs " + std::to_string(1e3 * run) + " mm along the cell, whose period is " +
                                    std::to_string(1e3 * yarn.period[yarn.axis()]) + " mm");
      yarn.number.push_back(cell.fiber[f]);
      yarn.points.push_back(std::move(x));
      yarn.radius.push_back(cell.radius[f]);
      yarn.area.push_back(cell.area[f]);
    }
    pair_ends(yarn);
    result.yarns.push_back(std::move(yarn));
    in_cell.push_back(members);
  }

  // As the cloth leads down to the breast beam, a woven cell leans: it is sheared upright, warps and wefts alike.
  std::vector<std::size_t> next(cell.fibers());
  for (std::size_t y = 0; y < result.yarns.size(); ++y)
    for (std::size_t f = 0; f < result.yarns[y].size(); ++f) next[in_cell[y][f]] = in_cell[y][result.yarns[y].next[f]];
  const Vec3 lean = lean_of(cell, next);
  const YarnFibers* worst_yarn = nullptr;
  std::size_t worst_fiber = 0;
  for (std::size_t y = 0; y < result.yarns.size(); ++y) {
    YarnFibers& yarn = result.yarns[y];
    for (std::vector<Vec3>& x : yarn.points)
      for (Vec3& p : x) p -= (p.x() - cell.x_min) / (cell.x_max - cell.x_min) * lean;
    for (std::size_t f = 0; f < yarn.size(); ++f) {
      const std::size_t number = in_cell[y][f];
      const Vec3 across = mismatch_across_faces(cell, number, next[number]) - (yarn.weft ? Vec3::Zero() : lean);
      const double mismatch = across.norm() / (2 * yarn.radius[f]);
      if (mismatch <= result.mismatch) continue;
      result.mismatch = mismatch;
      worst_yarn = &yarn;
      worst_fiber = f;
    }
    result.lean = std::max(result.lean, lean.norm() / (2 * yarn.radius.front()));
  }
  if (result.mismatch > mismatch_max) refuse_mismatch(*worst_yarn, worst_fiber, result.mismatch);
  for (YarnFibers& yarn : result.yarns) {
    measure(yarn);
    close_ends(yarn);
    cut_at_faces(yarn);
    measure(yarn);
  }
  return result;
}

weave::Snapshot snapshot_of(const std::vector<YarnFibers>& yarns, const weave::Snapshot& cell) {
  weave::Snapshot s;
  s.time = cell.time;
  s.pick = cell.pick;
  s.cell_width = cell.cell_width;
  s.cell_length = cell.cell_length;
  s.x_min = cell.x_min;
  s.x_max = cell.x_max;
  s.along_axis = cell.along_axis;
  s.offset = {0};
  for (const YarnFibers& yarn : yarns)
    for (std::size_t f = 0; f < yarn.size(); ++f) {
      s.yarn.push_back(yarn.yarn);
      s.fiber.push_back(static_cast<int>(f));
      s.weft.push_back(yarn.weft ? 1 : 0);
      s.radius.push_back(yarn.radius[f]);
      s.area.push_back(yarn.area[f]);
      for (std::size_t i = 0; i < yarn.points[f].size(); ++i) {
        s.x.push_back(yarn.points[f][i]);
        s.arc.push_back(yarn.share[f][i] * yarn.length[f]);
      }
      s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
    }
  s.tension.assign(s.x.size(), 0);
  return s;
}

}  // namespace relax
