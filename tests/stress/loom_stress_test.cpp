#include <gtest/gtest.h>

#include "stress/loom_sweeps.hpp"

namespace {

class loom_stress : public testing::TestWithParam<std::size_t> {};

TEST_P(loom_stress, weaves_or_says_where_it_stops) {
  const stress::Sweep sweep = stress::loom_sweeps(stress::Extent::brief)[GetParam()];
  for (const double value : sweep.values) {
    const stress::Outcome outcome = sweep.run(value);
    EXPECT_EQ(stress::fault(outcome, sweep.ledger_limit), "")
        << sweep.quantity << " " << value << " " << sweep.unit << " " << outcome.message;
  }
}

INSTANTIATE_TEST_SUITE_P(sweeps, loom_stress, testing::Range(std::size_t{0}, stress::loom_sweeps(stress::Extent::brief).size()));

TEST(long_weave, nothing_drifts_in_sixty_picks) {
  const stress::LongWeave weave = stress::weave_long(60, stress::single_fibers);
  EXPECT_TRUE(weave.outcome.completed) << weave.outcome.message;
  EXPECT_EQ(weave.outcome.late_searches, 0);
  EXPECT_EQ(weave.outcome.wrong_order, 0);
  EXPECT_EQ(stress::drift(weave), "");
}

}  // namespace
