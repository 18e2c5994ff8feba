#include <gtest/gtest.h>

#include <filesystem>

#include "heddle/draft.hpp"
#include "scenes/temporary.hpp"
#include "stress/loom_sweeps.hpp"

namespace {

TEST(random_weave, is_read_drawn_and_woven) {
  const auto file = scenes::temporary("random_weave") += ".svg";
  int woven = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const std::string text = stress::random_weave(seed);
    SCOPED_TRACE(text);
    const weave::Case c = weave::parse_case(text, "random/case.toml", stress::single_fibers);
    std::filesystem::remove(file);
    heddle::draw_draft(c, file);
    EXPECT_TRUE(std::filesystem::exists(file));
    const stress::Outcome outcome = stress::weave_through(c);
    EXPECT_EQ(stress::fault(outcome, stress::ledger_limit), "") << outcome.message;
    woven += outcome.completed;
  }
  EXPECT_EQ(woven, 8);
  std::filesystem::remove(file);
}

}  // namespace
