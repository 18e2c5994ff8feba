#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

#include "relax/minimize.hpp"
#include "relax/refine.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

/// Volume of the solid of a cell's fibers [m^3].
double fiber_volume(const relax::Cell& cell) {
  double volume = 0;
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) volume += cell.type_of(cell.fiber_of[i]).area * cell.rest_length[i];
  return volume;
}

double pull_of_yarns(const relax::Cell& cell) {
  return std::accumulate(cell.tension.begin(), cell.tension.end(), 0.0);
}

struct Refined {
  relax::Cell cell;
  Eigen::VectorXd q;
  Refined(const relax::Cell& coarse, const Eigen::VectorXd& start, int fibers) {
    std::vector<Vec3> x;
    std::tie(cell, x) = relax::refine(coarse, start, fibers, 2);
    q = relax::unknowns_at(cell, x);
  }
};

TEST(relax_refine, keeps_yarns_tensions_and_order) {
  const PosedCell coarse = plain_weave_cell({.fibers = 7, .pitch = 1e-3}, 0.5, 1.4);
  const Eigen::VectorXd start = coarse.unknowns();
  for (const int fibers : {7, 19, 37, 61, 127}) {
    SCOPED_TRACE(fibers);
    const Refined fine(coarse.cell, start, fibers);
    EXPECT_EQ(fine.cell.fibers() * 7, coarse.cell.fibers() * static_cast<std::size_t>(fibers));
    EXPECT_NEAR(fiber_volume(fine.cell) / fiber_volume(coarse.cell), 1, 0.01);
    EXPECT_NEAR(pull_of_yarns(fine.cell) / pull_of_yarns(coarse.cell), 1, 1e-12);
    EXPECT_EQ(relax::order_violations(relax::crossing_order(coarse.cell, start), relax::crossing_order(fine.cell, fine.q)), 0);
    const relax::RefinementCheck check = relax::check_refinement(coarse.cell, start, fine.cell, fine.q);
    EXPECT_NEAR(check.area_ratio, 1, 0.01);
    EXPECT_EQ(check.order_violations, 0);
    EXPECT_EQ(check.blocked_by(0), "");
  }
}

TEST(relax_refine, a_lost_area_a_turned_crossing_and_a_deep_overlap_are_named) {
  const PosedCell coarse = plain_weave_cell({.fibers = 7, .pitch = 1e-3}, 0.5, 1.4);
  const Eigen::VectorXd start = coarse.unknowns();
  Refined fine(coarse.cell, start, 19);
  for (relax::FiberType& type : fine.cell.types) type.area *= 0.98;
  const relax::RefinementCheck thin = relax::check_refinement(coarse.cell, start, fine.cell, fine.q);
  EXPECT_NEAR(thin.area_ratio, 0.98, 0.005);
  EXPECT_THAT(thin.blocked_by(0), testing::HasSubstr("area"));
  fine = Refined(coarse.cell, start, 19);
  for (std::uint32_t i = 0; i < fine.cell.first[19]; ++i) fine.q[3 * i + 2] += coarse.cell.length_x;  // the first warp over all wefts
  const relax::RefinementCheck turned = relax::check_refinement(coarse.cell, start, fine.cell, fine.q);
  EXPECT_EQ(turned.order_violations, 1);
  EXPECT_THAT(turned.blocked_by(0), testing::HasSubstr("crossings"));
  relax::RefinementCheck deep;
  deep.overlap_before_newton = 0.12;
  EXPECT_THAT(deep.blocked_by(0.05), testing::HasSubstr("0.120 diameters"));
  EXPECT_EQ(deep.blocked_by(0.115), "");  // they are pressed together
}

/// Pairs of a yarn's fibers nearer than `reach` [diameters] where a plane across the yarn's period cuts them.
std::set<std::pair<std::size_t, std::size_t>> neighbors(const relax::Cell& cell, const Eigen::VectorXd& q, int yarn, double share,
                                                        double reach) {
  std::vector<std::size_t> fibers;
  std::vector<Vec3> at;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    if (cell.yarn[f] != yarn) continue;
    const Eigen::Index axis = cell.axis_of(f);
    const double plane = share * cell.period(f, q)[axis];
    // The fiber's axis is monotonic along its period.
    const auto along = [&](double place) {
      const double wraps = std::floor(place / cell.nodes_of(f)), inside = place - wraps * cell.nodes_of(f);
      const auto span = std::min(static_cast<std::uint32_t>(inside), cell.nodes_of(f) - 1);
      return Vec3(relax::axis_point(cell, q, cell.first[f] + span, inside - span) + wraps * cell.period(f, q));
    };
    double low = -1.0 * cell.nodes_of(f), high = 2.0 * cell.nodes_of(f);
    for (int i = 0; i < 60; ++i) (along(0.5 * (low + high))[axis] < plane ? low : high) = 0.5 * (low + high);
    fibers.push_back(f);
    at.push_back(along(low));
  }
  const double diameter = 2 * cell.type_of(fibers.front()).radius;
  std::set<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t i = 0; i < at.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if ((at[i] - at[j]).norm() < reach * diameter) pairs.emplace(fibers[j], fibers[i]);
    }
  }
  return pairs;
}

