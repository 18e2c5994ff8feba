#include "heddle/study_slurm.hpp"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "heddle/json_file.hpp"
#include "heddle/study_local.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;
using std::filesystem::path;

/// A word of a shell command.
std::string quoted(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

struct Answer {
  int status = 0;
  std::string text;  ///< standard output and error
};

Answer ask(const std::string& command) {
  FILE* pipe = popen((command + " 2>&1").c_str(), "r");
  if (!pipe) throw std::runtime_error("can not start " + command);
  Answer answer;
  for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) answer.text += static_cast<char>(c);
  const int status = pclose(pipe);
  answer.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  return answer;
}

/// The job that sbatch --parsable names, "JOB" or "JOB;CLUSTER" in a line of its own: sites print notices beside it. Empty: none.
std::string job_in(const std::string& text) {
  std::istringstream lines(text);
  std::string job;
  for (std::string line; std::getline(lines, line);) {
    const std::string number = line.substr(0, line.find(';'));
    if (!number.empty() && number.find_first_not_of("0123456789") == std::string::npos) job = number;
  }
  return job;
}

bool is_command(const std::string& name) {
  std::istringstream folders(std::getenv("PATH") ? std::getenv("PATH") : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((path(folder) / name).c_str(), X_OK) == 0) return true;
  }
  return false;
}

/// A job array: task i is the run of that name.
struct Array {
  std::string job;
  std::vector<std::string> runs;
};

std::vector<Array> read_arrays(const path& file) {
  std::vector<Array> arrays;
  const ordered_json j = read_json(file);
  if (!j.is_array()) return arrays;
  for (const auto& a : j) arrays.push_back({a.value("job", ""), a.value("runs", std::vector<std::string>())});
  return arrays;
}

void write_arrays(const path& file, const std::vector<Array>& arrays) {
  ordered_json j = ordered_json::array();
  for (const Array& a : arrays) j.push_back({{"job", a.job}, {"runs", a.runs}});
  weave::write_text_file(file, j.dump(2) + "\n");
}

/// Runs of the arrays that are waiting or running; none where squeue does not answer, so that nothing is submitted twice.
std::optional<std::set<std::string>> alive(const std::vector<Array>& arrays) {
  std::set<std::string> names;
  for (const Array& array : arrays) {
    const Answer answer = ask(fmt::format("squeue --noheader --array --jobs={} --format='%K %T'", quoted(array.job)));
    if (answer.status != 0) {
      if (answer.text.find("Invalid job id") != std::string::npos) continue;  // long over
      return {};
    }
    std::istringstream lines(answer.text);
    std::string index, state;
    while (lines >> index >> state) {
      const auto i = static_cast<std::size_t>(std::atoi(index.c_str()));
      if (i < array.runs.size()) names.insert(array.runs[i]);
    }
  }
  return names;
}

/// Why Slurm ended a task, where its accounting tells; else empty.
std::string cause_of_end(const std::vector<Array>& arrays, const std::string& run) {
  for (auto array = arrays.rbegin(); array != arrays.rend(); ++array) {
    const auto at = std::find(array->runs.begin(), array->runs.end(), run);
    if (at == array->runs.end() || !is_command("sacct")) continue;
    const Answer answer =
        ask(fmt::format("sacct --noheader --allocations --jobs={}_{} --format=State%30", array->job, at - array->runs.begin()));
    std::istringstream words(answer.text);
    std::string state;
    return answer.status == 0 && words >> state ? state : "";
  }
  return "";
}

class Cluster {
 public:
  Cluster(const Study& study, std::vector<RunTask>& tasks, const SlurmOptions& options, StudyProgress& progress)
      : study_(study),
        tasks_(tasks),
        options_(options),
        progress_(progress),
        folder_(options.output / "slurm"),
        arrays_(read_arrays(folder_ / "jobs.json")) {
    std::filesystem::create_directories(folder_);
  }

  /// One look at records and queue; false when all runs are over.
  bool step(const std::function<void()>& on_end) {
    const auto living = alive(arrays_);
    // The records are read after the queue: a task that is no longer in the queue has written its last.
    std::vector<RunTask*> lost;
    bool open = false;
    for (RunTask& task : tasks_) {
      if (task.is_over()) continue;
      const RunRecord now = read_record(study_, *task.run, options_.output);
      if (now.attempts > 0 && (now.state == RunState::finished || (now.state == RunState::failed && now.attempts > task.record.attempts))) {
        task.record = now;
        progress_.ended(task, now.wall);
        on_end();
        continue;
      }
      open = true;
      if (!living || living->contains(task.run->name)) {
        task.record.state = now.state == RunState::running ? RunState::running : RunState::waiting;
        missing_[task.run->name] = 0;
      } else if (++missing_[task.run->name] > patience || submissions_[task.run->name] == 0) {
        lost.push_back(&task);
      }
    }
    if (!lost.empty()) submit(lost, on_end);
    return open;
  }

  [[nodiscard]] std::string jobs() const {
    std::string text;
    for (const Array& a : arrays_) text += (text.empty() ? "" : " ") + a.job;
    return text;
  }

