#include "stress/kill_resume.hpp"

#include <gtest/gtest.h>

#include "scenes/temporary.hpp"

namespace {

TEST(kill_resume, a_killed_weave_goes_on_to_the_same_bits) {
  const auto folder = scenes::temporary("kill_resume");
  const stress::KillCount count = stress::kill_and_resume(HEDDLE_PROGRAM, folder, 1, 5);
  for (const std::string& fault : count.faults) ADD_FAILURE() << fault;
  EXPECT_EQ(count.kills, 5);
  EXPECT_GT(count.resumed, 0);
  EXPECT_GT(count.completed, 0);
  EXPECT_GT(count.files, 0);
}

TEST(kill_resume, a_killed_study_goes_on_to_the_same_bits) {
  const auto folder = scenes::temporary("kill_resume_study");
  const stress::KillCount count = stress::kill_and_resume_study(HEDDLE_PROGRAM, folder, 1, 4);
  for (const std::string& fault : count.faults) ADD_FAILURE() << fault;
  EXPECT_EQ(count.kills, 4);
  EXPECT_GT(count.resumed, 0);
  EXPECT_GT(count.completed, 0);
}

}  // namespace
