#include "stress/kill_resume.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>
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

class Process {
 public:
  /// Starts a program with its arguments; what it prints goes into the log.
  Process(std::vector<std::string> words, const std::string& log) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 1, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    const int error = posix_spawn(&process_, words.front().c_str(), &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    if (error != 0) throw std::runtime_error(words.front() + ": can not be started");
  }

  /// Waits for its end, for at most `seconds`; kills it then, and its children where that is asked for. Returns its exit status, or -1 if
  /// it was killed.
  int wait_or_kill(double seconds, bool with_children = false) {
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    int status = 0;
    while (waitpid(process_, &status, WNOHANG) == 0) {
      if (Clock::now() >= end) {
        const std::vector<pid_t> others = with_children ? children() : std::vector<pid_t>();
        kill(process_, SIGKILL);
        for (const pid_t child : others) kill(child, SIGKILL);
        waitpid(process_, &status, 0);
        break;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = 0;

  [[nodiscard]] std::vector<pid_t> children() const {
    std::ifstream in(fmt::format("/proc/{0}/task/{0}/children", process_));
    return {std::istream_iterator<pid_t>(in), {}};
  }
};

/// `heddle weave` on one thread.
Process start_weave(const fs::path& program, const fs::path& case_file, const fs::path& folder, bool resume) {
  std::vector<std::string> words = {program.string(), "weave",   case_file.string(), "--output",
                                    folder.string(),  "--quiet", "--threads",        "1"};
  if (resume) words.emplace_back("--resume");
  return Process(std::move(words), folder.string() + ".log");
}

/// `heddle study`, two runs at a time of a thread each.
Process start_study(const fs::path& program, const fs::path& study, const fs::path& folder) {
  return Process({program.string(), "study", study.string(), "--output", folder.string(), "--quiet", "--jobs", "2", "--threads", "1"},
                 folder.string() + ".log");
}

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

constexpr double for_ever = 1e6;  // [s]

/// Writes the case that is woven in a second or so.
void write_case(const fs::path& file) {
  std::vector<std::string> overrides = single_fibers;
  overrides.insert(overrides.end(), {"fabric.cells=2", "output.checkpoint_interval=\"10 ms\""});
  weave::write_text_file(file, weave::to_toml(plain_weave(overrides)));
}

double share(std::mt19937_64& random) {
  return static_cast<double>(random() >> 11) * 0x1p-53;
}

/// A file's text without the last column of its table, which is time on the clock.
std::string table_of(const fs::path& csv) {
  std::ifstream in(csv);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  return std::regex_replace(text, std::regex(",[^,\n]*\n"), "\n");
}

}  // namespace

KillCount kill_and_resume(const fs::path& program, const fs::path& folder, std::uint64_t seed, int kills) {
  const fs::path case_file = folder / "case.toml", undisturbed = folder / "undisturbed", killed = folder / "killed";
  fs::remove_all(folder);
  fs::create_directories(folder);
  write_case(case_file);
  const auto start = Clock::now();
  if (start_weave(program, case_file, undisturbed, false).wait_or_kill(for_ever) != 0) {
    throw std::runtime_error(fmt::format("{}: the undisturbed weave failed; see {}.log", program.string(), undisturbed.string()));
  }
  const double whole = std::chrono::duration<double>(Clock::now() - start).count();

  std::mt19937_64 random(seed);
  KillCount count;
  const auto run = [&](double seconds) {
    const bool resume = fs::exists(killed / "checkpoint.h5");
    count.resumed += resume;
    const int status = start_weave(program, case_file, killed, resume).wait_or_kill(seconds);
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
  while (count.kills < kills) run(whole * share(random));
  if (fs::exists(killed)) run(for_ever);
  fs::remove_all(folder);
  return count;
}

KillCount kill_and_resume_study(const fs::path& program, const fs::path& folder, std::uint64_t seed, int kills) {
  const fs::path study = folder / "study.toml", undisturbed = folder / "undisturbed", killed = folder / "killed";
  fs::remove_all(folder);
  fs::create_directories(folder);
  write_case(folder / "case.toml");
  weave::write_text_file(study,
                         "name = \"killed\"\nquestion = \"Does it go on?\"\ncase = \"case.toml\"\n"
                         "collect = [\"weave.reed_load_max_N\", \"weave.thickness_mean_m\"]\n"
                         "[vary]\nloom.tension = [\"0.5 N\", \"1 N\", \"2 N\"]\n");
  const auto start = Clock::now();
  if (start_study(program, study, undisturbed).wait_or_kill(for_ever) != 0)
    throw std::runtime_error(fmt::format("{}: the undisturbed study failed; see {}.log", program.string(), undisturbed.string()));
  double whole = std::chrono::duration<double>(Clock::now() - start).count();

  std::mt19937_64 random(seed);
  KillCount count;
  const auto has_checkpoint = [&] {
    return fs::exists(killed / "runs") && std::any_of(fs::directory_iterator(killed / "runs"), fs::directory_iterator(),
                                                      [](const auto& run) { return fs::exists(run.path() / "weave" / "checkpoint.h5"); });
  };
  const auto run = [&](double seconds) {
    count.resumed += has_checkpoint();
    // A study that dies alone tells its runs to stop; the others die with it.
    const int status = start_study(program, study, killed).wait_or_kill(seconds, count.kills % 2 == 1);
    if (status < 0) {
      ++count.kills;
      if (!has_checkpoint()) whole *= 2;  // the machine has become slower: there must be something to go on from
      return;
    }
    ++count.completed;
    if (status != 0) count.faults.push_back(fmt::format("after kill {}: the study ended with status {}", count.kills, status));
    compare(killed, undisturbed, count);
    if (table_of(killed / "study.csv") != table_of(undisturbed / "study.csv"))
      count.faults.push_back(fmt::format("after kill {}: study.csv differs", count.kills));
    fs::remove_all(killed);
  };
  while (count.kills < kills) run(whole * share(random));
  if (fs::exists(killed)) run(for_ever);
  fs::remove_all(folder);
  return count;
}

}  // namespace stress
