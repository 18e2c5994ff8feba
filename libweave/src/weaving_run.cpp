#include "weave/weaving_run.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numeric>

#include "weave/checkpoint.hpp"
#include "weave/fiber_path.hpp"
#include "weave/results.hpp"
#include "weave/version.hpp"

namespace weave {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

constexpr double rows_per_pick = 400;  ///< of the history, by default
/// Of the smallest fiber diameter that a fiber may move in a step: so little that the first overlap of fibers that meet at the speed of a
/// reed is well below the deepest. Of a bar where that is shorter, which may not turn far in a step.
constexpr double motion_share = 0.015;
constexpr double start_overlap_limit = 0.05;
constexpr double progress_interval = 0.5;         ///< wall time [s]
constexpr double order_check_interval = 0.05;     ///< share of a pick
constexpr double engine_reach_behind_heddle = 2;  ///< bars that may still touch behind the heddle plane

/// The run's own counters; with the engine's state all that a checkpoint needs.
struct LoomState {
  std::int64_t pick = 0;    ///< under way, 0-based
  std::int64_t placed = 0;  ///< its weft is in the shed
  std::int64_t cells_cut = 0;
  std::int64_t order_violations = 0;
  std::int64_t history_rows = 0;  ///< in this stage of the pick
  std::int64_t nodes_max = 0, contacts_max = 0;
  std::int64_t edited = 0;                                        ///< the next ledger follows an edit of the topology
  double stage_start = 0;                                         ///< [s]
  double balance_start = 0, edit_energy = 0, balance_before = 0;  ///< of the ledger [J]
  double overlap_max = 0, overlap_row = 0, reed_row = 0, reed_beat = 0, beat_time = 0;
  double work_in = 0;  ///< largest net work put in [J]
  double residual_max = 0;
  double dt_min = 1e300;
  double node_steps = 0, contact_steps = 0;
  double tension_sum = 0, tension_count = 0;
  double wall = 0, wall_search = 0, wall_contact = 0, wall_integrate = 0, wall_loom = 0, wall_output = 0;  ///< when it was saved [s]
};

/// Pointers to a loom state's counters and numbers, const or not, in the order of the checkpoint.
auto counter_places(auto& s) {
  return std::array{&s.pick, &s.placed, &s.cells_cut, &s.order_violations, &s.history_rows, &s.nodes_max, &s.contacts_max, &s.edited};
}
auto number_places(auto& s) {
  return std::array{&s.stage_start,  &s.balance_start,  &s.edit_energy, &s.balance_before, &s.overlap_max,  &s.overlap_row,
                    &s.reed_row,     &s.reed_beat,      &s.beat_time,   &s.work_in,        &s.residual_max, &s.dt_min,
                    &s.node_steps,   &s.contact_steps,  &s.tension_sum, &s.tension_count,  &s.wall,         &s.wall_search,
                    &s.wall_contact, &s.wall_integrate, &s.wall_loom,   &s.wall_output};
}

std::vector<std::int64_t> counters_of(const LoomState& s) {
  std::vector<std::int64_t> counters;
  for (const std::int64_t* c : counter_places(s)) counters.push_back(*c);
  return counters;
}
std::vector<double> numbers_of(const LoomState& s) {
  std::vector<double> numbers;
  for (const double* n : number_places(s)) numbers.push_back(*n);
  return numbers;
}
LoomState loom_state_from(const std::vector<std::int64_t>& counters, const std::vector<double>& numbers) {
  LoomState s;
  if (counters.size() != counter_places(s).size() || numbers.size() != number_places(s).size()) {
    throw std::runtime_error("the checkpoint is of another program version");
  }
  for (std::size_t i = 0; std::int64_t * c : counter_places(s)) *c = counters[i++];
  for (std::size_t i = 0; double* n : number_places(s)) *n = numbers[i++];
  return s;
}

std::filesystem::path cell_file(const std::filesystem::path& folder, std::int64_t cell) {
  return folder / "cells" / fmt::format("cell_{:02}.vtkhdf", cell + 1);
}

EngineOptions engine_options(const Case& c, const LoomLayout& layout) {
  EngineOptions o;
  o.skin = c.numerics.skin * layout.fiber_diameter;
  o.outer_skin = c.numerics.outer_skin * layout.fiber_diameter;
  o.safety = c.numerics.safety;
  o.time_step = c.numerics.time_step;
  double smallest = layout.fiber_diameter;
  for (const std::string& name : layout.type_names) smallest = std::min(smallest, 2 * c.yarns.at(name).fiber_radius());
  o.motion_max = motion_share * std::min(1.0, c.numerics.element_length) * smallest;
  o.time_step_max = 0.05 * smallest;  // as at 0.3 m/s, for a loom at rest
  o.active_x_max = c.loom.length + engine_reach_behind_heddle * c.numerics.element_length * layout.fiber_diameter;
  return o;
}

class WeavingRun {
 public:
  WeavingRun(const Case& c, const RunOptions& options) : case_(c), options_(options), layout_(lay_out(c)) {
    engine_options_ = engine_options(c, layout_);
    total_picks_ = c.cells * c.picks_per_cell();
    for (int p = 0; p < c.picks_per_cell(); ++p) cycle_time_ += pick_time(p);
    row_interval_ = c.output.history_interval > 0 ? c.output.history_interval : cycle_time_ / c.picks_per_cell() / rows_per_pick;
    if (!options.output.empty()) {
      std::filesystem::create_directories(options.output / "picks");
      std::filesystem::create_directories(options.output / "cells");
    }
    if (options.resume) {
      resume();
    } else {
      auto [model, state] = set_up_loom(c, layout_);
      engine_ = std::make_unique<Engine>(std::move(model), std::move(state), engine_options_);
      remove_old_results();
    }
    size_drive();
  }

