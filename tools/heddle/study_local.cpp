#include "heddle/study_local.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <stdexcept>
#include <thread>

#include "heddle/study_cloths.hpp"
#include "heddle/study_record.hpp"
#include "weave/version.hpp"

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;
using std::filesystem::path;

volatile std::sig_atomic_t signals_seen = 0;

void count_signal(int) {
  signals_seen = signals_seen + 1;
}

double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

/// A file descriptor that this program alone holds.
int open_file(const path& file, int flags) {
  const int descriptor = open(file.c_str(), flags | O_CLOEXEC, 0644);
  if (descriptor < 0) throw std::runtime_error(fmt::format("{}: can not be opened: {}", file.string(), std::strerror(errno)));
  return descriptor;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> result;
  for (std::string& text : texts) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

/// This program's environment with the number of threads set.
std::vector<std::string> environment_with_threads(int threads) {
  std::vector<std::string> variables;
  for (char** variable = environ; *variable; ++variable) {
    const std::string text = *variable;
    if (text.rfind("OMP_NUM_THREADS=", 0) != 0 && text.rfind("OPENBLAS_NUM_THREADS=", 0) != 0) variables.push_back(text);
  }
  variables.push_back(fmt::format("OMP_NUM_THREADS={}", threads));
  variables.push_back(fmt::format("OPENBLAS_NUM_THREADS={}", threads));
  return variables;
}

struct Process {
  RunTask* task = nullptr;
  pid_t id = 0;
  Clock::time_point start;
};

/// Starts a process in a group of its own. It holds the lock, so that the folder is taken as long as it lives. Returns its id.
pid_t start_process(std::vector<std::string> command, int threads, int log, int lock) {
  std::vector<std::string> variables = environment_with_threads(threads);
  const std::vector<char*> arguments = pointers(command), environment = pointers(variables);
  const pid_t parent = getpid();
  const pid_t id = fork();
  if (id < 0) throw std::runtime_error(fmt::format("can not start a process: {}", std::strerror(errno)));
  if (id > 0) {
    setpgid(id, id);
    return id;
  }
  // Between fork and exec only calls that are safe in a signal handler.
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(130);
  const int nothing = open("/dev/null", O_RDONLY);
  if (nothing >= 0) dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  fcntl(lock, F_SETFD, 0);
  execve(arguments[0], arguments.data(), environment.data());
  constexpr char message[] = "the program can not be started\n";
  if (write(STDERR_FILENO, message, sizeof message - 1) < 0) _exit(126);
  _exit(127);
}

/// The processes under way; those left at the end are stopped.
class Processes {
 public:
  Processes() = default;
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;
  ~Processes() {
    signal(SIGTERM);
    for (const Process& p : list) waitpid(p.id, nullptr, 0);
  }

  void signal(int number) const {
    for (const Process& p : list) kill(-p.id, number);
  }

  std::vector<Process> list;
};

/// Takes the folder's lock; -1 if another process works in it. File systems without locks do without.
int lock_folder(const path& folder) {
  const int lock = open_file(folder / "run.lock", O_RDWR | O_CREAT);
  if (flock(lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return lock;
  close(lock);
  return -1;
}

/// Starts the task unless another process works in its folder.
bool start(const Study& study, RunTask& task, const LocalOptions& options, Processes& processes) {
  const path folder = run_folder(options.output, *task.run);
  std::filesystem::create_directories(folder);
  const int lock = lock_folder(folder);
  if (lock < 0) return false;
  std::vector<std::string> command = {options.program.string()};
  for (std::string& argument : run_arguments(study, *task.run, folder)) command.push_back(std::move(argument));
  task.record.state = RunState::running;
  task.record.message.clear();
  task.record.threads = options.threads;
  task.record.version = weave::version();
  ++task.record.attempts;
  write_record(study, *task.run, options.output, task.record);

  const int log = open_file(folder / "run.log", O_WRONLY | O_CREAT | O_APPEND);
  const std::string heading = attempt_heading(task.record.attempts, fmt::format("{}", fmt::join(command, " ")));
  if (write(log, heading.data(), heading.size()) != static_cast<ssize_t>(heading.size()))
    throw std::runtime_error(fmt::format("{}: can not be written: {}", (folder / "run.log").string(), std::strerror(errno)));
  processes.list.push_back({&task, start_process(std::move(command), options.threads, log, lock), Clock::now()});
  close(log);
  close(lock);
  return true;
}

bool tells_of_full_disk(const std::string& message) {
  constexpr std::array<int, 3> errors = {ENOSPC, EDQUOT, EFBIG};
  return std::any_of(errors.begin(), errors.end(), [&](int e) { return message.find(std::strerror(e)) != std::string::npos; });
}

/// Writes down how a process ended.
void finish(const Study& study, const Process& process, int wait_status, const path& output, StudyProgress& progress) {
  RunTask& task = *process.task;
  RunRecord& record = task.record;
  const double wall = seconds_since(process.start);
  record.status = WIFEXITED(wait_status) ? WEXITSTATUS(wait_status) : 128 + WTERMSIG(wait_status);
  record.state = state_of_status(record.status);
  record.wall += wall;
  const std::string cause =
      record.status > 128 ? fmt::format("ended by signal {}", record.status - 128) : fmt::format("exit status {}", record.status);
  if (record.state != RunState::finished) {
    constexpr std::size_t lines = 5;
    record.message = last_lines(run_folder(output, *task.run) / "run.log", lines);
    record.message += (record.message.empty() ? "" : "\n") + ("(" + cause + ")");
    if (record.status == 128 + SIGXFSZ || tells_of_full_disk(record.message))
      record.message += "\nThe disk, or the share of it that the run may use, is full: make room, and --retry repeats the run.";
  }
  write_record(study, *task.run, output, record);
  progress.ended(task, wall);
}

}  // namespace

void watch_stop_signals() {
  signals_seen = 0;
  struct sigaction action = {};
  action.sa_handler = count_signal;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int stop_signals() {
  return signals_seen;
}

RunState state_of_status(int status) {
  if (status == 0) return RunState::finished;
  const bool stopped = status == 130 || status == 128 + SIGTERM || status == 128 + SIGKILL || status == 128 + SIGHUP;
  return stopped ? RunState::interrupted : RunState::failed;
}

bool run_here(const Study& study, std::vector<RunTask>& tasks, const LocalOptions& options, StudyProgress& progress,
              const std::function<void()>& on_end) {
  std::deque<RunTask*> waiting;
  for (RunTask& task : tasks) {
    if (task.record.state != RunState::finished && task.record.state != RunState::failed) waiting.push_back(&task);
  }
  constexpr double patience = 30;  // for a process that an earlier study left behind to write its checkpoint [s]
  Processes processes;
  Clock::time_point stopped_at, busy_since = Clock::now();
  int seen = 0;
  while (!waiting.empty() || !processes.list.empty()) {
    if (const int now = stop_signals(); now > seen) {
      waiting.clear();
      processes.signal(seen == 0 ? SIGTERM : SIGKILL);
      if (seen == 0) {
        stopped_at = Clock::now();
        progress.say(fmt::format("stopping: {} runs write their checkpoints; once more kills them", processes.list.size()));
      }
      seen = now;
    }
    if (seen > 0 && seconds_since(stopped_at) > options.grace) processes.signal(SIGKILL);

    for (std::size_t tried = waiting.size(); tried > 0 && processes.list.size() < static_cast<std::size_t>(options.jobs); --tried) {
      RunTask* task = waiting.front();
      waiting.pop_front();
      const RunTask* twin = twin_of(*task, tasks);
      const auto is_twin = [&](const RunTask* other) { return other == twin; };
      if (twin && (std::any_of(waiting.begin(), waiting.end(), is_twin) ||
                   std::any_of(processes.list.begin(), processes.list.end(), [&](const Process& p) { return is_twin(p.task); }))) {
        waiting.push_back(task);
        continue;
      }
      if (twin) copy_weave(run_folder(options.output, *twin->run), run_folder(options.output, *task->run));
      if (start(study, *task, options, processes)) {
        busy_since = Clock::now();
      } else {
        waiting.push_back(task);
      }
    }
    if (processes.list.empty() && !waiting.empty() && seconds_since(busy_since) > patience)
      throw std::runtime_error(fmt::format("{}: another process works in this folder; end it first, or wait for it",
                                           run_folder(options.output, *waiting.front()->run).string()));

    for (std::size_t i = 0; i < processes.list.size();) {
      int wait_status = 0;
      const Process process = processes.list[i];
      if (waitpid(process.id, &wait_status, WNOHANG) != process.id) {
        ++i;
        continue;
      }
      processes.list.erase(processes.list.begin() + static_cast<std::ptrdiff_t>(i));
      busy_since = Clock::now();
      finish(study, process, wait_status, options.output, progress);
      on_end();
    }
    progress.show();
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return seen == 0;
}

}  // namespace heddle
