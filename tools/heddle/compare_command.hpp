#pragma once
#include <filesystem>
#include <vector>

namespace heddle {

struct CompareOptions {
  std::vector<std::filesystem::path> results;  ///< folders of `heddle relax`
  std::filesystem::path woven;                 ///< folder or file of the woven cell that they started from; empty: none
  std::filesystem::path output;                ///< default ./results/comparison
};

/// Compares relaxed states of one cell with one another and with the woven one: prints a table, writes summary.json and pictures of the
/// sections over one another. Returns the exit status, 0. Throws std::runtime_error naming the file that is no relaxed or woven cell, or is
/// of another fabric or another cell than the first, and std::invalid_argument for fewer than two states.
int compare_command(const CompareOptions& options);

}  // namespace heddle
