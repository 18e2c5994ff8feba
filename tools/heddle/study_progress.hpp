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
  double cost = 0;    ///< estimated time on one thread [s]
  double memory = 0;  ///< estimated [bytes]
  double disk = 0;    ///< estimated [bytes]
};

/// Shows how far a study is: a line that is written over on a terminal, else a line at each change. Time left is from the estimates,
/// scaled by what the runs have taken so far.
class StudyProgress {
 public:
  StudyProgress(const std::vector<RunTask>& tasks, std::filesystem::path output, int jobs, bool quiet);
  ~StudyProgress();
  StudyProgress(const StudyProgress&) = delete;
  StudyProgress& operator=(const StudyProgress&) = delete;

  /// Writes the line again, once a second at most.
  void show();
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
};

/// "1:02:03" or "2:03".
std::string duration_text(double seconds);

}  // namespace heddle