TEST(relax_refine, fibers_keep_their_neighbors_along_the_yarn) {
  const PosedCell start = plain_weave_cell({.fibers = 7, .pitch = 1e-3}, 0.5, 1.4);
  relax::MinimizeOptions coarse_way;
  coarse_way.iterations_max = 0;
  const relax::MinimizeResult coarse = relax::minimize(start.cell, start.unknowns(), coarse_way);
  const Refined fine(start.cell, coarse.q, 37);
  constexpr int stations = 16;
  for (const int yarn : {0, 1, 2, 3}) {
    SCOPED_TRACE(yarn);
    const auto first = neighbors(fine.cell, fine.q, yarn, 0, 1.3);
    ASSERT_GT(first.size(), 37U);
    std::size_t kept = 0;
    for (int k = 1; k < stations; ++k) {
      const auto here = neighbors(fine.cell, fine.q, yarn, static_cast<double>(k) / stations, 2);
      kept += static_cast<std::size_t>(std::count_if(first.begin(), first.end(), [&](const auto& pair) { return here.contains(pair); }));
    }
    EXPECT_GT(static_cast<double>(kept), 0.95 * static_cast<double>(first.size() * (stations - 1)));
  }
}

TEST(relax_refine, closes_where_the_coarse_fibers_close) {
  // Two fibers of a yarn of three go on in one another: so do their parts, of which each has as many.
  PosedCell coarse = plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.5, 1.4);
  std::vector<std::uint32_t> next(coarse.cell.fibers());
  std::iota(next.begin(), next.end(), 0U);
  std::swap(next[0], next[1]);
  relax::close_fibers(coarse.cell, next);
  const Refined fine(coarse.cell, coarse.unknowns(), 7);
  std::vector<int> of_yarn(7);
  for (std::uint32_t f = 0; f < 7; ++f) of_yarn[f] = fine.cell.next[f] == f ? 0 : 1;
  EXPECT_EQ(std::accumulate(of_yarn.begin(), of_yarn.end(), 0), 4);
  EXPECT_THROW(relax::refine(coarse.cell, coarse.unknowns(), 2, 2), std::invalid_argument);
}

/// Longest bar over the mean one.
double longest_bar(const Refined& fine) {
  double longest = 0, sum = 0;
  for (const double length : fine.cell.rest_length) {
    longest = std::max(longest, length);
    sum += length;
  }
  return longest * static_cast<double>(fine.cell.nodes()) / sum;
}

TEST(relax_refine, a_number_that_a_loop_can_not_share_out_closes_all_the_same) {
  // Three fibers go on in one another, so that 9 can be shared out to them, but 7 can not: fibers nearest in the section go on in one
  // another and share the gap over the period.
  PosedCell coarse = plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.5, 1.4);
  std::vector<std::uint32_t> next(coarse.cell.fibers());
  std::iota(next.begin(), next.end(), 0U);
  std::rotate(next.begin(), next.begin() + 1, next.begin() + 3);
  relax::close_fibers(coarse.cell, next);
  const Eigen::VectorXd start = coarse.unknowns();
  const Refined fine(coarse.cell, start, 7), even(coarse.cell, start, 9);
  EXPECT_EQ(std::set<std::uint32_t>(fine.cell.next.begin(), fine.cell.next.begin() + 7).size(), 7U);
  EXPECT_LT(longest_bar(fine), 1.05 * longest_bar(even));
  const relax::RefinementCheck check = relax::check_refinement(coarse.cell, start, fine.cell, fine.q);
  EXPECT_EQ(check.blocked_by(0), "") << check.area_ratio;
}

TEST(relax_refine, is_brought_to_a_minimum) {
  const PosedCell coarse = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 1);
  const Refined fine(coarse.cell, coarse.unknowns(), 7);
  const relax::MinimizeResult r = relax::minimize(fine.cell, fine.q);
  EXPECT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
  EXPECT_LT(r.contacts.overlap_max, 0.2);
  EXPECT_EQ(relax::order_violations(relax::crossing_order(fine.cell, fine.q), relax::crossing_order(fine.cell, r.q)), 0);
}

}  // namespace
