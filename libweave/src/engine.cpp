#include "weave/engine.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace weave {
namespace {

constexpr double search_ahead = 0.5;  ///< nodes past this share of the way to a search are searched with those that are due
constexpr double first_step = 1e-12;  ///< [s]
constexpr double step_growth = 1.05;
constexpr int calm_steps_to_grow = 50;
constexpr double frequency_smoothing = 0.02;  ///< weight of one step
constexpr double node_cost = 5;               ///< of a node's bar and motion, in units of a contact at hand, most of which sleep

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Flows& Flows::operator+=(const Flows& o) {
  slip += o.slip;
  damping += o.damping;
  axial += o.axial;
  guides += o.guides;
  tension += o.tension;
  reed += o.reed;
  heddle += o.heddle;
  take_up += o.take_up;
  return *this;
}

Engine::Engine(Model model, State state, const EngineOptions& options)
    : model_(std::move(model)), state_(std::move(state)), options_(options), turning_(model_) {
  options_.outer_skin = std::max(options_.outer_skin, 2 * options_.skin);
  const std::size_t n = model_.nodes();
  force_.assign(n, Vec3::Zero());
  bar_length_.assign(n, 0);
  reach_ahead_.assign(n, 0);
  stiffness_.assign(n, {});
  per_fiber_.resize(model_.fibers());
  for (std::uint32_t f = 0; f < model_.fibers(); ++f) refresh_geometry(f);
  // The first step is too short to move anything: it only shows how stiff the contacts are, and how stiff those that the next step may
  // reach.
  if (state_.dt <= 0) state_.dt = options_.time_step > 0 ? options_.time_step : first_step;
  const bool fresh = state_.x_pick.size() != n;
  if (state_.travel.size() != n) state_.travel.assign(n, 0);
  if (state_.amplitude.size() != n) state_.amplitude.assign(n, 1);
  if (state_.tension.size() != n) state_.tension.assign(n, 0);
  double dt = state_.dt_before;
  if (dt <= 0) {
    double speed2 = 0;
    for (const Vec3& v : state_.v) speed2 = std::max(speed2, v.squaredNorm());
    dt = longest_step(speed2);
  }
  for (std::uint32_t f = 0; f < model_.fibers(); ++f) longest_fiber_ = std::max(longest_fiber_, model_.first[f + 1] - model_.first[f]);
  Workspace work(longest_fiber_);
  for (std::uint32_t f = 0; f < model_.fibers(); ++f) {
    find_ways(f, dt, work);
    look_ahead(f, work);
  }
  if (fresh) {
    state_.moved.assign(n, std::numeric_limits<double>::infinity());
    state_.x_pick = state_.x;
    pick();
  } else {
    index_targets(model_, state_.contacts.active);
    index_targets(model_, state_.contacts.on_reed);
    turning_.align(model_, state_.x_pick, options_.active_x_max);
    turning_.leave_out_untouched(model_, state_.contacts.active);
    share_out();
  }
}

std::pair<Model, State> Engine::release() && {
  return {std::move(model_), std::move(state_)};
}

FiberGeometry Engine::geometry() const {
  return {state_.x, state_.v, state_.travel, reach_ahead_, turning_.rate(), state_.amplitude};
}

/// Picks the contacts that are evaluated, after a search where the list may run out before the next time.
void Engine::pick() {
  const auto start = std::chrono::steady_clock::now();
  const FiberGeometry g = geometry();
  NeighborSearch::note_motion(model_, g, state_.x_pick, options_.outer_skin, options_.active_x_max, state_.moved);
  // Two fibers may each have moved, and may move by half the inner skin until the next pick.
  const double moved_limit = 0.5 * (options_.outer_skin - options_.skin);
  const auto moved_max = [&] {
    const auto nodes = static_cast<std::uint32_t>(model_.nodes());
    double most = 0;
#pragma omp parallel for schedule(static) reduction(max : most)
    for (std::uint32_t p = 0; p < nodes; ++p) {
      if (state_.x[p].x() <= options_.active_x_max && model_.role[model_.fiber_of[p]] != Role::reed) most = std::max(most, state_.moved[p]);
    }
    return most;
  };
  moved_max_ = moved_max();
  if (moved_max_ > moved_limit || state_.contacts.line_of.empty()) {
    neighbor_search_.build(model_, g, options_.outer_skin, options_.active_x_max, search_ahead * moved_limit, state_.moved,
                           state_.contacts);
    ++state_.searches;
    moved_max_ = moved_max();
  }
  pick_active(model_, g, options_.skin, state_.contacts);
  share_out();
  const auto nodes = static_cast<std::uint32_t>(model_.nodes());
#pragma omp parallel for schedule(static)
  for (std::uint32_t p = 0; p < nodes; ++p) state_.x_pick[p] = state_.x[p];
  turning_.align(model_, state_.x_pick, options_.active_x_max);
  turning_.leave_out_untouched(model_, state_.contacts.active);
  ++state_.picks_of_active;
  times_.search += seconds_since(start);
  pick_reed();
}

/// Picks the contacts with the reed. Until the reed has gone half the skin it is picked with the fibers or on its own: from one pick of the
/// reed to the next a fiber may go from one end of its own half skin to the other.
void Engine::pick_reed() {
  const auto start = std::chrono::steady_clock::now();
  pick_on_reed(model_, geometry(), 1.5 * options_.skin, options_.active_x_max, state_.contacts);
  for (std::uint32_t f = 0; f < model_.fibers() && model_.role[f] == Role::reed; ++f) {
    for (std::uint32_t p = model_.first[f]; p <= model_.last(f); ++p) state_.x_pick[p] = state_.x[p];
  }
  times_.search += seconds_since(start);
}

/// Gives each thread a share of the fibers: of reed, warps and wefts each, neighbors together, by nodes and contacts. So most of a fiber's
/// data stay in the cache of one core from step to step. Which thread does what does not change any result.
void Engine::share_out() {
  const auto threads = static_cast<std::size_t>(omp_get_max_threads());
  if (workspace_.size() != threads) workspace_.assign(threads, Workspace(longest_fiber_));
  std::vector<std::vector<std::uint32_t>> of_thread(threads);
  const auto& active = state_.contacts.active;
  const auto cost = [&](std::uint32_t f) { return node_cost * model_.own_nodes(f) + (active.of[f + 1] - active.of[f]); };
  for (const Role role : {Role::reed, Role::warp, Role::weft}) {
    double all = 0, before = 0;
    for (std::uint32_t f = 0; f < model_.fibers(); ++f) all += model_.role[f] == role ? cost(f) : 0;
    for (std::uint32_t f = 0; f < model_.fibers(); ++f) {
      if (model_.role[f] != role) continue;
      const double middle = (before + 0.5 * cost(f)) / all;
      of_thread[std::min(threads - 1, static_cast<std::size_t>(middle * static_cast<double>(threads)))].push_back(f);
      before += cost(f);
    }
  }
  shared_out_.clear();
  shares_ = std::vector<Share>(threads);
  for (std::size_t t = 0; t < threads; ++t) {
    shares_[t].begin = static_cast<std::uint32_t>(shared_out_.size());
    shared_out_.insert(shared_out_.end(), of_thread[t].begin(), of_thread[t].end());
    shares_[t].end = static_cast<std::uint32_t>(shared_out_.size());
  }
}

/// Calls work(fiber) for the fibers of the calling thread's share, then for those of others that have not been begun. `next` counts in each
/// share.
template <typename Work>
void Engine::each_fiber(std::atomic<std::uint32_t> Share::*next, Work&& work) {
  const auto mine = static_cast<std::size_t>(omp_get_thread_num());
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    Share& of = shares_[(mine + i) % shares_.size()];
    const std::uint32_t count = of.end - of.begin;
    while ((of.*next).load(std::memory_order_relaxed) < count) {
      const std::uint32_t k = (of.*next).fetch_add(1, std::memory_order_relaxed);
      if (k < count) work(shared_out_[of.begin + k]);
    }
  }
}

