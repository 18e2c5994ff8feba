// Wall time of a weave at several numbers of threads, each from the same woven state for the same steps, by stage, and whether all end
// with the same bits:
//     heddle_scaling CASE FOLDER [STEPS] [THREADS,THREADS,...] [WOVEN_STEPS]
// FOLDER/start keeps that state, which a first call weaves.
#include <fmt/format.h>
#include <omp.h>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "weave/case.hpp"
#include "weave/checkpoint.hpp"
#include "weave/weaving_run.hpp"

namespace {

namespace fs = std::filesystem;

weave::WeaveSummary weave_until(const weave::Case& c, const fs::path& folder, bool resume, std::int64_t step) {
  weave::RunOptions run;
  run.output = folder;
  run.resume = resume;
  run.stop_at_step = step;
  const weave::WeaveResult result = weave::weave_cloth(c, run);
  if (result.status != weave::RunStatus::interrupted)
    throw std::runtime_error("the weave ended before step " + std::to_string(step) + ": " + result.message);
  return result.summary;
}

std::vector<int> numbers_in(const std::string& list) {
  std::vector<int> numbers;
  std::istringstream in(list);
  for (std::string word; std::getline(in, word, ',');) numbers.push_back(std::stoi(word));
  return numbers;
}

bool same_motion(const weave::State& a, const weave::State& b) {
  return a.x == b.x && a.v == b.v && a.time == b.time;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("use: heddle_scaling CASE FOLDER [STEPS] [THREADS,THREADS,...] [WOVEN_STEPS]");
  const weave::Case c = weave::load_case(argv[1]);
  const fs::path folder = argv[2], start = folder / "start";
  const std::int64_t steps = argc > 3 ? std::stoll(argv[3]) : 100000;
  const std::vector<int> threads = numbers_in(argc > 4 ? argv[4] : "1,2");
  const std::int64_t woven = argc > 5 ? std::stoll(argv[5]) : 200000;

  if (!fs::exists(start / "checkpoint.h5")) weave_until(c, start, false, woven);
  const weave::State first = weave::read_checkpoint(start / "checkpoint.h5").state;
  fmt::print("{}: {} nodes, {} steps from step {} on, seconds\n", c.name, first.x.size(), steps, first.step);
  fmt::print("{:>8}{:>10}{:>10}{:>10}{:>14}{:>14}{:>10}{:>12}\n", "threads", "all", "search", "contact", "bars, motion", "loom, output",
             "speed-up", "same bits");
  double one_thread = 0;  // as the first run tells
  weave::State last_of_first;
  for (const int count : threads) {
    omp_set_num_threads(count);
    const fs::path run = folder / fmt::format("threads_{}", count);
    fs::remove_all(run);
    fs::copy(start, run, fs::copy_options::recursive);
    const weave::WeaveSummary before = weave_until(c, run, true, first.step);
    const weave::WeaveSummary after = weave_until(c, run, true, first.step + steps);
    const weave::State last = weave::read_checkpoint(run / "checkpoint.h5").state;
    const double all = after.wall - before.wall;
    if (one_thread == 0) {
      one_thread = all * count;
      last_of_first = last;
    }
    fmt::print("{:>8}{:>10.2f}{:>10.2f}{:>10.2f}{:>14.2f}{:>14.2f}{:>10.2f}{:>12}\n", count, all,
               after.stages.search - before.stages.search, after.stages.contact - before.stages.contact,
               after.stages.integrate - before.stages.integrate,
               after.wall_loom + after.wall_output - before.wall_loom - before.wall_output, one_thread / all,
               same_motion(last, last_of_first) ? "yes" : "no");
    std::fflush(stdout);
  }
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
