#include "heddle/study_command.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "heddle/json_file.hpp"
#include "heddle/study.hpp"
#include "heddle/study_cloths.hpp"
#include "heddle/study_local.hpp"
#include "heddle/study_progress.hpp"
#include "heddle/study_record.hpp"
#include "heddle/study_report.hpp"
#include "heddle/study_slurm.hpp"
#include "weave/results.hpp"
#include "weave/weaving_run.hpp"

namespace heddle {
namespace {

using std::filesystem::path;

/// Memory of this machine from the kernel's table [bytes]; 0 where it is not told.
double memory_bytes(const std::string& key) {
  std::ifstream in("/proc/meminfo");
  for (std::string line; std::getline(in, line);) {
    std::istringstream words(line);
    std::string name;
    double kilobytes = 0;
    if (words >> name >> kilobytes && name == key + ":") return 1024 * kilobytes;
  }
  return 0;
}

/// The runs with what they cost, longest first. Throws std::runtime_error with all runs that can not be set up.
std::vector<RunTask> plan(const Study& study, const path& output) {
  std::vector<RunTask> tasks;
  std::string wrong;
  for (const StudyRun& run : study.runs) {
    RunTask task;
    task.run = &run;
    task.cloth = weave::to_toml(run.spec);
    try {
      const weave::RunEstimate e = weave::estimate_run(run.spec);
      task.cost = e.wall * omp_get_max_threads();
      task.memory = e.memory;
      // A file for each pick, for each cell, and a few more; then the pictures.
      constexpr double bytes_per_node = 100, pictures = 1e7;
      task.disk = static_cast<double>(e.nodes_end) * bytes_per_node * (e.picks + run.spec.cells + 3) + pictures;
    } catch (const std::exception& error) {
      wrong += fmt::format("{}{}: run {}: {}", wrong.empty() ? "" : "\n", study.file.string(), run.name, error.what());
    }
    task.record = read_record(study, run, output);
    tasks.push_back(std::move(task));
  }
  if (!wrong.empty()) throw std::runtime_error(wrong);
  std::stable_sort(tasks.begin(), tasks.end(), [](const RunTask& a, const RunTask& b) { return a.cost > b.cost; });
  return tasks;
}

/// Refuses a folder of another study, and a disk that is too small.
void check_folder(const Study& study, const std::vector<RunTask>& tasks, const path& output) {
  const nlohmann::ordered_json j = read_json(output / "study.json");
  if (j.is_object() && j.value("study", study.name) != study.name)
    throw std::runtime_error(fmt::format("{}: holds the study {}; give --output another folder", output.string(), j.value("study", "")));
  std::filesystem::create_directories(output);
  double needed = 0;
  for (const RunTask& task : tasks) needed += task.is_over() ? 0 : task.disk;
  const auto free = static_cast<double>(std::filesystem::space(output).available);
  if (needed > free)
    throw std::runtime_error(
        fmt::format("{}: the runs need about {:.3g} GB of disk, {:.3g} GB are free", output.string(), 1e-9 * needed, 1e-9 * free));
}

void check_memory(const std::vector<RunTask>& tasks) {
  const double total = memory_bytes("MemTotal");
  for (const RunTask& task : tasks) {
    if (!task.is_over() && total > 0 && task.memory > total)
      throw std::runtime_error(fmt::format("run {} needs about {:.3g} GB of memory, this machine has {:.3g} GB", task.run->name,
                                           1e-9 * task.memory, 1e-9 * total));
  }
}

void print_list(const Study& study, const std::vector<RunTask>& tasks, const Shares& shares) {
  fmt::print("{}: {}\n{}\n", study.name, study.title, study.question);
  fmt::print("{} runs until {}, {} at a time with {} threads each\n", tasks.size(), study.until, shares.jobs, shares.threads);
  fmt::print("  {:<44} {:>12} {:>10}  {}\n", "run", "about", "memory", "state");
  double whole = 0;
  for (const RunTask& task : tasks) {
    const RunTask* twin = twin_of(task, tasks);
    const bool waits = twin != nullptr && task.record.state == RunState::waiting;
    if (!twin && !task.is_over()) whole += task.cost;
    fmt::print("  {:<44} {:>12} {:>7.0f} MB  {}{}\n", task.run->name, twin ? "-" : duration_text(task.cost), 1e-6 * task.memory,
               name_of(task.record.state), waits ? " for the cloth of " + twin->run->name : "");
  }
  fmt::print("  about {} to weave what is left; time and memory are those of weaving\n", duration_text(whole / std::max(1, shares.jobs)));
}

void write_tables(const Study& study, const std::vector<StudyRow>& rows, const path& output) {
  weave::write_text_file(output / "study.csv", study_csv(study, rows));
  weave::write_text_file(output / "study.json", study_json(study, rows));
}

void print_table(const Study& study, const std::vector<StudyRow>& rows) {
  for (const StudyRow& row : rows) {
    fmt::print("  {:<32} {}\n", row.task->run->name, row.task->record.state == RunState::finished ? "" : name_of(row.task->record.state));
    for (std::size_t i = 0; i < study.collect.size(); ++i) {
      if (row.task->record.state == RunState::finished) fmt::print("    {:<36} {}\n", study.collect[i], figure_text(row.figures[i]));
    }
  }
}

/// Collected figures that no finished run has: most likely misspelled.
void report_missing(const Study& study, const std::vector<StudyRow>& rows) {
  if (std::none_of(rows.begin(), rows.end(), [](const StudyRow& row) { return row.task->record.state == RunState::finished; })) return;
  for (std::size_t i = 0; i < study.collect.size(); ++i) {
    if (std::all_of(rows.begin(), rows.end(), [&](const StudyRow& row) { return row.figures[i].value.is_null(); }))
      fmt::print(stderr, "{}: collect: \"{}\": no run has this figure in its summary.json\n", study.file.string(), study.collect[i]);
  }
}

}  // namespace

Shares share_machine(int jobs, int threads, int cores, const std::vector<double>& memory, double available) {
  const auto runs = static_cast<int>(memory.size());
  Shares shares;
  shares.jobs = jobs > 0 ? jobs : std::max(1, std::min(runs, cores / std::max(1, threads)));
  if (jobs <= 0) {
    double sum = 0;
    int fitting = 0;
    for (const double m : memory) {
      sum += m;
      if (available > 0 && sum > available) break;
      ++fitting;
    }
    shares.jobs = std::clamp(shares.jobs, 1, std::max(1, fitting));
  }
  shares.threads = threads > 0 ? threads : std::max(1, cores / shares.jobs);
  return shares;
}

int study_command(const StudyOptions& options) {
  if (options.engine != "local" && options.engine != "slurm")
    throw std::invalid_argument("--engine " + options.engine + ": must be local or slurm");
  const bool slurm = options.engine == "slurm";
  const Study study = read_study(options.study_file);
  if (slurm) require_slurm();
  const path output = options.output.empty() ? path("results") / study.name : options.output;
  std::vector<RunTask> tasks = plan(study, output);
  if (!options.only.empty()) {
    std::erase_if(tasks, [&](const RunTask& task) { return task.run->name != options.only; });
    if (tasks.empty())
      throw std::invalid_argument(fmt::format("--only {}: {} has no such run; --list shows its runs", options.only, study.file.string()));
  }
  for (RunTask& task : tasks) {
    if (options.retry && task.record.state == RunState::failed) task.record.state = RunState::waiting;
  }
  for (const path& folder : options.reuse) {
    if (!std::filesystem::is_directory(folder)) throw std::invalid_argument("--reuse " + folder.string() + ": is no folder");
  }
  std::vector<double> memory;
  for (const RunTask& task : tasks) {
    if (!task.is_over()) memory.push_back(task.memory);
  }
  std::sort(memory.rbegin(), memory.rend());
  constexpr double memory_share = 0.8;  // of what is free now
  const Shares shares =
      share_machine(options.jobs, options.threads, omp_get_num_procs(), memory, memory_share * memory_bytes("MemAvailable"));
  if (options.list) {
    print_list(study, tasks, shares);
    return 0;
  }
  check_folder(study, tasks, output);
  if (options.retry) {  // those who run it elsewhere read it there
    for (const RunTask& task : tasks) {
      if (task.record.state == RunState::waiting && task.record.attempts > 0) write_record(study, *task.run, output, task.record);
    }
  }
  if (!slurm) check_memory(tasks);

  watch_stop_signals();
  const auto rows = [&] { return study_rows(study, tasks, output); };
  const auto on_end = [&] {
    if (options.only.empty()) write_tables(study, rows(), output);
  };
  const path this_program = std::filesystem::read_symlink("/proc/self/exe");
  bool completed = true;
  {
    StudyProgress progress(tasks, output, shares.jobs, options.quiet);
    const auto kept = std::ranges::count_if(tasks, &RunTask::is_over);
    if (kept > 0) progress.say(fmt::format("{} of {} runs are kept from before", kept, tasks.size()));
    if (const std::size_t taken = take_over_cloths(tasks, options.reuse, output); taken > 0)
      progress.say(fmt::format("cloths of {} runs are taken over", taken));
    if (slurm) {
      SlurmOptions cluster;
      cluster.output = output;
      cluster.program = this_program;
      cluster.run_program = options.program;
      cluster.jobs = options.jobs;
      cluster.threads = std::max(1, options.threads);
      cluster.sbatch = options.sbatch;
      cluster.poll = options.poll;
      completed = run_on_slurm(study, tasks, cluster, progress, on_end);
    } else {
      LocalOptions local;
      local.output = output;
      local.program = options.program.empty() ? this_program : options.program;
      local.jobs = shares.jobs;
      local.threads = shares.threads;
      completed = run_here(study, tasks, local, progress, on_end);
    }
  }
  const auto finished =
      std::count_if(tasks.begin(), tasks.end(), [](const RunTask& task) { return task.record.state == RunState::finished; });
  if (options.only.empty()) {
    const std::vector<StudyRow> results = rows();
    write_tables(study, results, output);
    const std::vector<path> pictures = draw_study(study, results, output, output / "pictures");
    weave::write_text_file(output / "study.html", study_page(study, results, pictures));
    report_missing(study, results);
    if (!options.quiet) print_table(study, results);
    fmt::print("{}: {} of {} runs finished; tables, pictures and study.html in {}\n", study.name, finished, tasks.size(), output.string());
    for (const RunTask& task : tasks) {
      if (task.record.state == RunState::failed) fmt::print(stderr, "{} failed: {}\n", task.run->name, task.record.message);
    }
    if (std::any_of(tasks.begin(), tasks.end(), [](const RunTask& task) { return task.record.state == RunState::failed; }))
      fmt::print(stderr, "--retry repeats the runs that failed\n");
  }
  if (!completed) return 130;
  if (static_cast<std::size_t>(finished) == tasks.size()) return 0;
  return !options.only.empty() && tasks.front().record.status > 0 ? tasks.front().record.status : 1;
}

}  // namespace heddle
