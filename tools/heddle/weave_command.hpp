#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

struct WeaveOptions {
  std::filesystem::path case_file;
  std::filesystem::path output;        ///< default ./results/NAME
  std::vector<std::string> overrides;  ///< key.path=value
  bool resume = false;
  int picks = -1;  ///< stop after so many; negative: all of the case
  bool quiet = false;
  int threads = 0;  ///< 0: all
};

/// Weaves a case, shows progress on standard error and writes the results folder. Returns the exit status: 0 completed or
/// stopped after the picks asked for, 1 failed, 130 interrupted (checkpoint written in either case).
int weave_command(const WeaveOptions& options);

struct CheckOptions {
  std::filesystem::path case_file;
  std::vector<std::string> overrides;
  std::filesystem::path draft;  ///< picture of the weave; empty: none
};

/// Says what would be run. Returns the exit status.
int check_command(const CheckOptions& options);

}  // namespace heddle