  WeaveResult run() {
    while (loom_.pick < total_picks_ && result_.status == RunStatus::completed) {
      if (options_.stop_after_pick >= 0 && loom_.pick >= options_.stop_after_pick) {
        interrupt();
      } else {
        run_pick();
      }
    }
    finish();
    return std::move(result_);
  }

 private:
  /// What another weave has left in the folder, which nobody is to take for this one's.
  void remove_old_results() const {
    if (options_.output.empty()) return;
    for (const char* file : {"summary.json", "weave.vtkhdf", "cell.vtkhdf", "picks.vtkhdf.series", "checkpoint.h5"})
      std::filesystem::remove(options_.output / file);
    for (const char* folder : {"picks", "cells"}) {
      for (const auto& entry : std::filesystem::directory_iterator(options_.output / folder)) {
        if (entry.path().extension() == ".vtkhdf") std::filesystem::remove(entry.path());
      }
    }
  }

  int row(std::int64_t pick) const { return static_cast<int>(pick % case_.picks_per_cell()); }
  bool shed_changes(std::int64_t pick) const { return layout_.matrix.row(row(pick)) != layout_.matrix.row(row(pick + 1)); }
  double pick_time(std::int64_t pick) const {
    return case_.insertion.time + pick_times(case_, shed_changes(pick), takes_up_after(case_, row(pick))).end;
  }
  double now() const { return engine_->state().time - loom_.stage_start; }

  void size_drive() {
    const std::size_t fibers = engine_->model().fibers();
    drive_ = {};
    drive_.guide_z.assign(fibers, 0);
    drive_.guide_speed.assign(fibers, 0);
    guide_offset_.assign(fibers, 0);
    for (std::size_t f = 0; f < fibers; ++f) {
      if (engine_->model().role[f] != Role::warp) continue;
      const WarpPlace& warp = layout_.warps[engine_->model().yarn[f]];
      const FiberType& type = engine_->model().type_of(f);
      guide_offset_[f] = warp_section(case_, warp, type.radius)[engine_->model().place[f]].y();
    }
  }

