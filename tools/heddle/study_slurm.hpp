#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "heddle/study.hpp"
#include "heddle/study_progress.hpp"

namespace heddle {

struct SlurmOptions {
  std::filesystem::path output;
  std::filesystem::path program;      ///< called on the nodes as `program study FILE --only NAME ...`
  std::filesystem::path run_program;  ///< passed on to it where it is not the program itself; empty: it is
  int jobs = 0;                       ///< tasks at a time; 0: as many as the cluster gives
  int threads = 1;                    ///< of each
  std::vector<std::string> sbatch;    ///< further options of sbatch, e.g. "--partition=long"
  double poll = 10;                   ///< between two questions to squeue [s]
  int submissions = 10;               ///< of a run that does not get farther, at most
};

/// Throws std::runtime_error naming the command of Slurm that this machine lacks.
void require_slurm();

/// Script of a job array with one task for each of the runs.
std::string array_script(const Study& study, const std::vector<const RunTask*>& tasks, const SlurmOptions& options);

/// Runs the waiting and interrupted tasks as a job array and follows it: reads the records that the tasks write, asks squeue which are
/// alive, and submits again those that were preempted, timed out or lost, which go on from their checkpoints. What was submitted stands in
/// OUTPUT/slurm/jobs.json, so that the same command later follows the same jobs. Returns false if it was stopped by a signal: the jobs go
/// on. Throws std::runtime_error with sbatch's message where it refuses.
bool run_on_slurm(const Study& study, std::vector<RunTask>& tasks, const SlurmOptions& options, StudyProgress& progress,
                  const std::function<void()>& on_end);

}  // namespace heddle
