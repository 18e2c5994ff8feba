#include "heddle/stop_signal.hpp"

#include <gtest/gtest.h>

#include <csignal>

namespace {

int asked = 0;

void count(int) {
  ++asked;
}

TEST(StopSignal, AsksWhileInScopeAndGivesTheSignalsBack) {
  const auto before = std::signal(SIGTERM, count);
  {
    const heddle::StopSignal stop;
    EXPECT_FALSE(heddle::StopSignal::wanted());
    std::raise(SIGTERM);
    EXPECT_TRUE(heddle::StopSignal::wanted());
    EXPECT_EQ(asked, 0);
  }
  std::raise(SIGTERM);
  EXPECT_EQ(asked, 1);
  {
    const heddle::StopSignal stop;  // of another stage: nobody has asked it
    EXPECT_FALSE(heddle::StopSignal::wanted());
  }
  std::signal(SIGTERM, before);
}

}  // namespace