  /// Where heddles, reed and held ends stand now and how fast they go during the next step.
  void drive(const PickTimes& times, bool takes_up) {
    const double t = now(), dt = engine_->state().dt;
    const double from = loom_.placed ? shed_progress(case_, times, t) : 0;
    const double to = loom_.placed ? shed_progress(case_, times, t + dt) : 0;
    const Model& m = engine_->model();
    for (std::size_t f = 0; f < m.fibers(); ++f) {
      if (m.role[f] != Role::warp) continue;
      const int w = m.yarn[f];
      const double z = heddle_z(case_, layout_.warps[w], layout_.matrix(row(loom_.pick), w)) + guide_offset_[f];
      const double stroke = heddle_z(case_, layout_.warps[w], layout_.matrix(row(loom_.pick + 1), w)) + guide_offset_[f] - z;
      drive_.guide_z[f] = z + from * stroke;
      drive_.guide_speed[f] = (to - from) * stroke / dt;
    }
    drive_.reed_velocity.setZero();
    drive_.held_velocity.setZero();
    if (!loom_.placed) return;
    if (case_.beat_up.enabled) {
      drive_.reed_velocity.x() = (reed_position(case_, times, t + dt) - reed_position(case_, times, t)) / dt;
    }
    if (takes_up) {
      const double length = case_.take_up.length / case_.take_up.flags;
      const double done = take_up_progress(case_, times, t), next = take_up_progress(case_, times, t + dt);
      drive_.held_velocity.x() = -length * (next - done) / dt;
      // The cloth is drawn over the breast beam: what lies off its level comes back to it.
      if (done < 1) drive_.held_velocity.z() = -held_level() * (next - done) / ((1 - done) * dt);
    }
  }

  /// Mean height of the warps' held ends [m].
  double held_level() const {
    const Model& m = engine_->model();
    double sum = 0;
    int count = 0;
    for (std::uint32_t f = 0; f < m.fibers(); ++f) {
      if (m.role[f] != Role::warp) continue;
      sum += engine_->state().x[m.first[f]].z();
      ++count;
    }
    return sum / count;
  }

  std::size_t active_contacts() const { return engine_->state().contacts.active.number.size(); }

  int action_at(const PickTimes& times, double t) const {
    if (!loom_.placed) return 0;
    const double stroke = case_.beat_up.enabled ? 2 * case_.beat_up.travel / case_.beat_up.top_speed + case_.beat_up.dwell : 0;
    const bool changes = shed_changes(loom_.pick), takes = takes_up_after(case_, row(loom_.pick));
    if (t >= times.beat_up && t < times.beat_up + stroke) return 1;
    if (changes && t >= times.shedding && t < times.shedding + case_.shedding.time) return 3;
    if (case_.beat_up.enabled && t >= times.reed_return && t < times.reed_return + case_.beat_up.return_time) return 2;
    if (takes && t >= times.take_up && t < times.take_up + case_.take_up.time) return 4;
    return 5;
  }

  void run_pick() {
    const bool takes_up = takes_up_after(case_, row(loom_.pick));
    const PickTimes times = pick_times(case_, shed_changes(loom_.pick), takes_up);
    if (!loom_.placed) {
      save_checkpoint();  // so that there is one however early the run fails
      if (!run_stage(times, takes_up, case_.insertion.time)) return;
      place_weft();
    }
    if (!run_stage(times, takes_up, times.end) || !check_yarn_order()) return;
    if (const std::string lack = stored_warp_lack(case_, layout_, engine_->model(), engine_->state()); !lack.empty()) {
      fail(fmt::format("pick {}: {}", loom_.pick + 1, lack));
      return;
    }
    end_pick();
  }