Engine::Extremes& Engine::Extremes::operator|=(const Extremes& o) {
  frequency2 = std::max(frequency2, o.frequency2);
  speed2 = std::max(speed2, o.speed2);
  overlap = std::max(overlap, o.overlap);
  for (std::size_t i = 0; i < moved2.size(); ++i) moved2[i] = std::max(moved2[i], o.moved2[i]);
  finite = finite && o.finite;
  return *this;
}

void Engine::note_extremes(std::uint32_t f, Extremes& extremes) const {
  const PerFiber& sums = per_fiber_[f];
  Extremes of_fiber{sums.frequency2, sums.speed2, sums.contact.overlap_max, {}, sums.finite};
  of_fiber.moved2[model_.role[f] == Role::reed] = sums.moved_pick2;
  extremes |= of_fiber;
}

StepReport Engine::step(const Drive& drive, Ledger* ledger) {
  const bool with_energy = ledger != nullptr;
  const auto fibers = static_cast<std::uint32_t>(model_.fibers());
  const FiberGeometry g = geometry();
  const std::span<double> couple = turning_.couple();
  state_.late_searches += list_is_late_;
  const auto start = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point middle;
#pragma omp parallel num_threads(static_cast <int>(shares_.size()))
  {
    const auto mine = static_cast<std::size_t>(omp_get_thread_num()), team = static_cast<std::size_t>(omp_get_num_threads());
    for (std::size_t t = mine; t < shares_.size(); t += team) {
      shares_[t].next_motion = 0;
      for (std::uint32_t i = shares_[t].begin; i < shares_[t].end && model_.has_friction(); ++i) {
        if (turning_.is_first(shared_out_[i])) turning_.find(model_, shared_out_[i], state_.x, state_.v);
      }
    }
#pragma omp barrier
    each_fiber(&Share::next_contact, [&](std::uint32_t f) {
      PerFiber& sums = per_fiber_[f];
      sums.flows = {};
      for (std::uint32_t p = sums.contact.nodes.begin; p < sums.contact.nodes.end; ++p) couple[p] = 0;
      std::fill(force_.begin() + model_.first[f], force_.begin() + model_.first[f + 1], Vec3::Zero());
      sums.contact = evaluate_contacts(model_, g, f, state_.dt_before, with_energy, state_.contacts, force_, stiffness_, couple);
    });
#pragma omp barrier
#pragma omp master
    middle = std::chrono::steady_clock::now();
    for (std::size_t t = mine; t < shares_.size(); t += team) shares_[t].next_contact = 0;
    Extremes extremes;
    each_fiber(&Share::next_motion, [&](std::uint32_t f) {
      move_fiber(f, drive, with_energy, workspace_[mine]);
      note_extremes(f, extremes);
    });
    shares_[mine].extremes = extremes;
  }
  const auto end = std::chrono::steady_clock::now();
  times_.contact += std::chrono::duration<double>(middle - start).count();
  times_.integrate += std::chrono::duration<double>(end - middle).count();

  StepReport report;
  if (with_energy) {
    *ledger = {};
    ledger->flows = state_.flows;
  }
  Extremes extremes;
  for (Share& share : shares_) {
    extremes |= share.extremes;
    share.extremes = {};
  }
  report.overlap_max = extremes.overlap;
  for (std::uint32_t f = 0; f < fibers; ++f) {
    const PerFiber& sums = per_fiber_[f];
    state_.flows += sums.flows;
    if (model_.role[f] == Role::reed) {
      for (std::uint32_t p = model_.first[f]; p <= model_.last(f); ++p) report.reed_force += force_[p];
    }
    if (with_energy) {
      ledger->kinetic += sums.stored.kinetic;
      ledger->bars += sums.stored.bars;
      ledger->bending += sums.stored.bending;
      ledger->heddle += sums.stored.heddle;
      ledger->contact += sums.contact.energy;
      ledger->friction_store += sums.contact.friction_store;
      ledger->flows += sums.stored.flows;
      ledger->flows.slip += sums.contact.slip_loss;
    }
  }
  state_.time += state_.dt;
  state_.dt_before = state_.dt;
  ++state_.step;
  if (report.overlap_max > options_.overlap_limit) {  // first, as it is what makes the motion run away
    report.status = StepStatus::overlap_too_deep;
  } else if (!extremes.finite || !std::isfinite(extremes.speed2)) {
    report.status = StepStatus::non_finite;
  }
  if (report.status != StepStatus::ok) {
    report.message = describe_failure(report.status);
    return report;
  }
  choose_time_step(extremes.frequency2, extremes.speed2);
  if (options_.time_step > step_limit_) {
    report.status = StepStatus::time_step_too_long;
    report.message = describe_failure(report.status);
    return report;
  }
  const double weight = state_.frequency2 > 0 ? frequency_smoothing : 1;
  state_.frequency2 += weight * (extremes.frequency2 - state_.frequency2);
  auto& [moved_pick2, reed_moved2] = extremes.moved2;
  if (std::sqrt(moved_pick2) > 0.5 * options_.skin) {
    pick();
    moved_pick2 = reed_moved2 = 0;
  } else if (std::sqrt(reed_moved2) > 0.5 * options_.skin) {
    pick_reed();
    reed_moved2 = 0;
  }
  list_is_late_ =
      std::sqrt(std::max(moved_pick2, reed_moved2)) > 0.5 * options_.skin || 2 * moved_max_ + options_.skin > options_.outer_skin;
  return report;
}

