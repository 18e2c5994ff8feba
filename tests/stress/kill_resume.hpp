#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stress {

struct KillCount {
  int kills = 0;      ///< of a running process
  int resumed = 0;    ///< processes that went on from a checkpoint
  int completed = 0;  ///< weaves that came to their end between kills
  int files = 0;      ///< result files and checkpoints that were read after a kill
  std::vector<std::string> faults;
};

/// Weaves the smallest plain weave with the program `heddle`, killed `kills` times at random moments, in a folder of its own, which is
/// emptied before and removed after. After each kill every result file and the checkpoint must be readable; then the weave goes on with
/// --resume, or from its start if there is no checkpoint yet. Each weave that comes to its end must have the bits of one that was not
/// disturbed. Throws std::runtime_error if the program can not be run.
KillCount kill_and_resume(const std::filesystem::path& program, const std::filesystem::path& folder, std::uint64_t seed, int kills);

/// The same of `heddle study` with three such weaves: each second time the runs are killed with it. A study that comes to its end must have
/// the figures and the results files of one that was not disturbed. `files` is not counted.
KillCount kill_and_resume_study(const std::filesystem::path& program, const std::filesystem::path& folder, std::uint64_t seed, int kills);

}  // namespace stress