  /// Steps until `length` after the stage's start. False if the run must stop.
  bool run_stage(const PickTimes& times, bool takes_up, double length) {
    double next_order_check = now() + order_check_interval * length;
    while (now() < length) {
      const auto loom_start = Clock::now();
      drive(times, takes_up);
      const bool at_row = now() >= static_cast<double>(loom_.history_rows) * row_interval_;
      const bool last = now() + engine_->state().dt >= length;
      const int action = action_at(times, now());
      Ledger ledger;
      const bool with_ledger = at_row || last || loom_.edited != 0;
      loom_wall_ += seconds_since(loom_start);
      const double dt = engine_->state().dt;
      const StepReport report = engine_->step(drive_, with_ledger ? &ledger : nullptr);
      loom_.dt_min = engine_->state().step > 2 ? std::min(loom_.dt_min, dt) : loom_.dt_min;
      loom_.node_steps += static_cast<double>(engine_->model().nodes());
      loom_.contact_steps += static_cast<double>(active_contacts());
      note(report, action);
      if (with_ledger && !std::isfinite(ledger.balance())) {
        return fail(report.status != StepStatus::ok ? report.message
                                                    : fmt::format("step {}, time {:.6g} s: the energy ledger is no longer finite",
                                                                  engine_->state().step, engine_->state().time));
      }
      if (with_ledger) note_ledger(ledger);
      if (at_row || last) add_row(ledger, action);
      if (report.status != StepStatus::ok) return fail(report.message);
      if (engine_->state().step == 1 && report.overlap_max > start_overlap_limit) {
        return fail(fmt::format(
            "yarns overlap at the start by {:.2f} of their touching distance (limit {:.2f}): widen the dents or take thinner yarns "
            "or reed bars",
            report.overlap_max, start_overlap_limit));
      }
      if (now() >= next_order_check) {
        next_order_check = now() + order_check_interval * length;
        if (!check_yarn_order()) return false;
      }
      if (!look_outside()) return false;
    }
    return true;
  }

  void note(const StepReport& report, int action) {
    loom_.overlap_max = std::max(loom_.overlap_max, report.overlap_max);
    loom_.overlap_row = std::max(loom_.overlap_row, report.overlap_max);
    const double load = std::max(0.0, report.reed_force.x());
    loom_.reed_row = std::max(loom_.reed_row, load);
    if (action == 1 && load > loom_.reed_beat) {
      loom_.reed_beat = load;
      loom_.beat_time = engine_->state().time;
    }
  }

  void note_ledger(const Ledger& ledger) {
    if (engine_->state().step == 1) loom_.balance_start = ledger.balance();
    if (loom_.edited) {
      loom_.edit_energy += ledger.balance() - loom_.balance_before;
      loom_.edited = 0;
    }
    loom_.balance_before = ledger.balance();
    loom_.work_in = std::max(loom_.work_in, std::abs(ledger.put_in()));
    loom_.residual_max = std::max(loom_.residual_max, std::abs(residual(ledger)));
    ledger_ = ledger;
  }
  double residual(const Ledger& ledger) const { return ledger.balance() - loom_.balance_start - loom_.edit_energy; }

  void add_row(const Ledger& l, int action) {
    History& h = result_.history;
    ++loom_.history_rows;
    h.time_s.push_back(engine_->state().time);
    h.pick.push_back(static_cast<int>(loom_.pick));
    h.action.push_back(action);
    h.reed_x_m.push_back(reed_x());
    h.reed_load_N.push_back(loom_.reed_row);
    h.warp_tension_N.push_back(warp_tension());
    h.overlap.push_back(loom_.overlap_row);
    h.time_step_s.push_back(engine_->state().dt);
    h.kinetic_J.push_back(l.kinetic);
    h.bars_J.push_back(l.bars + l.bending);
    h.contact_J.push_back(l.contact);
    h.friction_store_J.push_back(l.friction_store);
    h.heddle_J.push_back(l.heddle);
    h.slip_J.push_back(l.flows.slip);
    h.damping_J.push_back(l.flows.damping + l.flows.axial + l.flows.guides);
    h.work_tension_J.push_back(l.flows.tension);
    h.work_reed_J.push_back(l.flows.reed);
    h.work_heddle_J.push_back(l.flows.heddle);
    h.work_take_up_J.push_back(l.flows.take_up);
    h.work_insertion_J.push_back(loom_.edit_energy);
    h.residual_J.push_back(residual(l));
    loom_.overlap_row = loom_.reed_row = 0;
    loom_.tension_sum += h.warp_tension_N.back();
    loom_.tension_count += 1;
  }

