#pragma once
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "scenes/temporary.hpp"

/// A test with an empty folder of its own, which is gone when it ends.
class OwnFolder : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo& test = *testing::UnitTest::GetInstance()->current_test_info();
    folder = scenes::temporary(std::string(test.test_suite_name()) + "_" + test.name());
    std::filesystem::remove_all(folder);
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  std::filesystem::path folder;
};
