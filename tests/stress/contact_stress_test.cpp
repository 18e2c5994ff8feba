#include <gtest/gtest.h>

#include "stress/contact_sweeps.hpp"

namespace {

class contact_stress : public testing::TestWithParam<std::size_t> {};

TEST_P(contact_stress, holds_or_says_where_it_stops) {
  const stress::Sweep sweep = stress::contact_sweeps(stress::Extent::brief)[GetParam()];
  for (const double value : sweep.values) {
    const stress::Outcome outcome = sweep.run(value);
    EXPECT_EQ(stress::fault(outcome, sweep.ledger_limit), "") << sweep.scene << ", " << sweep.quantity << " " << value << " " << sweep.unit;
  }
}

INSTANTIATE_TEST_SUITE_P(sweeps, contact_stress, testing::Range(std::size_t{0}, stress::contact_sweeps(stress::Extent::brief).size()));

}  // namespace
