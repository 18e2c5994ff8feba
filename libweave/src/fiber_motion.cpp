// The engine's work on a single fiber: its axis, the forces in it, its motion through a step.
#include <algorithm>
#include <cmath>
#include <utility>

#include "weave/engine.hpp"

namespace weave {
namespace {

/// Nodes whose travel is counted together. A bar at hand that follows its closest point stays within a block or goes to the next.
constexpr std::uint32_t block_nodes = 4;
/// Last steps' ways that the next one is trusted not to exceed, where contacts that may be touched are looked for.
constexpr double ways_ahead = 2;
/// Share of the power method in the guess at the fastest oscillation, which would otherwise be even; near 1 it follows single nodes too
/// closely.
constexpr double amplitude_gain = 0.85;
constexpr double rounding = 1e-5;  ///< of the sums of stiffnesses, in single precision

/// What an explicit bar of stiffness k [N/m] and dashpot c [N s/m] counts for in the bound of the step [N/m]. A leapfrog with a dashpot at
/// the speeds of half a step before is stable up to K dt^2 + 2 C dt = 4, for the fastest swing of a chain of such bars between such masses
/// [kg] with K = 4 k / mass and C = 4 c / mass.
double stiffness_with_dashpot(double k, double c, double mass) {
  const double stiff = 4 * k / mass, damped = 4 * c / mass;
  const double frequency = 0.5 * (damped + std::sqrt(damped * damped + 4 * stiff));
  return 0.5 * mass * frequency * frequency;
}

}  // namespace

void Engine::refresh_geometry(std::uint32_t f) {
  const std::uint32_t begin = model_.first[f], last = model_.last(f);
  auto& x = state_.x;
  if (model_.periodic[f]) {
    x[last] = x[begin] + Vec3(0, model_.period_y, 0);
    state_.v[last] = state_.v[begin];
  }
  for (std::uint32_t s = begin; s < last; ++s) bar_length_[s] = (x[s + 1] - x[s]).norm();
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
    const Vec3& tangent = work.bar_tangent[s - begin];
    const double stretch = bar_length_[s] - rest;
    const double inverse_rest = 1 / rest, taut = ea * inverse_rest;
    work.taut_stiffness[s - begin] = taut;
    const double k = taut * (stretch < 0 ? type.compression_factor : 1);
    double& energy = work.bar_energy[s - begin];
    energy = 0.5 * k * stretch * stretch;
    if (with_energy) sums.stored.bars += 0.5 * energy;
    // Sideways a taut bar is a string; along it an explicit bar is a spring.
    const double string = 2 * std::max(k * stretch, 0.0) * inverse_rest;
    work.even_stiffness[s - begin] += string;
    work.even_stiffness[s + 1 - begin] += string;
    if (!model_.implicit_axial) {
      const double rate = (state_.v[s + 1] - state_.v[s]).dot(tangent);
      state_.tension[s] = k * stretch + c * rate;
      const Vec3 on_first = state_.tension[s] * tangent;
      force_[s] += on_first;
      force_[s + 1] -= on_first;
      DirectionalStiffness stiffness;
      stiffness.add(c > 0 ? stiffness_with_dashpot(k, c, type.density * type.area * rest) : 2 * k, tangent);
      work.stiffness[s - begin] += stiffness;
      work.stiffness[s + 1 - begin] += stiffness;
    }
  }
  if (type.bending_stiffness <= 0) return;
  // U = EI/(2 l) |t2 - t1|^2 at every inner node.
  const bool closed = model_.periodic[f];
  for (std::uint32_t p = begin + (closed ? 0 : 1); p < last; ++p) {
    const std::uint32_t before = p == begin ? last - 1 : p - 1;
    const Vec3& t1 = work.bar_tangent[before - begin];
    const Vec3& t2 = work.bar_tangent[p - begin];
    const double inverse1 = work.inverse_length[before - begin], inverse2 = work.inverse_length[p - begin];
    const double b = type.bending_stiffness / (0.5 * (model_.rest_length[before] + model_.rest_length[p]));
    const double cosine = t1.dot(t2);
    const Vec3 g1 = -b * inverse1 * (t2 - cosine * t1);  // dU/d(end of bar 1)
    const Vec3 g2 = -b * inverse2 * (t1 - cosine * t2);  // dU/d(end of bar 2)
    force_[before] += g1;
    force_[before + 1] -= g1;
    force_[p] += g2;
    force_[p + 1] -= g2;
    const double stiffness = 8 * b * inverse2 * inverse2;
    for (const std::uint32_t q : {before, p, p + 1}) work.even_stiffness[q - begin] += stiffness;
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
double Engine::bound_frequency(std::uint32_t p, const DirectionalStiffness& stiffness, double even_stiffness) {
  const double scale = (1 + rounding) * model_.inverse_mass[p];
  double bound = scale * (stiffness.trace() + 3 * even_stiffness);
  if (!(bound < 0.5 * state_.frequency2)) {
    DirectionalStiffness all = stiffness;
    all.add_all_round(even_stiffness);  // 15 % too much where it is alone: a step at the very limit of taut strings overshoots
    bound = scale * all.largest();
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
  touched |= gather_reactions(model_, geometry(), state_.contacts, f, force_, stiffness_);
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

  for (std::uint32_t s = begin; s < last; ++s) {
    work.inverse_length[s - begin] = 1 / bar_length_[s];
    work.bar_tangent[s - begin] = work.inverse_length[s - begin] * (state_.x[s + 1] - state_.x[s]);
  }
  std::fill_n(work.even_stiffness.begin(), last - begin + 1, 0.0);
  add_bar_forces(f, with_energy, work);
  if (model_.end_force[f] != 0) force_[last].x() += model_.end_force[f];
  if (closed) {
    force_[begin] += force_[last];
    work.stiffness[0] += work.stiffness[last - begin];
    work.even_stiffness[0] += work.even_stiffness[last - begin];
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
    sums.frequency2 = std::max(sums.frequency2, bound_frequency(p, work.stiffness[p - begin], work.even_stiffness[p - begin]));
  }
  if (closed) w[last - begin] = w[0];

  const FiberType& type = model_.type_of(f);
  const double ea = type.youngs_modulus * type.area;
  if (model_.implicit_axial) {
    const std::uint32_t bars = last - begin;
    const BarChain chain{closed,
                         ea,
                         type.compression_factor,
                         {work.bar_tangent.data(), bars},
                         {&bar_length_[begin], bars},
                         {&model_.rest_length[begin], bars},
                         {work.inverse_length.data(), bars},
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
    work.bar_energy[s - begin] += state_.tension[s] * work.bar_tangent[s - begin].dot(middle) * kick;
  }

  for (std::uint32_t p = begin; p < end; ++p) {
    const Vec3 before = state_.v[p];
    const Vec3 after = before + w[p - begin];
    const Vec3 middle = 0.5 * (before + after);
    const double m = model_.mass[p];
    if (model_.inverse_mass[p] == 0) {
      // Force that the holder applies, from the balance of the node: -(all others), the implicit part included.
      Vec3 others = force_[p];
      if (model_.implicit_axial && p < last) others += state_.tension[p] * work.bar_tangent[p - begin];
      if (model_.implicit_axial && (p > begin || closed)) {
        const std::uint32_t behind = p > begin ? p - 1 : last - 1;
        others -= state_.tension[behind] * work.bar_tangent[behind - begin];
      }
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
    const double k = work.taut_stiffness[s - begin] * (stretch < 0 ? type.compression_factor : 1);
    const double stored = 0.5 * k * stretch * stretch;
    const double lost = work.bar_energy[s - begin] - stored;
    sums.flows.axial += lost;
    if (!with_energy) continue;
    sums.stored.bars += 0.5 * stored;
    sums.stored.flows.axial += 0.5 * lost;
  }
}

}  // namespace weave
