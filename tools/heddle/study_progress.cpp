#include "heddle/study_progress.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

}  // namespace

std::string duration_text(double seconds) {
  const auto s = static_cast<long>(seconds);
  if (s < 3600) return fmt::format("{}:{:02}", s / 60, s % 60);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

StudyProgress::StudyProgress(const std::vector<RunTask>& tasks, std::filesystem::path output, int jobs, bool quiet)
    : tasks_(tasks), output_(std::move(output)), jobs_(jobs), quiet_(quiet), terminal_(isatty(STDERR_FILENO) == 1), start_(Clock::now()) {
  for (const RunTask& task : tasks_) done_at_start_ += done_of(task);
}

StudyProgress::~StudyProgress() {
  if (!quiet_ && terminal_) fmt::print(stderr, "\r\033[K");
}

/// A woven pick leaves a file behind it.
double StudyProgress::done_of(const RunTask& task) const {
  if (task.is_over()) return task.cost;
  std::error_code none;
  double picks = 0;
  for (const auto& entry : std::filesystem::directory_iterator(run_folder(output_, *task.run) / "weave" / "picks", none))
    picks += entry.path().extension() == ".vtkhdf";
  const weave::Case& c = task.run->spec;
  return task.cost * std::min(0.99, picks / (c.cells * c.picks_per_cell()));
}

std::string StudyProgress::left() const {
  double total = 0, done = 0;
  for (const RunTask& task : tasks_) {
    total += task.cost;
    done += done_of(task);
  }
  // Before anything is done here, the estimate itself, for threads that all help.
  const double gone = seconds_since(start_), here = done - done_at_start_;
  return fmt::format("about {} left", duration_text(here > 0 ? gone * (total - done) / here : (total - done) / std::max(1, jobs_)));
}

void StudyProgress::show() {
  if (quiet_ || !terminal_ || (shown_ != Clock::time_point() && seconds_since(shown_) < 1)) return;
  shown_ = Clock::now();
  int over = 0, failed = 0;
  std::string running;
  for (const RunTask& task : tasks_) {
    over += task.is_over();
    failed += task.record.state == RunState::failed;
    if (task.record.state == RunState::running) running += (running.empty() ? "" : ", ") + task.run->name;
  }
  constexpr std::size_t longest = 50;
  if (running.size() > longest) running = running.substr(0, longest) + "...";
  fmt::print(stderr, "\r\033[K{} of {} runs{}, {} gone, {}: {}", over, tasks_.size(), failed > 0 ? fmt::format(" ({} failed)", failed) : "",
             duration_text(seconds_since(start_)), left(), running);
  std::fflush(stderr);
}

void StudyProgress::ended(const RunTask& task, double wall) {
  const auto over = std::ranges::count_if(tasks_, &RunTask::is_over);
  const bool failed = task.record.state == RunState::failed;
  say(fmt::format("{} {} after {}; {} of {} done{}{}", task.run->name, name_of(task.record.state), duration_text(wall), over, tasks_.size(),
                  over < static_cast<std::ptrdiff_t>(tasks_.size()) ? ", " + left() : "", failed ? ":\n" + task.record.message : ""));
}

void StudyProgress::say(const std::string& text) {
  if (quiet_) return;
  fmt::print(stderr, "{}{}\n", terminal_ ? "\r\033[K" : "", text);
  shown_ = {};
}

}  // namespace heddle
