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
/// Nodes whose travel is counted together. A bar at hand that follows its closest point stays within a block or goes to the next.
constexpr std::uint32_t block_nodes = 16;
constexpr double step_growth = 1.05;
constexpr double ways_ahead =
    2;  ///< last steps' ways that the next one is trusted not to exceed, where contacts that may be touched are looked for
constexpr int calm_steps_to_grow = 50;
/// Share of the power method in the guess at the fastest oscillation, which would otherwise be even; near 1 it follows single nodes too
/// closely.
constexpr double amplitude_gain = 0.85;
constexpr double rounding = 1e-5;             ///< of the sums of stiffnesses, in single precision
constexpr double frequency_smoothing = 0.02;  ///< weight of one step
constexpr double node_cost = 5;               ///< of a node's bar and motion, in units of a contact at hand, most of which sleep

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// What an explicit bar of stiffness k [N/m] and dashpot c [N s/m] counts for in the bound of the step [N/m]. A leapfrog with a dashpot at
/// the speeds of half a step before is stable up to K dt^2 + 2 C dt = 4, for the fastest swing of a chain of such bars between such masses
/// [kg] with K = 4 k / mass and C = 4 c / mass.
double stiffness_with_dashpot(double k, double c, double mass) {
  const double stiff = 4 * k / mass, damped = 4 * c / mass;
  const double frequency = 0.5 * (damped + std::sqrt(damped * damped + 4 * stiff));
  return 0.5 * mass * frequency * frequency;
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
  bar_tangent_.assign(n, Vec3::Zero());
  span_.assign(n, {});
  span_force_.assign(n, {});
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
  return {state_.x, state_.v, span_, state_.travel, reach_ahead_, turning_.rate(), state_.amplitude};
}

void Engine::refresh_geometry(std::uint32_t f) {
  const std::uint32_t begin = model_.first[f], last = model_.last(f);
  auto& x = state_.x;
  if (model_.periodic[f]) {
    x[last] = x[begin] + Vec3(0, model_.period_y, 0);
    state_.v[last] = state_.v[begin];
  }
  for (std::uint32_t s = begin; s < last; ++s) {
    const Vec3 r = x[s + 1] - x[s];
    bar_length_[s] = r.norm();
    bar_tangent_[s] = (1 / bar_length_[s]) * r;
  }
  const Vec3 period(0, model_.period_y, 0);
  for (std::uint32_t p = begin; p < begin + model_.own_nodes(f); ++p) span_[p] = span_at(model_, f, p, x, period);
}

