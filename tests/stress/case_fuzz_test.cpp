#include "stress/case_fuzz.hpp"

#include <gtest/gtest.h>

namespace {

TEST(case_fuzz, mutated_cases_are_read_or_refused_by_name) {
  const stress::FuzzCount count = stress::fuzz_cases(HEDDLE_CASES_DIR, 1, 4000);
  for (const std::string& fault : count.faults) ADD_FAILURE() << fault;
  // The mutations are neither so mild that all are read nor so wild that none is.
  EXPECT_GT(count.accepted, 400);
  EXPECT_GT(count.rejected, 400);
}

}  // namespace
