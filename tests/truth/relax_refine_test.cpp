#include <gmock/gmock.h>

#include <numeric>

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
  // Three in one loop would have to split into as many parts each.
  std::swap(next[1], next[2]);
  relax::close_fibers(coarse.cell, next);
  EXPECT_THROW(relax::refine(coarse.cell, coarse.unknowns(), 7, 2), std::invalid_argument);
  EXPECT_THROW(relax::refine(coarse.cell, coarse.unknowns(), 2, 2), std::invalid_argument);
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