/// Longest step that may be taken with a node of the squared speed `speed2`, whatever is touched [s].
double Engine::longest_step(double speed2) const {
  if (options_.time_step > 0) return options_.time_step;
  return speed2 > 0 ? std::min(options_.time_step_max, options_.motion_max / std::sqrt(speed2)) : options_.time_step_max;
}

void Engine::choose_time_step(double frequency2, double speed2) {
  step_limit_ = frequency2 > 0 ? 2 / std::sqrt(frequency2) : options_.time_step_max;
  if (model_.damping > 0) step_limit_ = std::min(step_limit_, 1 / model_.damping);  // beyond it velocities would change their sign
  if (options_.time_step > 0) {
    state_.dt = options_.time_step;
    return;
  }
  const double wanted = std::min(options_.safety * step_limit_, longest_step(speed2));
  if (state_.dt > wanted || state_.step <= 1) {
    state_.dt = wanted;
    state_.calm_steps = 0;
  } else if (wanted > step_growth * state_.dt && ++state_.calm_steps >= calm_steps_to_grow) {
    state_.dt *= step_growth;
    state_.calm_steps = 0;
  }
}

std::string Engine::describe_failure(StepStatus status) const {
  const auto yarn_name = [&](std::uint32_t f) {
    if (model_.role[f] == Role::reed) return std::string("a reed bar");
    return fmt::format("{} {}, fiber {}", model_.role[f] == Role::warp ? "warp yarn" : "weft yarn", model_.yarn[f], model_.place[f]);
  };
  if (status == StepStatus::time_step_too_long) {
    std::uint32_t fastest = 0;
    for (std::uint32_t f = 0; f < model_.fibers(); ++f) {
      if (per_fiber_[f].frequency2 > per_fiber_[fastest].frequency2) fastest = f;
    }
    return fmt::format("step {}, time {:.6g} s: the prescribed time step of {:.4g} s is above the stability limit of {:.4g} s, set by {}",
                       state_.step, state_.time, options_.time_step, step_limit_, yarn_name(fastest));
  }
  for (std::uint32_t f = 0; f < model_.fibers(); ++f) {
    const PerFiber& sums = per_fiber_[f];
    if (status == StepStatus::non_finite && !(sums.finite && std::isfinite(sums.speed2))) {
      for (std::uint32_t p = model_.first[f]; p < model_.first[f + 1]; ++p) {
        if (!state_.x[p].allFinite() || !state_.v[p].allFinite() || state_.v[p].norm() > 1e6) {
          return fmt::format("step {}, time {:.6g} s: the motion is no longer finite at node {} of {}", state_.step, state_.time,
                             p - model_.first[f], yarn_name(f));
        }
      }
      return fmt::format("step {}, time {:.6g} s: the motion runs away in {}", state_.step, state_.time, yarn_name(f));
    }
    if (status == StepStatus::overlap_too_deep && sums.contact.overlap_max > options_.overlap_limit) {
      const std::uint32_t p = sums.contact.node_max;
      const Vec3& x = state_.x_pick[p];  // where it was before it was thrown off
      return fmt::format(
          "step {}, time {:.6g} s: {} is being pushed through {} at x = {:.4g} mm, y = {:.4g} mm, z = {:.4g} mm (overlap {:.2f} of the "
          "distance at touch, limit {:.2f})",
          state_.step, state_.time, yarn_name(f), yarn_name(model_.fiber_of[sums.contact.span_max]), 1e3 * x.x(), 1e3 * x.y(), 1e3 * x.z(),
          sums.contact.overlap_max, options_.overlap_limit);
    }
  }
  return "unknown failure";
}

}  // namespace weave