  double reed_x() const {
    const Model& m = engine_->model();
    return m.fibers() > 0 && m.role[0] == Role::reed ? engine_->state().x[0].x() : case_.beat_up.travel;
  }

  /// Mean yarn tension half way between fell and heddle [N].
  double warp_tension() const {
    const Model& m = engine_->model();
    const auto& x = engine_->state().x;
    double sum = 0;
    for (std::uint32_t f = 0; f < m.fibers(); ++f) {
      if (m.role[f] != Role::warp) continue;
      std::uint32_t p = m.last(f) - 1;
      while (p > m.first[f] && x[p].x() > 0.5 * case_.loom.length) --p;
      sum += engine_->tension()[p];
    }
    return sum / static_cast<double>(layout_.warps.size());
  }

  bool check_yarn_order() {
    const auto start = Clock::now();
    const OrderCheck order = check_order(case_, layout_, engine_->model(), engine_->state());
    loom_wall_ += seconds_since(start);
    if (order.violations == 0) return true;
    loom_.order_violations += order.violations;
    return fail(
        fmt::format("step {}, time {:.6g} s, pick {}: {}", engine_->state().step, engine_->state().time, loom_.pick + 1, order.first));
  }

  bool fail(const std::string& message) {
    result_.status = RunStatus::failed;
    result_.message = message;
    return false;
  }

  /// Since the start of the run, with the processes before this one that it was resumed from [s].
  double wall() const { return wall_before_ + seconds_since(start_); }

  void interrupt() {
    save_checkpoint();
    result_.status = RunStatus::interrupted;
    result_.message = options_.output.empty() ? "interrupted" : "interrupted; go on with --resume";
  }

  /// Progress, checkpoint and the wish to stop.
  bool look_outside() {
    const std::int64_t step = engine_->state().step;
    const bool stop = (options_.stop && options_.stop->load()) || (options_.stop_at_step >= 0 && step >= options_.stop_at_step);
    if (stop) {
      interrupt();
      return false;
    }
    if (step % 64 != 0) return true;
    if (seconds_since(last_checkpoint_) > case_.output.checkpoint_interval) save_checkpoint();
    if (options_.on_progress && seconds_since(last_progress_) > progress_interval) {
      const double rate = static_cast<double>(step - progress_step_) / seconds_since(last_progress_);
      const double speed = (engine_->state().time - progress_time_) / seconds_since(last_progress_);
      RunProgress p;
      p.action = History::action_names[static_cast<std::size_t>(result_.history.action.empty() ? 0 : result_.history.action.back())];
      p.pick = static_cast<int>(loom_.pick) + 1;
      p.picks = total_picks_;
      p.time = engine_->state().time;
      p.time_end = cycle_time_ * case_.cells;
      p.step = step;
      p.dt = engine_->state().dt;
      p.steps_per_second = rate;
      p.wall = wall();
      p.left = (p.time_end - p.time) / std::max(speed, 1e-30);
      options_.on_progress(p);
      last_progress_ = Clock::now();
      progress_step_ = step;
      progress_time_ = engine_->state().time;
    }
    return true;
  }

  void place_weft() {
    const auto start = Clock::now();
    const StageTimes stages = engine_->stage_times();
    auto [model, state] = std::move(*engine_).release();
    const int cells_done = static_cast<int>(loom_.pick) / case_.picks_per_cell();
    while (cells_done - loom_.cells_cut > case_.kept_cells) {
      const int first = static_cast<int>(loom_.cells_cut) * case_.picks_per_cell();
      cut_cloth(cell_end(case_, layout_, model, state, first), static_cast<int>(layout_.warps.size()) + first + case_.picks_per_cell(),
                case_.layers, model, state);
      ++loom_.cells_cut;
    }
    supply_warp(case_, layout_, model, state);
    insert_weft(case_, layout_, static_cast<int>(loom_.pick), model, state);
    loom_.stage_start = state.time;
    loom_.placed = 1;
    loom_.edited = 1;
    loom_.history_rows = 0;
    loom_wall_ += seconds_since(start);
    engine_ = std::make_unique<Engine>(std::move(model), std::move(state), engine_options_);
    engine_->set_times(stages);
    size_drive();
    loom_.nodes_max = std::max<std::int64_t>(loom_.nodes_max, static_cast<std::int64_t>(engine_->model().nodes()));
  }

