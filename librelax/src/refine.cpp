#include "relax/refine.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <stdexcept>
#include <string>

#include "relax/energy.hpp"
#include "relax/report.hpp"
#include "spline.hpp"
#include "yarn_fibers.hpp"

namespace relax {
namespace {

constexpr double hexagonal_packing =
    0.9069;  ///< the share of its hexagonal cell that a fiber fills: its finer fibers may use the whole cell

constexpr double area_tolerance = 0.01;
constexpr double overlap_allowed = 0.1;  ///< [fiber diameters]
constexpr double overlap_margin = 1.1;   ///< over what fibers are pressed together at the end: forces are not quite there yet

/// Fibers of one yarn.
struct FibersOfYarn {
  std::uint32_t begin, end;
  [[nodiscard]] int count() const { return static_cast<int>(end - begin); }
};

std::vector<FibersOfYarn> yarns_of(const Cell& cell) {
  std::vector<FibersOfYarn> yarns;
  for (std::uint32_t f = 0; f < cell.fibers(); ++f) {
    if (yarns.empty() || cell.yarn[f] != cell.yarn[yarns.back().begin]) yarns.push_back({f, f});
    yarns.back().end = f + 1;
  }
  return yarns;
}

/// Solid of a yarn's fibers over the length of its period [m^2].
double solid_section(const Cell& cell, const Eigen::VectorXd& q, const FibersOfYarn& yarn) {
  constexpr int pieces = 8;  // of a span
  double solid = 0;
  for (std::uint32_t f = yarn.begin; f < yarn.end; ++f) {
    double length = 0;
    for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) {
      for (int k = 0; k < pieces; ++k) {
        length += (axis_point(cell, q, i, (k + 1.0) / pieces) - axis_point(cell, q, i, static_cast<double>(k) / pieces)).norm();
      }
    }
    solid += cell.type_of(f).area * length;
  }
  return solid / cell.period(yarn.begin, q).norm();
}

/// Mean distance of each fiber of a yarn from the yarn's mean axis [m].
std::vector<double> distance_from_axis(const Cell& cell, const Eigen::VectorXd& q, const FibersOfYarn& yarn) {
  constexpr int stations = 16;
  std::vector<double> distance(static_cast<std::size_t>(yarn.count()), 0);
  for (int k = 0; k < stations; ++k) {
    std::vector<Vec3> at;
    for (std::uint32_t f = yarn.begin; f < yarn.end; ++f) {
      const double place = static_cast<double>(k) / stations * cell.nodes_of(f);
      const auto span = static_cast<std::uint32_t>(place);
      at.push_back(axis_point(cell, q, cell.first[f] + span, place - span));
    }
    const Vec3 middle = std::accumulate(at.begin(), at.end(), Vec3(Vec3::Zero())) / yarn.count();
    for (std::size_t i = 0; i < at.size(); ++i) distance[i] += (at[i] - middle).norm() / stations;
  }
  return distance;
}

/// How many finer fibers each fiber of a yarn splits into: as many for all that go on in one another, if the number can be shared out so.
/// Where it does not divide, the fibers nearest to the yarn's middle take one more.
std::vector<int> share_out(const Cell& cell, const Eigen::VectorXd& q, const FibersOfYarn& yarn, int fibers) {
  const int coarse = yarn.count();
  if (fibers < coarse) {
    throw std::invalid_argument("refine: yarn " + std::to_string(cell.yarn[yarn.begin]) + " has " + std::to_string(coarse) +
                                " fibers, more than " + std::to_string(fibers));
  }
  std::vector<int> parts(static_cast<std::size_t>(coarse), fibers / coarse);
  const std::vector<double> distance = distance_from_axis(cell, q, yarn);
  struct Loop {
    std::vector<std::size_t> fibers;
    double distance = 0;
  };
  std::vector<Loop> loops;
  std::vector<std::uint8_t> seen(static_cast<std::size_t>(coarse), 0);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i]) continue;
    Loop loop;
    for (std::size_t j = i; !seen[j]; j = cell.next[yarn.begin + j] - yarn.begin) {
      seen[j] = 1;
      loop.fibers.push_back(j);
      loop.distance += distance[j];
    }
    loop.distance /= static_cast<double>(loop.fibers.size());
    loops.push_back(std::move(loop));
  }
  std::stable_sort(loops.begin(), loops.end(), [](const Loop& a, const Loop& b) { return a.distance < b.distance; });
  // Which loops take one more: `from[n]` is the last loop of a choice that uses up n.
  const auto left = static_cast<std::size_t>(fibers % coarse);
  constexpr int none = -1, start = -2;
  std::vector<int> from(left + 1, none);
  from[0] = start;
  for (std::size_t l = 0; l < loops.size(); ++l) {
    const std::size_t size = loops[l].fibers.size();
    for (std::size_t n = left; n >= size; --n) {
      if (from[n] == none && from[n - size] != none && from[n - size] != static_cast<int>(l)) from[n] = static_cast<int>(l);
    }
  }
  if (from[left] == none) {
    std::vector<std::size_t> order(parts.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return distance[i]; });
    for (std::size_t k = 0; k < left; ++k) ++parts[order[k]];
    return parts;
  }
  for (std::size_t n = left; n > 0;) {
    const Loop& loop = loops[static_cast<std::size_t>(from[n])];
    for (const std::size_t i : loop.fibers) ++parts[i];
    n -= loop.fibers.size();
  }
  return parts;
}