/// Shares the contacts' forces on a fiber's spans out to its nodes: the adjoint of span_at. Leaves none behind.
void Engine::share_out_span_forces(std::uint32_t f, NodeRange touched) {
  const std::uint32_t begin = model_.first[f], last = model_.last(f);
  const auto inner = [&](const SpanForce& s, std::uint32_t before, std::uint32_t here, std::uint32_t after) {
    const Vec3 even = 0.125 * s.on_middle + s.on_curve, odd = 0.5 * s.on_slope;
    force_[before] += even - odd;
    force_[here] += 0.75 * s.on_middle - 2 * s.on_curve;
    force_[after] += even + odd;
  };
  const auto share_out = [&](std::uint32_t p) {
    const SpanForce& s = span_force_[p];
    if (p > begin && p < last) {
      inner(s, p - 1, p, p + 1);
    } else if (model_.periodic[f]) {
      inner(s, last - 1, begin, begin + 1);
    } else if (p == begin) {
      force_[begin] += s.on_middle - s.on_slope;
      force_[begin + 1] += s.on_slope;
    } else {
      force_[last] += s.on_middle + s.on_slope;
      force_[last - 1] -= s.on_slope;
    }
    span_force_[p] = {};
  };
  // The ends first.
  for (const std::uint32_t p : {begin, last}) {
    if (touched.has(p)) share_out(p);
  }
  for (std::uint32_t p = std::max(touched.begin, begin + 1); p < std::min(touched.end, last); ++p) share_out(p);
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

/// Dashpot of a bar, a fraction of the critical one between two node masses; it does not depend on the bar's length [N s/m].
double Engine::axial_damping(const FiberType& type) const {
  return model_.axial_damping * type.area * std::sqrt(2 * type.youngs_modulus * type.density);
}

void Engine::add_bar_forces(std::uint32_t f, bool with_energy, Workspace& work) {
  const FiberType& type = model_.type_of(f);
  const std::uint32_t begin = model_.first[f], last = model_.last(f);
  PerFiber& sums = per_fiber_[f];
  const double ea = type.youngs_modulus * type.area;
  const double c = axial_damping(type);
  for (std::uint32_t s = begin; s < last; ++s) {
    const double rest = model_.rest_length[s];
    const double stretch = bar_length_[s] - rest;
    const double k = ea / rest * (stretch < 0 ? type.compression_factor : 1);
    double& energy = work.bar_energy[s - begin];
    energy = 0.5 * k * stretch * stretch;
    if (with_energy) sums.stored.bars += 0.5 * energy;
    // Sideways a taut bar is a string; along it an explicit bar is a spring.
    DirectionalStiffness stiffness;
    stiffness.add_all_round(2 * std::max(k * stretch, 0.0) / rest);
    if (!model_.implicit_axial) {
      const double rate = (state_.v[s + 1] - state_.v[s]).dot(bar_tangent_[s]);
      state_.tension[s] = k * stretch + c * rate;
      const Vec3 on_first = state_.tension[s] * bar_tangent_[s];
      force_[s] += on_first;
      force_[s + 1] -= on_first;
      stiffness.add(c > 0 ? stiffness_with_dashpot(k, c, type.density * type.area * rest) : 2 * k, bar_tangent_[s]);
    }
    work.stiffness[s - begin] += stiffness;
    work.stiffness[s + 1 - begin] += stiffness;
  }
  if (type.bending_stiffness <= 0) return;
  // U = EI/(2 l) |t2 - t1|^2 at every inner node.
  const bool closed = model_.periodic[f];
  for (std::uint32_t p = begin + (closed ? 0 : 1); p < last; ++p) {
    const std::uint32_t before = p == begin ? last - 1 : p - 1;
    const Vec3& t1 = bar_tangent_[before];
    const Vec3& t2 = bar_tangent_[p];
    const double b = type.bending_stiffness / (0.5 * (model_.rest_length[before] + model_.rest_length[p]));
    const double cosine = t1.dot(t2);
    const Vec3 g1 = -b / bar_length_[before] * (t2 - cosine * t1);  // dU/d(end of bar 1)
    const Vec3 g2 = -b / bar_length_[p] * (t1 - cosine * t2);       // dU/d(end of bar 2)
    force_[before] += g1;
    force_[before + 1] -= g1;
    force_[p] += g2;
    force_[p + 1] -= g2;
    const double stiffness = 8 * b / (bar_length_[p] * bar_length_[p]);
    for (const std::uint32_t q : {before, p, p + 1}) work.stiffness[q - begin].add_all_round(stiffness);
    if (with_energy) sums.stored.bending += b * (1 - cosine);
  }
}

/// Hold of the heddle guide on a node behind the heddle plane: share of the full stiffness, and its slope along x [1/m].
Engine::GuideHold Engine::guide_hold(double x) const {
  const double u = std::clamp((x - model_.guide_x) / model_.guide_ramp, 0.0, 1.0);
  return {u * u * (3 - 2 * u), 6 * u * (1 - u) / model_.guide_ramp};
}

/// Energy stored in a fiber's guides with the heddle at z [J].
double Engine::guide_energy(std::uint32_t f, double z) const {
  double energy = 0;
  for (std::uint32_t p = model_.last(f); p > model_.first[f] && state_.x[p].x() > model_.guide_x; --p) {
    const double dy = state_.x[p].y() - model_.guide_y[f], dz = state_.x[p].z() - z;
    energy += 0.5 * guide_hold(state_.x[p].x()).share * model_.guide_stiffness[f] * (dy * dy + dz * dz);
  }
  return energy;
}

/// Holds the nodes behind the heddle plane on their heddle's line by critically damped springs, taken at the step's end: they follow it
/// and do not swing, and their stiffness does not bound the time step. Adds to the nodes' change of velocity; to be called after the bars'
/// pull.
Engine::GuideWork Engine::hold_in_guides(std::uint32_t f, const Drive& drive, std::span<Vec3> change_of_velocity) {
  const double speed = drive.guide_speed[f], dt = state_.dt, kick = kick_time();
  GuideWork work;
  for (std::uint32_t p = model_.last(f); p > model_.first[f] && state_.x[p].x() > model_.guide_x; --p) {
    const GuideHold hold = guide_hold(state_.x[p].x());
    const double k = hold.share * model_.guide_stiffness[f], m = model_.mass[p];
    const Eigen::Vector2d off(state_.x[p].y() - model_.guide_y[f], state_.x[p].z() - drive.guide_z[f]);
    Vec3& w = change_of_velocity[p - model_.first[f]];
    const Eigen::Vector2d before(state_.v[p].y() + w.y(), state_.v[p].z() + w.z() - speed);
    const Eigen::Vector2d change = (m * before - kick * k * off) / (m + 2 * kick * std::sqrt(k * m) + kick * dt * k) - before;
    work.stored += 0.5 * k * off.squaredNorm();
    const double along = -0.5 * hold.slope * model_.guide_stiffness[f] * off.squaredNorm() * kick;  // as a node that slips out is held less
    w += Vec3(along / m, change.x(), change.y());
    const Vec3 impulse(along, m * change.x(), m * change.y());
    const double from_heddle = impulse.z() * speed;
    per_fiber_[f].flows.heddle += from_heddle;
    work.taken += from_heddle - impulse.dot(state_.v[p] + 0.5 * w);
  }
  return work;
}

/// Longest way of a fiber's nodes in a step of dt, block by block: that of the fastest node in the block itself and in those beside it.
void Engine::find_ways(std::uint32_t f, double dt, Workspace& work) const {
  const std::uint32_t begin = model_.first[f], nodes = model_.first[f + 1] - begin;
  const std::uint32_t blocks = (nodes + block_nodes - 1) / block_nodes;
  for (std::uint32_t b = 0; b < blocks; ++b) {
    double speed2 = 0;
    for (std::uint32_t p = begin + b * block_nodes; p < begin + std::min((b + 1) * block_nodes, nodes); ++p) {
      speed2 = std::max(speed2, state_.v[p].squaredNorm());
    }
    work.block_speed2[b] = speed2;
  }
  const bool closed = model_.periodic[f];
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const std::uint32_t before = b > 0 ? b - 1 : (closed ? blocks - 1 : 0), after = b + 1 < blocks ? b + 1 : (closed ? 0 : b);
    const double speed2 = std::max({work.block_speed2[before], work.block_speed2[b], work.block_speed2[after]});
    work.block_way[b] = std::sqrt(speed2) * dt;
  }
}