  /// Of the unit cell that is cut out when the picks of cell number `cell` are done. Behind the fell the warps are no longer spread by the
  /// shed; the first cells have nothing behind them.
  [[nodiscard]] int first_pick(std::int64_t cell) const {
    return std::max(0, static_cast<int>(cell) * case_.picks_per_cell() - case_.columns_behind_fell * case_.layers);
  }

  void end_pick() {
    const auto start = Clock::now();
    result_.history.reed_load_per_beat_N.push_back(loom_.reed_beat);
    result_.history.beat_time_s.push_back(loom_.beat_time);
    loom_.reed_beat = 0;
    ++loom_.pick;
    loom_.placed = 0;
    loom_.history_rows = 0;
    loom_.stage_start = engine_->state().time;
    loom_.contacts_max = std::max<std::int64_t>(loom_.contacts_max, static_cast<std::int64_t>(active_contacts()));
    const Snapshot loom = snapshot_of_loom(case_, *engine_, static_cast<int>(loom_.pick));
    if (!options_.output.empty()) {
      write_results(options_.output / "picks" / fmt::format("pick_{:04}.vtkhdf", loom_.pick), {loom, {}, to_toml(case_), version()});
    }
    if (loom_.pick % case_.picks_per_cell() == 0) {
      const std::int64_t cell = loom_.pick / case_.picks_per_cell() - 1;
      Snapshot snap = cut_cell(case_, loom, first_pick(cell));
      if (!options_.output.empty()) write_results(cell_file(options_.output, cell), {snap, {}, to_toml(case_), version()});
      cells_.push_back(std::move(snap));
    }
    output_wall_ += seconds_since(start);
  }

  void save_checkpoint() {
    if (options_.output.empty()) return;
    const auto start = Clock::now();
    const StageTimes& stages = engine_->stage_times();
    loom_.wall = wall();
    loom_.wall_search = stages.search;
    loom_.wall_contact = stages.contact;
    loom_.wall_integrate = stages.integrate;
    loom_.wall_loom = loom_wall_;
    loom_.wall_output = output_wall_;
    write_checkpoint(options_.output / "checkpoint.h5",
                     {to_toml(case_), engine_->model(), engine_->state(), result_.history, numbers_of(loom_), counters_of(loom_)});
    last_checkpoint_ = Clock::now();
    output_wall_ += seconds_since(start);
  }

  void resume() {
    const std::filesystem::path file = options_.output / "checkpoint.h5";
    if (!std::filesystem::exists(file)) throw std::runtime_error(file.string() + ": there is no checkpoint to resume from");
    Checkpoint c = read_checkpoint(file);
    if (c.case_toml != to_toml(case_))
      throw std::runtime_error(file.string() + ": the checkpoint is of another case (or the case was changed)");
    loom_ = loom_state_from(c.loom_counters, c.loom_numbers);
    result_.history = std::move(c.history);
    engine_ = std::make_unique<Engine>(std::move(c.model), std::move(c.state), engine_options_);
    engine_->set_times({loom_.wall_search, loom_.wall_contact, loom_.wall_integrate});
    wall_before_ = loom_.wall;
    loom_wall_ = loom_.wall_loom;
    output_wall_ = loom_.wall_output;
    for (std::int64_t k = 0; k < loom_.pick / case_.picks_per_cell(); ++k) {
      cells_.push_back(read_results(cell_file(options_.output, k)).snapshot);
    }
  }