/// Place of finer fiber j of n in the section of its coarse one, from whose surface it stays half its own radius away: where two coarse
/// fibers touch, their finer ones would else change sides.
Eigen::Vector2d place_of(int j, int n, double radius, double finer_radius) {
  if (n == 1) return {0, 0};
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  const double outermost = std::min(radius * std::sqrt((n - 0.5) / (n * hexagonal_packing)), radius - 0.5 * finer_radius);
  const double r = outermost * std::sqrt((j + 0.5) / (n - 0.5));
  return {r * std::cos(j * golden), r * std::sin(j * golden)};
}

/// A finer fiber beside a coarse one.
struct FinerFiber {
  std::vector<Vec3> points;    ///< of its axis, the last one where it ends a period after the first [m]
  std::vector<double> strain;  ///< of the bar from each point but the last
  double length = 0;           ///< rest length of the coarse fiber [m]
};

FinerFiber beside(const Cell& cell, const Eigen::VectorXd& q, std::uint32_t f, const std::vector<double>& coarse_strain,
                  const Eigen::Vector2d& place, double spacing) {
  const std::uint32_t spans = cell.nodes_of(f);
  const Vec3 across = cell.weft[f] ? Vec3::UnitX() : Vec3::UnitY();
  const auto point = [&](std::uint32_t node, double share) {
    const Span span(cell, q, node);
    const Vec3 t = span.tangent(share).normalized();
    const Vec3 n = (across - across.dot(t) * t).normalized(), b = t.cross(n);
    return Vec3(span.point(share) + place.x() * n + place.y() * b);
  };
  FinerFiber fiber;
  for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) fiber.length += cell.rest_length[i];
  const int count = std::max<int>(3, static_cast<int>(std::lround(fiber.length / spacing)));
  for (int k = 0; k < count; ++k) {
    const double at = static_cast<double>(k) / count * spans;
    const auto number = static_cast<std::uint32_t>(at);
    fiber.points.push_back(point(cell.first[f] + number, at - number));
    fiber.strain.push_back(coarse_strain[cell.first[f] + number]);
  }
  fiber.points.push_back(point(cell.first[cell.next[f]], 0) + cell.period(f, q));
  return fiber;
}

/// Lets the finer fibers of a yarn go on in one another, each in the one that begins nearest to where it ends, and spreads the gaps over
/// them; where a coarse fiber has as many parts as the one that it goes on in, there are none. Returns the fiber that each goes on in.
std::vector<std::size_t> close(std::vector<FinerFiber>& fibers, const Vec3& period) {
  std::vector<Vec3> starts, ends;
  for (const FinerFiber& fiber : fibers) {
    starts.push_back(fiber.points.front());
    ends.push_back(fiber.points.back());
  }
  std::vector<std::size_t> next = fibers_that_go_on(starts, ends, period);
  std::vector<Vec3> before(fibers.size()), after(fibers.size());  // gap at each fiber's start and end
  for (std::size_t f = 0; f < fibers.size(); ++f) before[next[f]] = after[f] = starts[next[f]] + period - ends[f];
  for (std::size_t f = 0; f < fibers.size(); ++f) {
    std::vector<Vec3>& points = fibers[f].points;
    const auto last = static_cast<double>(points.size() - 1);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double share = static_cast<double>(k) / last;
      points[k] += 0.5 * (share * after[f] - (1 - share) * before[f]);
    }
  }
  return next;
}

}  // namespace

