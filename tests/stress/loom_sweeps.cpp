#include "stress/loom_sweeps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "scenes/small_case.hpp"
#include "weave/peak_memory.hpp"
#include "weave/weaving_run.hpp"

namespace stress {
namespace {

constexpr double drift_most = 3;          ///< of the last third over the first
constexpr double steadiness_floor = 0.1;  ///< difference of successive cells below which none counts [fiber diameters]
constexpr double memory_floor = 5e4;      ///< of a pick: rows of the history and the kept cell, as vectors grow [bytes]

/// Work that goes in and out through the loom, by row of the history, each part counted as it is [J].
std::vector<double> throughput(const weave::History& h) {
  std::vector<double> sum(h.time_s.size(), 0);
  for (const auto* work : {&h.work_tension_J, &h.work_reed_J, &h.work_heddle_J, &h.work_take_up_J}) {
    for (std::size_t i = 1; i < sum.size(); ++i) sum[i] += std::abs((*work)[i] - (*work)[i - 1]);
  }
  for (std::size_t i = 1; i < sum.size(); ++i) sum[i] += sum[i - 1];
  return sum;
}

double mean_steadiness(const std::vector<weave::Steadiness>& cells, std::size_t from, std::size_t to) {
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += cells[i].mean;
  return to > from ? sum / static_cast<double>(to - from) : 0;
}

Outcome outcome_of(const weave::WeaveResult& result) {
  const weave::WeaveSummary& s = result.summary;
  return {.completed = result.status == weave::RunStatus::completed,
          .message = result.message,
          .ledger_error = s.energy_residual,
          .overlap_max = s.overlap_max,
          .steps = s.steps,
          .late_searches = s.late_searches,
          .wrong_order = s.order_violations};
}

}  // namespace

weave::Case plain_weave(const std::vector<std::string>& overrides) {
  return weave::parse_case(scenes::small_case_text(), "stress/case.toml", overrides);
}

Outcome weave_through(const weave::Case& c) {
  try {
    return outcome_of(weave::weave_cloth(c, {}));
  } catch (const std::runtime_error& error) {
    return {.message = error.what()};
  }
}

std::vector<Sweep> loom_sweeps(Extent extent) {
  std::vector<Sweep> sweeps;
  const auto add = [&](const char* quantity, const char* unit, std::vector<double> values, const auto& override_of) {
    if (values.empty()) return;
    sweeps.push_back({quantity, unit, "plain weave of two picks", std::move(values), ledger_limit, [override_of](double value) -> Outcome {
                        try {
                          return weave_through(plain_weave({override_of(value)}));
                        } catch (const weave::CaseError& error) {
                          return {.message = error.what()};
                        }
                      }});
  };
  add("reed speed", "m/s", pick(extent, {50}, {1, 5, 10, 20, 50, 100}), [](double v) { return fmt::format("beat_up.top_speed={:e}", v); });
  add("friction", "", pick(extent, {0, 2}, {0, 0.2, 0.5, 1, 2, 5}), [](double v) { return fmt::format("fabric.friction={:e}", v); });
  add("warp tension", "N", pick(extent, {0.0101, 1000}, {0.01, 0.0101, 0.0102, 0.1, 1, 10, 100, 1000}),
      [](double v) { return fmt::format("loom.tension={:e}", v); });
  add("E/E_T", "", pick(extent, {1e4}, {1, 10, 100, 1e3, 1e4}),
      [](double v) { return fmt::format("yarns.glass.transverse_modulus={:e}", 86.9e9 / v); });
  add("length of a bar", "diameters", pick(extent, {20}, {0.5, 1, 2, 3, 5, 10, 20}),
      [](double v) { return fmt::format("numerics.element_length={:e}", v); });
  add("shedding time", "ms", pick(extent, {0.05}, {0.02, 0.05, 0.1, 0.4, 2}),
      [](double v) { return fmt::format("shedding.time=\"{:e} ms\"", v); });
  add("fibers a yarn", "", pick(extent, {}, {1, 3, 5, 7, 19}), [](double v) { return fmt::format("yarns.glass.fibers={:.0f}", v); });
  return sweeps;
}

LongWeave weave_long(int picks, const std::vector<std::string>& overrides) {
  std::vector<std::string> all = overrides;
  all.push_back(fmt::format("fabric.cells={}", picks / 2));
  all.emplace_back("output.history_interval=\"0.1 ms\"");
  const weave::Case c = plain_weave(all);
  LongWeave w;
  double memory = 0;
  weave::RunOptions options;
  options.on_progress = [&](const weave::RunProgress& progress) {
    if (memory == 0 && progress.pick > progress.picks / 3) memory = weave::peak_memory_bytes();
  };
  const weave::WeaveResult result = weave::weave_cloth(c, options);
  w.outcome = outcome_of(result);
  w.nodes = result.summary.nodes;
  w.nodes_most = result.summary.nodes_max;
  if (memory > 0) w.memory_a_pick = (weave::peak_memory_bytes() - memory) / (2.0 / 3 * picks);
  const std::vector<double> work = throughput(result.history), &residual = result.history.residual_J;
  const std::size_t rows = work.size(), third = rows / 3;
  if (third > 0) {
    w.ledger_first = std::abs(residual[third] - residual[0]) / (work[third] - work[0]);
    w.ledger_last = std::abs(residual[rows - 1] - residual[rows - 1 - third]) / (work[rows - 1] - work[rows - 1 - third]);
  }
  const auto& cells = result.summary.steadiness;
  w.steadiness_first = mean_steadiness(cells, 0, cells.size() / 3);
  w.steadiness_last = mean_steadiness(cells, cells.size() - cells.size() / 3, cells.size());
  return w;
}

std::string drift(const LongWeave& w) {
  if (w.nodes_most > 2 * w.nodes) return fmt::format("{} nodes at the end, {} at most", w.nodes, w.nodes_most);
  if (w.memory_a_pick > memory_floor) return fmt::format("the memory grows by {:.2g} bytes a pick", w.memory_a_pick);
  if (w.ledger_last > drift_most * std::max(w.ledger_first, ledger_limit)) {
    return fmt::format("the ledger opens by {:.2g} of the work in the last third, by {:.2g} in the first", w.ledger_last, w.ledger_first);
  }
  if (w.steadiness_last > drift_most * std::max(w.steadiness_first, steadiness_floor)) {
    return fmt::format("cells differ by {:.2g} diameters in the last third, by {:.2g} in the first", w.steadiness_last, w.steadiness_first);
  }
  return "";
}

std::string random_weave(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto below = [&](std::uint64_t n) { return static_cast<std::size_t>(random() % n); };
  const std::size_t layers = 1 + below(2), picks = layers * (1 + below(2));
  std::vector<std::size_t> warps_of(1 + below(3));
  for (std::size_t& warps : warps_of) warps = 1 + below(2);
  if (warps_of.size() == 1) warps_of[0] = 2;
  std::vector<std::vector<std::string>> rows(warps_of.size(), std::vector<std::string>(picks));
  for (std::size_t pick = 0; pick < picks; ++pick) {
    std::size_t up = 0, all = 0;
    for (std::size_t s = 0; s < warps_of.size(); ++s) {
      const std::size_t raised = below(warps_of[s] + 1);
      rows[s][pick] = std::string(raised, '+') + std::string(warps_of[s] - raised, '-');
      up += raised;
      all += warps_of[s];
    }
    if (up == 0) rows[0][pick][0] = '+';
    if (up == all) rows[0][pick].back() = '-';
  }
  std::string sections;
  for (std::size_t s = 0; s < rows.size(); ++s) {
    sections += fmt::format("[[section]]\nyarn = \"glass\"\ndent = {}\nmatrix = [\"{}\"]\n", s, fmt::join(rows[s], "\", \""));
  }
  return scenes::small_case_text(sections, static_cast<int>(layers), 1.2);
}

}  // namespace stress