  void finish() {
    const auto start = Clock::now();
    WeaveSummary& s = result_.summary;
    const Model& m = engine_->model();
    const State& state = engine_->state();
    s.nodes = m.nodes();
    s.nodes_max = std::max<std::size_t>(static_cast<std::size_t>(loom_.nodes_max), m.nodes());
    s.fibers = m.fibers();
    s.steps = state.step;
    s.dt_mean = state.time / static_cast<double>(std::max<std::int64_t>(state.step, 1));
    s.dt_min = loom_.dt_min;
    s.threads = omp_get_max_threads();
    s.stages = engine_->stage_times();
    s.contacts_max = static_cast<std::size_t>(loom_.contacts_max);
    s.contact_node_steps = loom_.node_steps;
    s.contact_steps = loom_.contact_steps;
    s.picks = static_cast<int>(loom_.pick);
    const std::vector<double>& loads = result_.history.reed_load_per_beat_N;
    if (!loads.empty()) {
      const auto last = static_cast<std::ptrdiff_t>(std::min(loads.size(), static_cast<std::size_t>(case_.picks_per_cell())));
      s.reed_load_max = *std::max_element(loads.end() - last, loads.end());
      s.reed_load_mean = std::accumulate(loads.end() - last, loads.end(), 0.0) / static_cast<double>(last);
    }
    s.warp_tension_mean = loom_.tension_count > 0 ? loom_.tension_sum / loom_.tension_count : 0;
    for (std::size_t k = 2; k < cells_.size(); ++k) {
      const auto cell = static_cast<std::int64_t>(k);
      if (first_pick(cell) - first_pick(cell - 1) == case_.picks_per_cell()) s.steadiness.push_back(steadiness(cells_[k - 1], cells_[k]));
    }
    s.order_violations = static_cast<int>(loom_.order_violations);
    s.searches = state.searches;
    s.late_searches = state.late_searches;
    s.overlap_max = loom_.overlap_max;
    s.energy = ledger_;
    s.energy_removed = loom_.edit_energy;
    s.energy_residual = loom_.work_in > 0 ? loom_.residual_max / loom_.work_in : 0;
    result_.loom = snapshot_of_loom(case_, *engine_, s.picks);
    s.column_distances_behind_fell = column_distances_behind_fell(result_.loom, case_.warps(), case_.layers);
    s.warp_stress_behind_fell = warp_stress_behind_fell(result_.loom, case_.cell_length(), s.picks / case_.picks_per_cell());
    if (!cells_.empty()) {
      result_.cell = cells_.back();
      s.cell = measure_cell(result_.cell);
      s.void_shares = void_shares(result_.cell);
      s.warp_stress = warp_stress_by_place(result_.cell);
      s.order = cloth_order(result_.cell, case_.layers, case_.insertion_order);
    }
    if (!options_.output.empty()) {
      write_results(options_.output / "weave.vtkhdf", {result_.loom, result_.history, to_toml(case_), version()});
      if (!cells_.empty()) write_results(options_.output / "cell.vtkhdf", {result_.cell, {}, to_toml(case_), version()});
      write_pick_series();
    }
    s.wall_loom = loom_wall_;
    s.wall_output = output_wall_ + seconds_since(start);
    s.wall = wall();
    if (options_.output.empty()) return;
    write_text_file(options_.output / "summary.json", summary_json(case_, result_));
    if (result_.status == RunStatus::completed) std::filesystem::remove(options_.output / "checkpoint.h5");
  }

  void write_pick_series() const {
    std::vector<std::string> names;
    std::vector<double> picks;
    for (std::int64_t k = 1; k <= loom_.pick; ++k) {
      names.push_back(fmt::format("picks/pick_{:04}.vtkhdf", k));
      picks.push_back(static_cast<double>(k));
    }
    write_series(options_.output / "picks.vtkhdf.series", names, picks);
  }