std::pair<Cell, std::vector<Vec3>> refine(const Cell& coarse, const Eigen::VectorXd& q, int fibers, double element_length) {
  const Unknowns unknowns(coarse);
  if (q.size() != unknowns.size) throw std::invalid_argument("refine: the state has the wrong size");
  Cell cell;
  cell.length_x = coarse.length_x_at(q);
  cell.length_y = coarse.length_y_at(q);
  cell.load_x = coarse.load_x;
  cell.load_y = coarse.load_y;
  cell.pressure = coarse.pressure;
  cell.slack_strain = coarse.slack_strain;
  // Strain of each bar of the coarse fibers, which the finer ones take over; slack ones are taut in them.
  const std::vector<double> tension = bar_tensions(coarse, unknowns, q);
  std::vector<double> coarse_strain(coarse.nodes()), strain;
  for (std::uint32_t i = 0; i < coarse.nodes(); ++i) {
    coarse_strain[i] = strain_under(coarse.type_of(coarse.fiber_of[i]), std::max(tension[i], 0.0), coarse.slack_strain);
  }
  std::map<std::pair<std::uint16_t, int>, std::uint16_t> type_of;  // by coarse type and fibers of the coarse yarn
  std::vector<std::uint32_t> next;
  std::vector<Vec3> x;
  for (const FibersOfYarn& yarn : yarns_of(coarse)) {
    const std::vector<int> parts = share_out(coarse, q, yarn, fibers);
    const double share = static_cast<double>(yarn.count()) / fibers;
    const auto [type, is_new] = type_of.try_emplace({coarse.type[yarn.begin], yarn.count()}, static_cast<std::uint16_t>(cell.types.size()));
    if (is_new) {
      FiberType finer = coarse.types[coarse.type[yarn.begin]];
      finer.radius *= std::sqrt(share);
      finer.area *= share;
      finer.bending_stiffness *= share;
      cell.types.push_back(finer);
    }
    const double radius = coarse.types[coarse.type[yarn.begin]].radius, finer_radius = cell.types[type->second].radius;
    const double spacing = element_length * 2 * finer_radius;
    std::vector<FinerFiber> finer;
    std::vector<std::uint32_t> coarse_fiber;
    for (std::uint32_t f = yarn.begin; f < yarn.end; ++f) {
      const int n = parts[f - yarn.begin];
      for (int j = 0; j < n; ++j) {
        finer.push_back(beside(coarse, q, f, coarse_strain, place_of(j, n, radius, finer_radius), spacing));
        coarse_fiber.push_back(f);
      }
    }
    const auto first = static_cast<std::uint32_t>(cell.fibers());
    for (const std::size_t f : close(finer, coarse.period(yarn.begin, q))) next.push_back(first + static_cast<std::uint32_t>(f));
    for (std::size_t i = 0; i < finer.size(); ++i) {
      const std::uint32_t f = coarse_fiber[i];
      CellFiber fiber;
      fiber.x.assign(finer[i].points.begin(), finer[i].points.end() - 1);
      fiber.rest_length.assign(fiber.x.size(), finer[i].length / static_cast<double>(fiber.x.size()));  // until the axes are laid
      fiber.weft = coarse.weft[f] != 0;
      fiber.type = type->second;
      fiber.yarn = coarse.yarn[f];
      fiber.place = static_cast<int>(i);
      fiber.tension = coarse.tension[f] * share;
      add_fiber(cell, fiber, x);
      strain.insert(strain.end(), finer[i].strain.begin(), finer[i].strain.end());
    }
  }
  finish_types(cell);
  close_fibers(cell, next);
  x = lay_axes(cell, x, strain);
  return {std::move(cell), std::move(x)};
}

RefinementCheck check_refinement(const Cell& coarse, const Eigen::VectorXd& q, const Cell& fine, const Eigen::VectorXd& q_fine) {
  RefinementCheck check;
  const std::vector<FibersOfYarn> before = yarns_of(coarse), after = yarns_of(fine);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double ratio = solid_section(fine, q_fine, after.at(i)) / solid_section(coarse, q, before[i]);
    if (std::abs(ratio - 1) > std::abs(check.area_ratio - 1)) check.area_ratio = ratio;
  }
  check.order_violations = order_violations(crossing_order(coarse, q), crossing_order(fine, q_fine));
  return check;
}

std::string RefinementCheck::blocked_by(double overlap_at_rest) const {
  if (order_violations > 0) return fmt::format("refinement: crossings that are not as they were: {}", order_violations);
  if (std::abs(area_ratio - 1) > area_tolerance)
    return fmt::format("refinement: a yarn's section has {:.4f} times the area of its coarse fibers", area_ratio);
  if (overlap_before_newton > std::max(overlap_allowed, overlap_margin * overlap_at_rest))
    return fmt::format("refinement: fibers overlapped by {:.3f} diameters before Newton's method", overlap_before_newton);
  return "";
}

}  // namespace relax
