#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace scenes {

/// A path for a test's files that no test of another process has, as when two builds are tested at the same time.
inline std::filesystem::path temporary(const std::string& name) {
  return std::filesystem::path(testing::TempDir()) / ("heddle_" + name + "_" + std::to_string(::getpid()));
}

}  // namespace scenes