  const Case& case_;
  const RunOptions& options_;
  LoomLayout layout_;
  EngineOptions engine_options_;
  int total_picks_ = 0;
  double cycle_time_ = 0, row_interval_ = 0;
  LoomState loom_;
  Ledger ledger_;
  std::unique_ptr<Engine> engine_;
  Drive drive_;
  std::vector<double> guide_offset_;
  std::vector<Snapshot> cells_;
  WeaveResult result_;
  Clock::time_point start_ = Clock::now(), last_progress_ = start_, last_checkpoint_ = start_;
  std::int64_t progress_step_ = 0;
  double progress_time_ = 0, wall_before_ = 0, loom_wall_ = 0, output_wall_ = 0;
};

}  // namespace

WeaveResult weave_cloth(const Case& c, const RunOptions& options) {
  return WeavingRun(c, options).run();
}

RunEstimate estimate_run(const Case& c) {
  RunEstimate e;
  const LoomLayout layout = lay_out(c);
  const auto [model, state] = set_up_loom(c, layout);
  const EngineOptions options = engine_options(c, layout);
  e.warps = layout.warps.size();
  e.picks = c.cells * c.picks_per_cell();
  e.wefts = static_cast<std::size_t>(e.picks);
  for (int p = 0; p < c.picks_per_cell(); ++p) {
    const bool changes = layout.matrix.row(p) != layout.matrix.row((p + 1) % c.picks_per_cell());
    e.simulated_time += c.cells * (c.insertion.time + pick_times(c, changes, takes_up_after(c, p)).end);
  }
  e.nodes_start = model.nodes();
  double weft_nodes_cell = 0;
  std::size_t weft_fibers = 0;
  e.explicit_time_step = 1;
  double contact_step = options.time_step_max;
  for (int p = 0; p < c.picks_per_cell(); ++p) {
    const YarnType& y = c.yarns.at(c.weft.yarn_of_layer[c.layer_of_pick(p)]);
    weft_nodes_cell +=
        y.fibers * (std::max(c.cell_width() / (c.numerics.element_length * 2 * y.fiber_radius()), 1.0 * weft_bars_least) + 1);
    weft_fibers += y.fibers;
  }
  for (const std::string& name : layout.type_names) {
    const YarnType& y = c.yarns.at(name);
    const double r = y.fiber_radius(), area = y.fiber_area();
    e.explicit_time_step = std::min(e.explicit_time_step, c.numerics.element_length * 2 * r * std::sqrt(y.density / y.youngs_modulus));
    // Two neighbors, each overlapping a twentieth of the reach: what a beat-up does to a yarn.
    const PairLaw law = PairLaw::of(r, r, y.transverse_modulus, y.transverse_modulus);
    const double k = 2 * law.line_stiffness(0.05 * law.reach) * (1 + std::max(c.friction, y.friction_within.value_or(0)));
    contact_step = std::min(contact_step, c.numerics.safety * 2 / std::sqrt(2 * k / (y.density * area)));
  }
  e.time_step = c.numerics.time_step > 0 ? c.numerics.time_step : contact_step;
  if (c.numerics.integrator == "explicit" && c.numerics.time_step <= 0)
    e.time_step = std::min(e.time_step, c.numerics.safety * e.explicit_time_step);
  const int cells_on_loom = std::min(c.cells, c.kept_cells + 1);
  double warp_nodes_cell = 0;  // in the cloth
  for (const WarpPlace& warp : layout.warps)
    warp_nodes_cell +=
        warp.fibers * c.cell_length() / (c.numerics.element_length * 2 * model.types[static_cast<std::size_t>(warp.type)].radius);
  e.fibers = model.fibers() + weft_fibers * static_cast<std::size_t>(cells_on_loom);
  e.nodes_end = e.nodes_start + static_cast<std::size_t>((weft_nodes_cell + warp_nodes_cell) * cells_on_loom);
  e.steps = e.simulated_time / e.time_step;
  constexpr double bytes = 2.5e7, bytes_per_node = 4000, seconds_per_node_step = 2e-7;  // measured on the shipped cases, one thread
  e.memory = bytes + bytes_per_node * static_cast<double>(e.nodes_end);
  e.wall = e.steps * static_cast<double>(e.nodes_end + e.nodes_start) / 2 * seconds_per_node_step / omp_get_max_threads();
  return e;
}

}  // namespace weave
