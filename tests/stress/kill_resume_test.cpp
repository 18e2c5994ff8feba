#include "stress/kill_resume.hpp"

#include <gtest/gtest.h>

#include "stress/loom_sweeps.hpp"
#include "weave/results.hpp"

namespace {

TEST(kill_resume, a_killed_weave_goes_on_to_the_same_bits) {
  const auto folder = std::filesystem::path(testing::TempDir()) / "heddle_kill_resume";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  weave::write_text_file(
      folder / "case.toml",
      weave::to_toml(stress::plain_weave({stress::single_fibers, "fabric.cells=2", "output.checkpoint_interval=\"10 ms\""})));
  const stress::KillCount count = stress::kill_and_resume(HEDDLE_PROGRAM, folder / "case.toml", folder / "weaves", 1, 5);
  for (const std::string& fault : count.faults) ADD_FAILURE() << fault;
  EXPECT_EQ(count.kills, 5);
  EXPECT_GT(count.resumed, 0);
  EXPECT_GT(count.completed, 0);
  EXPECT_GT(count.files, 0);
  std::filesystem::remove_all(folder);
}

}  // namespace
