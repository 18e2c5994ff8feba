#pragma once
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "heddle/study.hpp"
#include "heddle/study_record.hpp"

namespace heddle {

/// One run on its way through a study.
struct RunTask {
  const StudyRun* run = nullptr;
  RunRecord record;
  double cost = 0;         ///< estimated time on one thread [s]
  double memory = 0;       ///< estimated [bytes]
  double disk = 0;         ///< estimated [bytes]
  std::string cloth = {};  ///< resolved case: what is woven
  [[nodiscard]] bool is_over() const { return record.state == RunState::finished || record.state == RunState::failed; }
};

/// Shows how far a study is on standard error: a line when a run has ended, and on a terminal one that is written over. Time left is from
/// the estimates, scaled by what the runs have taken so far.
class StudyProgress {
 public:
  StudyProgress(const std::vector<RunTask>& tasks, std::filesystem::path output, int jobs, bool quiet);
  ~StudyProgress();
  StudyProgress(const StudyProgress&) = delete;
  StudyProgress& operator=(const StudyProgress&) = delete;

  /// Writes the line again, once a second at most.
  void show();
  /// Says how a run ended, after how long in this attempt [s], and how far the study is.
  void ended(const RunTask& task, double wall);
  /// A line that stays.
  void say(const std::string& text);

 private:
  const std::vector<RunTask>& tasks_;
  std::filesystem::path output_;
  int jobs_;
  bool quiet_, terminal_;
  double done_at_start_ = 0;  ///< cost
  std::chrono::steady_clock::time_point start_, shown_;

  [[nodiscard]] double done_of(const RunTask& task) const;
  [[nodiscard]] std::string left() const;  ///< "about 1:02 left"
};

/// "1:02:03" or "2:03".
std::string duration_text(double seconds);

}  // namespace heddle
