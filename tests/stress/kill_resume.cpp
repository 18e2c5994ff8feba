#include "stress/kill_resume.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <chrono>
#include <csignal>
#include <random>
#include <stdexcept>
#include <thread>

#include "stress/loom_sweeps.hpp"
#include "weave/checkpoint.hpp"
#include "weave/results.hpp"

extern char** environ;

namespace stress {
namespace {

using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

class Weave {
 public:
  /// Starts `heddle weave`; what it prints goes into FOLDER.log.
  Weave(const fs::path& program, const fs::path& case_file, const fs::path& folder, bool resume) {
    std::vector<std::string> words = {program.string(), "weave",   case_file.string(), "--output",
                                      folder.string(),  "--quiet", "--threads",        "1"};
    if (resume) words.emplace_back("--resume");
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    const std::string log = folder.string() + ".log";
    posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    const int error = posix_spawn(&process_, program.c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error(program.string() + ": can not be started");
  }

  /// Waits for its end, for at most `seconds`; kills it then. Returns its exit status, or -1 if it was killed.
  int wait_or_kill(double seconds) {
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    int status = 0;
    while (waitpid(process_, &status, WNOHANG) == 0) {
      if (Clock::now() >= end) {
        kill(process_, SIGKILL);
        waitpid(process_, &status, 0);
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = 0;
};

/// Reads all that is in a results folder. A file that was being written aside does not count.
void read_all(const fs::path& folder, KillCount& count) {
  if (!fs::exists(folder)) return;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    try {
      if (entry.path().extension() == ".vtkhdf") {
        weave::read_results(entry.path());
      } else if (entry.path().extension() == ".h5") {
        weave::read_checkpoint(entry.path());
      } else {
        continue;
      }
      ++count.files;
    } catch (const std::exception& error) {
      count.faults.push_back(fmt::format("after kill {}: {}", count.kills, error.what()));
    }
  }
}

/// What differs in two results files of a weave, beside times on the clock; empty if nothing does.
std::string difference(const fs::path& file_a, const fs::path& file_b) {
  const weave::ResultsFile a = weave::read_results(file_a), b = weave::read_results(file_b);
  const weave::Snapshot &s = a.snapshot, &t = b.snapshot;
  const weave::History &h = a.history, &k = b.history;
  if (s.time != t.time || s.pick != t.pick || s.offset != t.offset || s.x != t.x || s.tension != t.tension || s.arc != t.arc)
    return "the fibers";
  if (h.time_s != k.time_s || h.pick != k.pick || h.action != k.action || h.reed_load_N != k.reed_load_N || h.overlap != k.overlap ||
      h.kinetic_J != k.kinetic_J || h.slip_J != k.slip_J || h.residual_J != k.residual_J ||
      h.reed_load_per_beat_N != k.reed_load_per_beat_N) {
    return "the history";
  }
  return "";
}

/// Compares every results file of a finished weave with those of the undisturbed one.
void compare(const fs::path& folder, const fs::path& undisturbed, KillCount& count) {
  for (const auto& entry : fs::recursive_directory_iterator(undisturbed)) {
    if (entry.path().extension() != ".vtkhdf") continue;
    const fs::path place = fs::relative(entry.path(), undisturbed);
    if (!fs::exists(folder / place)) {
      count.faults.push_back(fmt::format("after kill {}: {} is missing", count.kills, place.string()));
    } else if (const std::string what = difference(entry.path(), folder / place); !what.empty()) {
      count.faults.push_back(fmt::format("after kill {}: {} differs in {}", count.kills, place.string(), what));
    }
  }
}

}  // namespace

KillCount kill_and_resume(const fs::path& program, const fs::path& folder, std::uint64_t seed, int kills) {
  constexpr double for_ever = 1e6;  // [s]
  const fs::path case_file = folder / "case.toml", undisturbed = folder / "undisturbed", killed = folder / "killed";
  fs::remove_all(folder);
  fs::create_directories(folder);
  std::vector<std::string> overrides = single_fibers;
  overrides.insert(overrides.end(), {"fabric.cells=2", "output.checkpoint_interval=\"10 ms\""});
  weave::write_text_file(case_file, weave::to_toml(plain_weave(overrides)));
  const auto start = Clock::now();
  if (Weave(program, case_file, undisturbed, false).wait_or_kill(for_ever) != 0) {
    throw std::runtime_error(fmt::format("{}: the undisturbed weave failed; see {}.log", program.string(), undisturbed.string()));
  }
  const double whole = std::chrono::duration<double>(Clock::now() - start).count();

  std::mt19937_64 random(seed);
  KillCount count;
  const auto run = [&](double seconds) {
    const bool resume = fs::exists(killed / "checkpoint.h5");
    count.resumed += resume;
    const int status = Weave(program, case_file, killed, resume).wait_or_kill(seconds);
    if (status < 0) {
      ++count.kills;
      read_all(killed, count);
      return;
    }
    if (status == 0) {
      ++count.completed;
      compare(killed, undisturbed, count);
    } else {
      count.faults.push_back(fmt::format("after kill {}: the weave ended with status {}", count.kills, status));
    }
    fs::remove_all(killed);
  };
  while (count.kills < kills) run(whole * (static_cast<double>(random() >> 11) * 0x1p-53));
  if (fs::exists(killed)) run(for_ever);
  fs::remove_all(folder);
  return count;
}

}  // namespace stress