 private:
  static constexpr int patience = 1;  // questions without an answer before a task counts as lost: files may come late over a network

  const Study& study_;
  std::vector<RunTask>& tasks_;
  const SlurmOptions& options_;
  StudyProgress& progress_;
  path folder_;
  std::vector<Array> arrays_;
  std::map<std::string, int> missing_, submissions_;

  void submit(const std::vector<RunTask*>& lost, const std::function<void()>& on_end) {
    std::vector<const RunTask*> again;
    Array array;
    for (RunTask* task : lost) {
      int& count = submissions_[task->run->name];
      const std::string cause = count > 0 ? cause_of_end(arrays_, task->run->name) : "";
      if (count >= options_.submissions || cause == "OUT_OF_MEMORY") {
        task->record.state = RunState::failed;
        task->record.message =
            fmt::format("Slurm ended it {} times{}; see {}", count, cause.empty() ? "" : ", at last with " + cause, folder_.string());
        progress_.say(fmt::format("{} failed: {}", task->run->name, task->record.message));
        on_end();
        continue;
      }
      if (count > 0)
        progress_.say(fmt::format("{} was stopped{}, submitted again", task->run->name, cause.empty() ? "" : " (" + cause + ")"));
      ++count;
      missing_[task->run->name] = 0;
      task->record.state = RunState::waiting;
      again.push_back(task);
      array.runs.push_back(task->run->name);
    }
    if (again.empty()) return;
    const path script = folder_ / fmt::format("array_{}.sh", arrays_.size());
    weave::write_text_file(script, array_script(study_, again, options_));
    const Answer answer = ask("sbatch --parsable " + quoted(script.string()));
    if (answer.status != 0) throw std::runtime_error("sbatch refuses the job array " + script.string() + ": " + answer.text);
    array.job = job_in(answer.text);
    if (array.job.empty()) throw std::runtime_error("sbatch names no job for " + script.string() + ": " + answer.text);
    arrays_.push_back(std::move(array));
    write_arrays(folder_ / "jobs.json", arrays_);
    progress_.say(fmt::format("submitted {} runs as job {}", again.size(), arrays_.back().job));
  }
};

}  // namespace

void require_slurm() {
  for (const std::string name : {"sbatch", "squeue"}) {
    if (!is_command(name))
      throw std::runtime_error(fmt::format("--engine slurm: there is no {} on this machine; Slurm's commands must be in PATH", name));
  }
}

std::string array_script(const Study& study, const std::vector<const RunTask*>& tasks, const SlurmOptions& options) {
  double memory = 0;
  std::string names;
  for (const RunTask* task : tasks) {
    memory = std::max(memory, task->memory);
    names += (names.empty() ? "" : " ") + quoted(task->run->name);
  }
  const path output = std::filesystem::absolute(options.output);
  // The estimate is of weaving; later stages and the system's buffers get as much again.
  const auto megabytes = static_cast<long>(std::ceil(2e-6 * memory + 500));
  std::string text = "#!/bin/bash\n";
  const auto directive = [&](const std::string& option) { text += "#SBATCH " + option + "\n"; };
  directive("--job-name=heddle_" + study.name);
  directive(fmt::format("--array=0-{}{}", tasks.size() - 1, options.jobs > 0 ? fmt::format("%{}", options.jobs) : ""));
  directive(fmt::format("--cpus-per-task={}", options.threads));
  directive(fmt::format("--mem={}M", megabytes));
  directive("--requeue");
  directive("--open-mode=append");
  directive("--signal=B:TERM@120");
  directive("--chdir=" + quoted(std::filesystem::current_path().string()));
  directive("--output=" + quoted((output / "slurm" / "task_%A_%a.log").string()));
  for (const std::string& option : options.sbatch) directive(option);
  text += "# In the place of the shell the program gets the signal before the time limit, and its run writes a checkpoint.\n";
  text += fmt::format("runs=({})\n", names);
  text += fmt::format("exec {} study {} --output {} --only \"${{runs[$SLURM_ARRAY_TASK_ID]}}\" --jobs 1 --threads {} --quiet",
                      quoted(options.program.string()), quoted(std::filesystem::absolute(study.file).string()), quoted(output.string()),
                      options.threads);
  if (!options.run_program.empty()) text += " --program " + quoted(options.run_program.string());
  return text + "\n";
}

bool run_on_slurm(const Study& study, std::vector<RunTask>& tasks, const SlurmOptions& options, StudyProgress& progress,
                  const std::function<void()>& on_end) {
  Cluster cluster(study, tasks, options, progress);
  while (cluster.step(on_end)) {
    const auto next = std::chrono::steady_clock::now() + std::chrono::duration<double>(options.poll);
    while (std::chrono::steady_clock::now() < next) {
      if (stop_signals() > 0) {
        progress.say(fmt::format("the jobs go on: the same command follows them again, scancel {} ends them", cluster.jobs()));
        return false;
      }
      progress.show();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }
  return true;
}

}  // namespace heddle