/// Adds the last step to the travel of a fiber's nodes.
void Engine::add_travel(std::uint32_t f, Workspace& work) {
  find_ways(f, state_.dt, work);
  const std::uint32_t begin = model_.first[f];
  for (std::uint32_t p = begin; p < model_.first[f + 1]; ++p) state_.travel[p] += work.block_way[(p - begin) / block_nodes];
  look_ahead(f, work);
}

void Engine::look_ahead(std::uint32_t f, const Workspace& work) {
  const std::uint32_t begin = model_.first[f];
  for (std::uint32_t p = begin; p < model_.first[f + 1]; ++p) {
    reach_ahead_[p] = state_.travel[p] + ways_ahead * work.block_way[(p - begin) / block_nodes];
  }
}

/// Bound on the squared frequencies of a node [1/s^2]; where it is far below the largest, a loose one. Takes a step toward the node's
/// amplitude in the fastest oscillation, (1 - gain K/m / omega^2)^-1 of an even one: no guess makes a bound wrong, a good one makes it low.
double Engine::bound_frequency(std::uint32_t p, const DirectionalStiffness& stiffness) {
  const double scale = (1 + rounding) * model_.inverse_mass[p];
  double bound = scale * stiffness.trace();
  if (!(bound < 0.5 * state_.frequency2)) {
    bound = scale * stiffness.largest();
  }
  if (state_.frequency2 > 0) {
    double& amplitude = state_.amplitude[p];
    amplitude = 1 + amplitude_gain * std::min(bound / state_.frequency2, 1.0) * amplitude;
  }
  return bound;
}

