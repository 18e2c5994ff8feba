#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "heddle/study.hpp"

namespace heddle {

enum class RunState {
  waiting,  ///< never run, or with other values
  running,  ///< started by a process that has not written its end
  finished,
  failed,       ///< ended with a message
  interrupted,  ///< stopped by a signal; goes on from its checkpoint
};

const char* name_of(RunState state);

/// What is known about a run: the content of its run.json.
struct RunRecord {
  RunState state = RunState::waiting;
  int status = 0;            ///< exit status; 128 + signal where a signal ended it
  std::string message = {};  ///< why it failed: its last lines
  double wall = 0;           ///< of all attempts [s]
  int attempts = 0;
  int threads = 0;           ///< of the last attempt
  std::string version = {};  ///< of the program, last attempt
};

/// OUTPUT/runs/NAME.
std::filesystem::path run_folder(const std::filesystem::path& output, const StudyRun& run);

/// What the run computes: resolved case, stages, options. A run whose inputs have changed is run again.
nlohmann::ordered_json run_inputs(const Study& study, const StudyRun& run);

/// The record in the run's folder; a waiting one where there is none, or one of other inputs.
RunRecord read_record(const Study& study, const StudyRun& run, const std::filesystem::path& output);

/// Writes run.json aside and renames. Throws std::runtime_error naming the file.
void write_record(const Study& study, const StudyRun& run, const std::filesystem::path& output, const RunRecord& record);

/// The last lines of a run's log that its last attempt wrote; empty where it wrote none.
std::string last_lines(const std::filesystem::path& log, std::size_t count);

/// Starts an attempt in a run's log.
std::string attempt_heading(int attempt, const std::string& command);

/// A figure from the summary of its stage: number, boolean or text; null where the run has none of that name.
nlohmann::json figure_of(const StudyRun& run, const std::filesystem::path& output, const std::string& key);

}  // namespace heddle
