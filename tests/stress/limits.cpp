// How far each quantity can be taken: runs the full sweeps and prints, for each, the range that went to its end with ledger and order
// intact, what happens beyond it, and what is wrong, if anything is. heddle_stress [FOLDER [WORD]]: writes limits.csv, a row for each run,
// and limits.md, the table, into FOLDER; with WORD only the sweeps whose quantity or scene holds it.
#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "stress/case_fuzz.hpp"
#include "stress/contact_sweeps.hpp"
#include "stress/kill_resume.hpp"
#include "stress/loom_sweeps.hpp"
#include "weave/results.hpp"

namespace {

using stress::Outcome;
using stress::Sweep;

Outcome fuzz(int mutants) {
  const stress::FuzzCount count = stress::fuzz_cases(HEDDLE_CASES_DIR, 2, mutants);
  return {.completed = true,
          .steps = mutants,
          .defect = count.faults.empty() ? "" : count.faults.front().substr(0, count.faults.front().find('\n'))};
}

Outcome weave_random_matrices(int matrices) {
  Outcome all{.completed = true};
  for (int seed = 1; seed <= matrices; ++seed) {
    const Outcome o =
        stress::weave_through(weave::parse_case(stress::random_weave(1000 + seed), "random/case.toml", stress::single_fibers));
    all.steps += o.steps;
    all.overlap_max = std::max(all.overlap_max, o.overlap_max);
    if (const std::string fault = stress::fault(o, stress::ledger_limit); !fault.empty())
      all.defect = fmt::format("matrix {}: {}", seed, fault);
  }
  return all;
}

Outcome weave_on(int picks, const std::vector<std::string>& overrides) {
  const stress::LongWeave weave = stress::weave_long(picks, overrides);
  Outcome o = weave.outcome;
  if (o.completed) o.defect = stress::drift(weave);
  return o;
}

Outcome kill(const std::filesystem::path& folder, int kills) {
  const stress::KillCount count = stress::kill_and_resume(HEDDLE_PROGRAM, folder, 2, kills);
  return {.completed = true, .steps = count.resumed, .defect = count.faults.empty() ? "" : count.faults.front()};
}

std::vector<Sweep> all_sweeps(const std::filesystem::path& folder) {
  std::vector<Sweep> sweeps = stress::contact_sweeps(stress::Extent::full);
  for (Sweep& sweep : stress::loom_sweeps(stress::Extent::full)) sweeps.push_back(std::move(sweep));
  sweeps.push_back({"mutated cases", "", "case reader", {100000}, 0, [](double n) { return fuzz(static_cast<int>(n)); }});
  sweeps.push_back({"random weaving matrices", "", "single fibers", {100}, stress::ledger_limit, [](double n) {
                      return weave_random_matrices(static_cast<int>(n));
                    }});
  sweeps.push_back({"picks", "", "plain weave of single fibers", {30, 100, 300, 1000}, stress::ledger_limit, [](double n) {
                      return weave_on(static_cast<int>(n), stress::single_fibers);
                    }});
  sweeps.push_back({"picks", "", "plain weave", {30, 100}, 0.02, [](double n) { return weave_on(static_cast<int>(n), {}); }});
  sweeps.push_back({"kills", "", "heddle weave", {100}, 0, [folder](double n) { return kill(folder / "kills", static_cast<int>(n)); }});
  return sweeps;
}

struct Run {
  double value;
  Outcome outcome;
  std::string fault;
};

/// Text as one field of a CSV file.
std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

/// The values that went to the end, e.g. "0.01 ... 0.5", where they are one range; else all of them.
std::string range_of(const std::vector<Run>& runs) {
  std::vector<double> good;
  std::size_t changes = 0;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const bool ends = runs[i].outcome.completed && runs[i].fault.empty();
    if (ends) good.push_back(runs[i].value);
    if (i > 0) changes += ends != (runs[i - 1].outcome.completed && runs[i - 1].fault.empty());
  }
  if (good.empty()) return "none";
  if (good.size() > 1 && changes <= 2) return fmt::format("{:g} ... {:g}", good.front(), good.back());
  return fmt::format("{:g}", fmt::join(good, ", "));
}

/// What a message says, without time, place and advice.
std::string cause(const std::string& message) {
  const auto time = message.find(" s: ");
  const std::string what = time == std::string::npos ? message : message.substr(time + 4);
  return what.substr(0, std::min({what.find(" at x = "), what.find(';'), what.find('\n')}));
}

std::string first_stop(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    if (!run.outcome.completed && run.fault.empty()) return fmt::format("{:g}: {}", run.value, cause(run.outcome.message));
  }
  return "";
}

std::string first_fault(const std::vector<Run>& runs) {
  for (const Run& run : runs) {
    if (!run.fault.empty()) return fmt::format("{:g}: {}", run.value, run.fault);
  }
  return "";
}

}  // namespace

int main(int argc, char** argv) try {
  omp_set_num_threads(1);  // the scenes are too small for more
  const std::filesystem::path folder = argc > 1 ? argv[1] : "stress";
  const std::string word = argc > 2 ? argv[2] : "";
  std::filesystem::create_directories(folder);
  std::string csv = "quantity,unit,scene,value,completed,ledger_error,overlap_max,late_searches,wrong_order,steps,message,fault\n";
  std::string table =
      "| quantity | scene | to its end | ledger open by at most | deepest overlap | stops at | fails at |\n|---|---|---|---|---|---|---|\n";
  int faults = 0;
  for (const Sweep& sweep : all_sweeps(folder)) {
    const std::string name = sweep.quantity + (sweep.unit.empty() ? "" : " [" + sweep.unit + "]");
    if ((name + ", " + sweep.scene).find(word) == std::string::npos) continue;
    std::vector<Run> runs;
    double ledger_error = 0, overlap = 0;
    for (const double value : sweep.values) {
      const Outcome o = sweep.run(value);
      runs.push_back({value, o, stress::fault(o, sweep.ledger_limit)});
      const std::string& fault = runs.back().fault;
      faults += !fault.empty();
      if (o.completed && fault.empty()) {
        ledger_error = std::max(ledger_error, o.ledger_error);
        overlap = std::max(overlap, o.overlap_max);
      }
      csv +=
          fmt::format("{},{},{},{},{},{},{},{},{},{},{},{}\n", quoted(sweep.quantity), sweep.unit, quoted(sweep.scene), value, o.completed,
                      o.ledger_error, o.overlap_max, o.late_searches, o.wrong_order, o.steps, quoted(o.message), quoted(fault));
      fmt::print("{}, {}, {:g}: {}\n", name, sweep.scene, value,
                 o.completed ? fmt::format("ledger open by {:.2g}, overlap {:.2f}, {} steps{}", o.ledger_error, o.overlap_max, o.steps,
                                           fault.empty() ? "" : "; " + fault)
                             : o.message + (fault.empty() ? "" : "; " + fault));
      std::fflush(stdout);
    }
    table += fmt::format("| {} | {} | {} | {:.1g} | {:.2f} | {} | {} |\n", name, sweep.scene, range_of(runs), ledger_error, overlap,
                         first_stop(runs), first_fault(runs));
    weave::write_text_file(folder / "limits.csv", csv);
    weave::write_text_file(folder / "limits.md", table);
  }
  fmt::print("\n{}", table);
  return faults == 0 ? 0 : 1;
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