/// Takes what the contacts do to a fiber's nodes into the workspace, where the bars add theirs. Leaves none behind.
void Engine::take_contact_stiffness(std::uint32_t f, NodeRange touched, Workspace& work) {
  const std::uint32_t begin = model_.first[f], end = model_.first[f + 1];
  std::fill_n(work.stiffness.begin(), end - begin, DirectionalStiffness{});
  if (touched.empty()) return;
  // A span's neighbors feel it too; of a closed fiber, they may be at its other end.
  const bool closed = model_.periodic[f];
  const std::uint32_t from = closed ? begin : std::max(touched.begin, begin + 1) - 1, to = closed ? end : std::min(touched.end + 1, end);
  for (std::uint32_t p = from; p < to; ++p) work.stiffness[p - begin] = std::exchange(stiffness_[p], {});
}

void Engine::move_fiber(std::uint32_t f, const Drive& drive, bool with_energy, Workspace& work) {
  PerFiber& sums = per_fiber_[f];
  const double slip = sums.flows.slip;
  sums.stored = {};
  sums.frequency2 = sums.moved_pick2 = sums.speed2 = 0;
  sums.finite = true;
  const std::uint32_t begin = model_.first[f], last = model_.last(f), end = begin + model_.own_nodes(f);
  const bool closed = model_.periodic[f];
  const double dt = state_.dt, kick = kick_time();
  NodeRange touched = sums.contact.nodes;
  touched |= gather_reactions(model_, geometry(), state_.contacts, f, span_force_, stiffness_);
  for (std::uint32_t p = begin; p <= last; ++p) force_[p].setZero();
  share_out_span_forces(f, touched);
  take_contact_stiffness(f, touched, work);
  if (model_.has_friction()) turning_.add_forces(f, state_.x, force_);

  if (model_.role[f] == Role::reed) {
    for (std::uint32_t p = begin; p < end; ++p) {
      const double pushed = -0.5 * force_[p].dot(state_.v[p] + drive.reed_velocity) * kick;
      sums.flows.reed += pushed;
      if (with_energy) sums.stored.flows.reed += 0.5 * pushed;
      state_.v[p] = drive.reed_velocity;
      state_.x[p] += dt * drive.reed_velocity;
      sums.moved_pick2 = std::max(sums.moved_pick2, (state_.x[p] - state_.x_pick[p]).squaredNorm());
    }
    sums.speed2 = drive.reed_velocity.squaredNorm();
    refresh_geometry(f);
    add_travel(f, work);
    return;
  }

  add_bar_forces(f, with_energy, work);
  if (model_.end_force[f] != 0) force_[last].x() += model_.end_force[f];
  if (closed) {
    force_[begin] += force_[last];
    work.stiffness[0] += work.stiffness[last - begin];
  }

  // Change of velocity without the implicit terms.
  const std::span<Vec3> w = std::span(work.change).first(last - begin + 1);
  for (std::uint32_t p = begin; p < end; ++p) {
    if (model_.inverse_mass[p] == 0) {
      w[p - begin] = drive.held_velocity - state_.v[p];
      continue;
    }
    force_[p] -= model_.damping * model_.mass[p] * state_.v[p];
    w[p - begin] = kick * model_.inverse_mass[p] * force_[p];
    sums.frequency2 = std::max(sums.frequency2, bound_frequency(p, work.stiffness[p - begin]));
  }
  if (closed) w[last - begin] = w[0];

  const FiberType& type = model_.type_of(f);
  const double ea = type.youngs_modulus * type.area;
  if (model_.implicit_axial) {
    const std::uint32_t bars = last - begin;
    const BarChain chain{closed,
                         ea,
                         type.compression_factor,
                         {&bar_tangent_[begin], bars},
                         {&bar_length_[begin], bars},
                         {&model_.rest_length[begin], bars},
                         {&model_.inverse_mass[begin], bars + 1},
                         {&state_.v[begin], bars + 1}};
    work.tensions.pull(chain, dt, kick, w, {&state_.tension[begin], bars});
  }
  const bool guided = model_.guide_stiffness[f] > 0;
  double guide_loss = 0;
  if (guided) {
    const GuideWork held = hold_in_guides(f, drive, w);
    guide_loss = held.taken + held.stored;
    if (with_energy) {
      sums.stored.heddle = 0.5 * held.stored;
      sums.stored.flows.heddle = 0.5 * sums.flows.heddle;
    }
  }
  for (std::uint32_t s = begin; s < last; ++s) {
    // What the bars take from the nodes, at the middle of the velocity's change; less what they store, it is lost (below).
    const Vec3 middle = state_.v[s + 1] - state_.v[s] + 0.5 * (w[s + 1 - begin] - w[s - begin]);
    work.bar_energy[s - begin] += state_.tension[s] * bar_tangent_[s].dot(middle) * kick;
  }

  for (std::uint32_t p = begin; p < end; ++p) {
    const Vec3 before = state_.v[p];
    const Vec3 after = before + w[p - begin];
    const Vec3 middle = 0.5 * (before + after);
    const double m = model_.mass[p];
    if (model_.inverse_mass[p] == 0) {
      // Force that the holder applies, from the balance of the node: -(all others), the implicit part included.
      Vec3 others = force_[p];
      if (model_.implicit_axial && p < last) others += state_.tension[p] * bar_tangent_[p];
      if (model_.implicit_axial && p > begin) others -= state_.tension[p - 1] * bar_tangent_[p - 1];
      const double taken_up = (m * w[p - begin] - kick * others).dot(middle);
      sums.flows.take_up += taken_up;
      if (with_energy) sums.stored.flows.take_up += 0.5 * taken_up;
    }
    if (model_.inverse_mass[p] != 0) {
      const double lost = model_.damping * m * before.dot(middle) * kick;
      sums.flows.damping += lost;
      if (with_energy) sums.stored.flows.damping += 0.5 * lost;
    }
    if (with_energy) sums.stored.kinetic += 0.25 * m * (before.squaredNorm() + after.squaredNorm());
    if (p == last && model_.end_force[f] != 0) {
      const double pulled = model_.end_force[f] * middle.x() * kick;
      sums.flows.tension += pulled;
      if (with_energy) sums.stored.flows.tension += 0.5 * pulled;
    }
    state_.v[p] = after;
    state_.x[p] += dt * after;
    const double moved2 = (state_.x[p] - state_.x_pick[p]).squaredNorm();
    if (!(moved2 < 1e12)) sums.finite = false;
    if (state_.x[p].x() <= options_.active_x_max) sums.moved_pick2 = std::max(sums.moved_pick2, moved2);
    sums.speed2 = std::max(sums.speed2, after.squaredNorm());
  }
  sums.flows.slip = slip + sums.contact.slip_loss;
  refresh_geometry(f);
  add_travel(f, work);
  if (guided) {
    const double stored = guide_energy(f, drive.guide_z[f] + drive.guide_speed[f] * dt);
    guide_loss -= stored;
    sums.flows.guides += guide_loss;
    if (with_energy) {
      sums.stored.heddle += 0.5 * stored;
      sums.stored.flows.guides = 0.5 * guide_loss;
    }
  }
  for (std::uint32_t s = begin; s < last; ++s) {
    const double stretch = bar_length_[s] - model_.rest_length[s];
    const double k = ea / model_.rest_length[s] * (stretch < 0 ? type.compression_factor : 1);
    const double stored = 0.5 * k * stretch * stretch;
    const double lost = work.bar_energy[s - begin] - stored;
    sums.flows.axial += lost;
    if (!with_energy) continue;
    sums.stored.bars += 0.5 * stored;
    sums.stored.flows.axial += 0.5 * lost;
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
      sums.contact = evaluate_contacts(model_, g, f, state_.dt_before, with_energy, state_.contacts, span_force_, stiffness_, couple);
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
