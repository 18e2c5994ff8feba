#pragma once
#include <filesystem>
#include <string>

#include "weave/engine.hpp"
#include "weave/history.hpp"

namespace weave {

/// Everything beside the case that a run needs to go on to the same bits.
struct Checkpoint {
  std::string case_toml;
  Model model;
  State state;
  History history;
  std::vector<double> loom_numbers;  ///< the run's own scalars, in its order
  std::vector<std::int64_t> loom_counters;
};

/// Writes aside and renames.
void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

/// Throws std::runtime_error naming file and cause.
Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace weave
