#pragma once
#include <filesystem>
#include <functional>
#include <vector>

#include "heddle/study.hpp"
#include "heddle/study_progress.hpp"

namespace heddle {

struct LocalOptions {
  std::filesystem::path output;
  std::filesystem::path program;  ///< called as `program run CASE ...`
  int jobs = 1;                   ///< processes at a time
  int threads = 1;                ///< of each
  double grace = 60;              ///< from the signal to stop until a process is killed [s]
};

/// Runs the waiting and interrupted tasks in their order, each as a process with its folder, its record and its run.log; a failed one stops
/// no other. Of runs that weave the same cloth and differ in later stages, the first weaves it and the others take it over. `on_end` is
/// called when a run has ended. Once SIGINT or SIGTERM arrives (watch_stop_signals) the processes get SIGTERM, on which they write their
/// checkpoints; a second signal kills them. Returns false if it was stopped. A process is also told to stop when this one dies; while it
/// lives, no other starts in its folder. Throws std::runtime_error where a record or log can not be written; the processes are stopped
/// before.
bool run_here(const Study& study, std::vector<RunTask>& tasks, const LocalOptions& options, StudyProgress& progress,
              const std::function<void()>& on_end);

/// From now on SIGINT and SIGTERM are counted, from 0, instead of ending the program.
void watch_stop_signals();
int stop_signals();

/// The state that an exit status means: 0 finished; 130, or ended by a signal that others send (128 + its number), interrupted; else
/// failed.
RunState state_of_status(int status);

}  // namespace heddle
