// Wall time of a step by stage for a loom in the middle of a weave, as it is and with more, or less, of what is idle: stored warp behind
// the heddles, the reed at rest, an empty shed, waiting wefts, cloth that was cut off, friction. Each part's cost is the difference of the
// rows, which take turns so that a change of the machine's speed meets all of them.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "weave/case.hpp"
#include "weave/checkpoint.hpp"
#include "weave/engine.hpp"
#include "weave/loom.hpp"
#include "weave/weaving_run.hpp"

namespace {

constexpr int calm_steps = 3000, rounds = 9, steps_a_round = 400;

struct Row {
  std::string name;
  weave::Engine engine;
  std::vector<weave::StageTimes> times;  ///< a round [s]
};

weave::EngineOptions options_of(const weave::Case& c, const weave::LoomLayout& layout) {
  weave::EngineOptions o;
  o.skin = c.numerics.skin * layout.fiber_diameter;
  o.outer_skin = c.numerics.outer_skin * layout.fiber_diameter;
  o.active_x_max = c.loom.length + 2 * c.numerics.element_length * layout.fiber_diameter;
  return o;
}

/// Reed, heddles and held ends stay where they are.
weave::Drive at_rest(const weave::Engine& engine) {
  const weave::Model& m = engine.model();
  weave::Drive drive;
  drive.guide_speed.assign(m.fibers(), 0);
  for (std::size_t f = 0; f < m.fibers(); ++f) drive.guide_z.push_back(engine.state().x[m.last(f)].z());
  return drive;
}

void step(Row& row, int steps) {
  const weave::Drive drive = at_rest(row.engine);
  for (int i = 0; i < steps; ++i) {
    if (const auto report = row.engine.step(drive); report.status != weave::StepStatus::ok)
      throw std::runtime_error(row.name + ": " + report.message);
  }
}

void run_round(Row& row) {
  const weave::StageTimes before = row.engine.stage_times();
  step(row, steps_a_round);
  const weave::StageTimes& after = row.engine.stage_times();
  row.times.push_back({after.search - before.search, after.contact - before.contact, after.integrate - before.integrate});
}

double median_us(const Row& row, double weave::StageTimes::*stage) {
  std::vector<double> all;
  for (const weave::StageTimes& t : row.times) all.push_back(t.*stage);
  std::nth_element(all.begin(), all.begin() + rounds / 2, all.end());
  return 1e6 * all[rounds / 2] / steps_a_round;
}

/// Model and state of a loom that has woven for `steps`.
weave::Checkpoint woven(const weave::Case& c, std::int64_t steps) {
  const auto folder = std::filesystem::temp_directory_path() / "heddle_idle_parts";
  weave::RunOptions run;
  run.output = folder;
  run.stop_at_step = steps;
  const weave::WeaveResult result = weave::weave_cloth(c, run);
  if (result.status != weave::RunStatus::interrupted)
    throw std::runtime_error("the weave ended before its step " + std::to_string(steps) + ": " + result.message);
  weave::Checkpoint checkpoint = weave::read_checkpoint(folder / "checkpoint.h5");
  std::filesystem::remove_all(folder);
  return checkpoint;
}

}  // namespace

int main(int argc, char** argv) try {
  const std::string file = argc > 1 ? argv[1] : HEDDLE_CASES_DIR "/three_warp/case.toml";
  const std::int64_t steps = argc > 2 ? std::stoll(argv[2]) : 150000;
  const weave::Case c = weave::load_case(file, {"fabric.cells=2"});
  const weave::LoomLayout layout = weave::lay_out(c);
  const weave::EngineOptions options = options_of(c, layout);
  std::vector<Row> rows;
  const auto add = [&](const std::string& name, weave::Model model, weave::State state) {
    rows.push_back({name, weave::Engine(std::move(model), std::move(state), options), {}});
  };

  fmt::print("{}: {} steps woven, then {} steps to calm down and {} rounds of {} at rest\n", c.name, steps, calm_steps, rounds,
             steps_a_round);
  const weave::Checkpoint cloth = woven(c, steps);
  add("cloth on the loom", cloth.model, cloth.state);
  {
    weave::Model m = cloth.model;
    weave::State s = cloth.state;
    weave::LoomLayout more = layout;
    more.stored_length *= 10;
    weave::supply_warp(c, more, m, s);
    add("  with ten times the stored warp", std::move(m), std::move(s));
  }
  {
    weave::Model m = cloth.model;
    m.friction = 0;
    add("  without friction", std::move(m), cloth.state);
  }
  const auto add_start = [&](const std::string& name, const std::vector<std::string>& overrides) {
    const weave::Case variant = weave::load_case(file, overrides);
    auto [m, s] = weave::set_up_loom(variant, weave::lay_out(variant));
    add(name, std::move(m), std::move(s));
  };
  add_start("warps alone, no reed", {"fabric.cells=2", "beat_up.enabled=false"});
  add_start("  with the reed at rest", {"fabric.cells=2"});
  add_start("  with the wefts of 500 cells waiting", {"fabric.cells=500"});
  for (Row& row : rows) step(row, calm_steps);
  for (int i = 0; i < rounds; ++i) {
    for (Row& row : rows) run_round(row);
  }

  fmt::print("{:<40}{:>8}{:>10}{:>12}{:>12}{:>12}{:>12}\n", "us a step, medians", "nodes", "contacts", "search", "contact", "bars,motion",
             "a node [ns]");
  for (const Row& row : rows) {
    const double search = median_us(row, &weave::StageTimes::search), contact = median_us(row, &weave::StageTimes::contact),
                 motion = median_us(row, &weave::StageTimes::integrate);
    const auto nodes = static_cast<double>(row.engine.model().nodes());
    fmt::print("{:<40}{:>8}{:>10}{:>12.1f}{:>12.1f}{:>12.1f}{:>12.0f}\n", row.name, nodes, row.engine.state().contacts.active.number.size(),
               search, contact, motion, 1e3 * (search + contact + motion) / nodes);
  }
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
