#include "weave/contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace weave {
namespace {

constexpr int walk_limit = 50;
/// Two bars are equally close at the vertex they share: the one at hand is kept against round-off, as their angles, and shares, differ.
constexpr double nearer = 1 - 1e-9;

/// Reactions that are asked for ahead of their turn, since they lie apart in memory.
constexpr std::uint32_t fetch_ahead = 12;
/// Of the line law on the length of fiber, half a diameter at most, that a point between two yarns stands for.
constexpr int samples = 4;

struct Step {
  bool exists = false;
  std::uint32_t segment = 0;
  std::int32_t wrap = 0;  ///< periods by which the fiber's own coordinates fall short after passing its seam
};

Step next_bar(const Model& m, std::uint32_t s) {
  const std::uint32_t f = m.fiber_of[s];
  if (s + 1 < m.last(f)) return {true, s + 1, 0};
  return {m.periodic[f] != 0, m.first[f], 1};
}

Step previous_bar(const Model& m, std::uint32_t s) {
  const std::uint32_t f = m.fiber_of[s];
  if (s > m.first[f]) return {true, s - 1, 0};
  return {m.periodic[f] != 0, m.last(f) - 1, -1};
}

struct OnBar {
  double raw, fraction;  ///< unclamped and clamped to the bar
  Vec3 separation;
  double distance2;
};

inline OnBar nearest_on_bar(const FiberGeometry& g, const Vec3& point, std::uint32_t s, double shift) {
  Vec3 r = point - g.x[s];
  r.y() -= shift;
  const double along = r.dot(g.bar_tangent[s]);
  const double clamped = std::clamp(along, 0.0, g.bar_length[s]);
  r -= clamped * g.bar_tangent[s];
  return {along * g.bar_inverse[s], clamped * g.bar_inverse[s], r, r.squaredNorm()};
}

double stored_in(const FrictionSpring& f) {
  return f.stiffness > 0 ? 0.5 * (f.along * f.along + f.across * f.across) / f.stiffness : 0;
}

void release(FrictionSpring& f, double& lost) {
  lost += stored_in(f);
  f = {};
}

/// Relative motion of a contact's two fibers during the last step.
struct Slip {
  double along_a = 0, along_b = 0;  ///< of the material of a on b, along a's bar and along b's [m]
  double cosine = 0;                ///< between the two bars
  double arm_a = 0, arm_b = 0;      ///< distance / length of the bar: a turning bar slips by the distance from its axis
  [[nodiscard]] double across() const { return along_a - cosine * along_b; }
  [[nodiscard]] double sine2() const { return 1 - cosine * cosine; }
};

/// A place on a bar: its first node and the fraction along it.
struct Place {
  std::uint32_t bar;
  double fraction;
};

/// Slip of a point of bar a on bar b over a time dt, for the unit normal n from b to a.
inline Slip slip_of(const FiberGeometry& g, const Place& a, const Place& b, const Vec3& n, double distance, double dt) {
  const Vec3 &ta = g.bar_tangent[a.bar], &tb = g.bar_tangent[b.bar];
  const Vec3 dva = g.v[a.bar + 1] - g.v[a.bar], dvb = g.v[b.bar + 1] - g.v[b.bar];
  const Vec3 relative = g.v[a.bar] + a.fraction * dva - g.v[b.bar] - b.fraction * dvb;
  Slip slip;
  slip.arm_a = distance * g.bar_inverse[a.bar];
  slip.arm_b = distance * g.bar_inverse[b.bar];
  slip.cosine = ta.dot(tb);
  slip.along_a = dt * (relative.dot(ta) + slip.arm_a * n.dot(dva));
  slip.along_b = dt * (relative.dot(tb) + slip.arm_b * n.dot(dvb));
  return slip;
}

/// The same for a node of fiber a, which only slips along b: a's fiber runs beside it.
inline Slip slip_of_node(const FiberGeometry& g, std::uint32_t node, const Place& b, const Vec3& n, double distance, double dt) {
  const Vec3& tb = g.bar_tangent[b.bar];
  const Vec3 dvb = g.v[b.bar + 1] - g.v[b.bar];
  Slip slip;
  slip.arm_b = distance * g.bar_inverse[b.bar];
  slip.along_b = dt * ((g.v[node] - g.v[b.bar] - b.fraction * dvb).dot(tb) + slip.arm_b * n.dot(dvb));
  slip.along_a = slip.along_b;
  slip.cosine = 1;
  return slip;
}

/// Moves a spring by a slip, with Coulomb's cap on the force [N]. Lost is the work done on the spring, by the trapezoidal rule as the motion
/// has it, that the spring does not store. The force is kept while the contact hardens, the slip while it softens, so that neither makes
/// energy (Thornton & Randall 1988).
inline void slide(FrictionSpring& spring, const Slip& slip, double stiffness, double cap, double& lost) {
  const double softness = spring.stiffness > 0 ? 1 / spring.stiffness : 0;
  const double share = spring.stiffness > 0 ? std::min(stiffness * softness, 1.0) : 0;
  double f = spring.along * share - stiffness * slip.along_b, a = spring.across * share - stiffness * slip.across();
  const double force2 = f * f + slip.sine2() * a * a;
  if (force2 > cap * cap) {
    const double back = cap / std::sqrt(force2);
    f *= back;
    a *= back;
  }
  lost += 0.5 * ((spring.along * spring.along + spring.across * spring.across) * softness - (f * f + a * a) / stiffness -
                 (spring.along + f) * slip.along_b - (spring.across + a) * slip.across());
  spring = {f, a, stiffness};
}

/// Lets a spring go as the fibers part: its force has acted in the first half of the last step.
void part(FrictionSpring& spring, const Slip& slip, double& lost) {
  lost -= 0.5 * (spring.along * slip.along_b + spring.across * slip.across());
  release(spring, lost);
}

/// Force of a spring on fiber a, and the couples by which it turns the bars: a couple pushes a bar's second node, and the first one back.
struct Drag {
  Vec3 force, couple_a, couple_b;
};

inline Drag drag_of(const FrictionSpring& spring, const Slip& slip, const Vec3& ta, const Vec3& tb, const Vec3& n) {
  const double along_b = spring.along - slip.cosine * spring.across;
  return {along_b * tb + spring.across * ta, spring.across * slip.arm_a * n, along_b * slip.arm_b * n};
}

void note_overlap(double ratio, std::uint32_t node, std::uint32_t segment, ContactSums& sums) {
  if (ratio <= sums.overlap_max) return;
  sums.overlap_max = ratio;
  sums.node_max = node;
  sums.segment_max = segment;
}

using Samples = Eigen::Array<double, samples, 1>;

/// Places of the samples about their point, in shares of the length that the point stands for.
Samples sample_offsets() { return Samples::LinSpaced(0.5 / samples - 0.5, 0.5 - 0.5 / samples); }
constexpr double last_offset = 0.5 - 0.5 / samples;

struct Target {
  const Model& model;
  const FiberGeometry& g;
  std::uint32_t fiber;
  double dt;
  bool with_energy;
  std::span<Vec3> force;
  std::span<DirectionalStiffness> stiffness;
  Samples offsets = sample_offsets();
};

/// Whether the closest points of all that lies within sqrt(distance2) of a bar, beside its stretch low...high [m], are on that bar: a point at
/// distance r from it is nearer to the next bar if it lies within r tan(phi/2) of their vertex, with phi the angle of the two.
inline bool nearest_on_this_bar(const FiberGeometry& g, std::uint32_t s, double low, double high, double distance2) {
  const double left = g.bar_length[s] - high;
  return low >= 0 && left >= 0 && low * low >= g.bend2[s] * distance2 && left * left >= g.bend2[s + 1] * distance2;
}

/// Closest point of the touched fiber to a point, from the bar at hand; the fiber is walked along only where another bar may be nearer.
inline PolylinePoint follow(const Model& m, const FiberGeometry& g, const Vec3& point, std::uint32_t& segment, std::int32_t& image) {
  Vec3 r = point - g.x[segment];
  r.y() -= image * m.period_y;
  const Vec3& t = g.bar_tangent[segment];
  const double along = r.dot(t);
  r -= along * t;
  const double distance2 = r.squaredNorm();
  if (!nearest_on_this_bar(g, segment, along, along, distance2)) return walk_to_point(m, g, point, segment, image);
  return {along * g.bar_inverse[segment], r, distance2};
}

/// From the touched fiber to the point; short where their axes cross, so that it stays finite.
inline Vec3 unit_normal(const PairLaw& law, const PolylinePoint& q, double distance) {
  return (1 / std::max(distance, 1e-3 * law.reach)) * q.separation;
}

inline ContactStiffness stiffness_along(const Vec3& n, double normal, double friction, bool all_round) {
  return {n.cast<float>(), static_cast<float>(normal), static_cast<float>(friction), all_round};
}

/// Normal force of a contact, summed over its samples.
struct NormalSum {
  Vec3 on_first = Vec3::Zero(), on_second = Vec3::Zero();  ///< on the nodes of the point's bar [N]
  double stiffness = 0;                                    ///< sum of slopes [N/m]
  double bound = 0;                                        ///< on the stiffness along the normal that a node can feel [N/m]
  double gap = 0;                                          ///< where nothing touches: the smallest of a sample [m]
};

/// Pushes one sample of a contact, a share `weight` [m] of fiber at `eta` on the point's bar, off its closest point q on the bar `segment`.
inline void push(const Target& at, const PairLaw& law, const PolylinePoint& q, double weight, double eta, std::uint32_t node,
                 std::uint32_t segment, Reaction& reaction, NormalSum& sum, ContactSums& sums) {
  const double distance = std::sqrt(q.distance2);
  const double overlap = law.reach - distance, ratio = overlap * law.inverse_reach;
  const auto [force, stiffness] = law.line_response(overlap);
  const Vec3 pull = weight * force / std::max(distance, 1e-3 * law.reach) * q.separation;
  const double bound = weight * stiffness * (1 + ratio);
  sum.on_first += (1 - eta) * pull;
  sum.on_second += eta * pull;
  sum.stiffness += weight * stiffness;
  sum.bound += bound;
  if (!reaction.active) reaction = {Vec3::Zero(), Vec3::Zero(), stiffness_along(unit_normal(law, q, distance), 0, 0, false), static_cast<float>(q.fraction), segment, true};
  reaction.on_first -= (1 - q.fraction) * pull;
  reaction.on_second -= q.fraction * pull;
  reaction.stiffness.normal += static_cast<float>(bound);
  note_overlap(ratio, node, segment, sums);
  if (at.with_energy) sums.energy += weight * law.line_energy(overlap);
}

/// All samples of a contact at once where their closest points lie on one bar: on straight bars the separation is r0 + t u, with t along the
/// point's bar and u the part of that bar normal to the touched one. False, with nothing done, where another bar may be nearer.
inline bool push_samples_on_bar(const Target& at, const LineContact& c, const PairLaw& law, const PolylinePoint& q, double weight,
                                Reaction& reaction, NormalSum& sum, ContactSums& sums) {
  const FiberGeometry& g = at.g;
  const std::uint32_t s = c.segment;
  const Vec3 along = g.x[c.node + 1] - g.x[c.node];
  const double shift = along.dot(g.bar_tangent[s]), cell = 1.0 / at.model.points[at.fiber];
  const Vec3 u = along - shift * g.bar_tangent[s];
  const double r0u = q.separation.dot(u), u2 = u.squaredNorm();
  const double last = last_offset * cell, spread = last * std::abs(shift), middle = q.fraction * g.bar_length[s];
  const double farthest2 = q.distance2 + 2 * last * std::abs(r0u) + last * last * u2;
  if (!nearest_on_this_bar(g, s, middle - spread, middle + spread, farthest2)) return false;

  const double w = weight / samples * law.line;
  const Samples t = cell * at.offsets;
  const Samples r = (q.distance2 + t * (2 * r0u + u2 * t)).sqrt(), overlap = (law.reach - r).max(0);
  const double deepest = overlap.maxCoeff();
  if (deepest <= 0) {
    sum.gap = r.minCoeff() - law.reach;
    return true;
  }
  const Samples slope = w * overlap.sqrt() / r, per_r = slope * overlap / r;  // of the force and of its share of the separation
  const double force_0 = per_r.sum(), force_1 = (per_r * t).sum(), force_2 = (per_r * t * t).sum();
  const double stiffness = 1.5 * slope.sum(), bound = 1.5 * (slope * (1 + law.inverse_reach * overlap)).sum();
  if (at.with_energy) {
    for (const double o : overlap) sums.energy += weight / samples * law.line_energy(o);
  }
  const Vec3 pull = force_0 * q.separation + force_1 * u, moment = force_1 * q.separation + force_2 * u;
  const double eta = c.fraction, xi = q.fraction, turn = shift * g.bar_inverse[s];
  sum = {(1 - eta) * pull - moment, eta * pull + moment, stiffness, bound, 0};
  reaction = {turn * moment - (1 - xi) * pull, -turn * moment - xi * pull, stiffness_along(pull.normalized(), bound, 0, true), static_cast<float>(xi), s, true};
  note_overlap(deepest * law.inverse_reach, c.node, s, sums);
  return true;
}

/// The samples of a contact between two yarns: the law is integrated over the length of fiber that the point stands for, as its closest points
/// lie, so that a crossing is felt alike wherever it is between two points. They may lie on the bar at hand and on one beside it.
inline NormalSum push_samples(const Target& at, const LineContact& c, const PairLaw& law, const PolylinePoint& q, double weight,
                              std::span<Reaction, 2> reaction, ContactSums& sums) {
  const FiberGeometry& g = at.g;
  NormalSum sum;
  if (push_samples_on_bar(at, c, law, q, weight, reaction[0], sum, sums)) return sum;
  const Vec3 along = g.x[c.node + 1] - g.x[c.node];
  const double cell = 1.0 / at.model.points[at.fiber];
  double nearest2 = std::numeric_limits<double>::infinity();
  for (int k = 0; k < samples; ++k) {
    const double eta = c.fraction + at.offsets[k] * cell;
    std::uint32_t segment = c.segment;
    std::int32_t image = c.image;
    const PolylinePoint at_sample = follow(at.model, g, g.x[c.node] + eta * along, segment, image);
    nearest2 = std::min(nearest2, at_sample.distance2);
    if (at_sample.distance2 >= law.reach * law.reach) continue;
    Reaction& on_bar = reaction[segment == c.segment ? 0 : 1];
    if (on_bar.active && on_bar.segment != segment) continue;
    push(at, law, at_sample, weight / samples, eta, c.node, segment, on_bar, sum, sums);
  }
  sum.gap = std::sqrt(nearest2) - law.reach;
  return sum;
}

/// `before`: the contact evaluated before this one, or none.
void line_contact(const Target& at, LineContact& c, FrictionSpring& spring, const LineContact* before, std::span<Reaction, 2> reaction,
                  ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  const std::uint32_t p = c.node, other = m.fiber_of[c.segment];
  const PairLaw& law = m.pair_law(at.fiber, other);
  const PolylinePoint q = follow(m, g, contact_point(g, c), c.segment, c.image);
  const bool one_yarn = meets_at_nodes(m, at.fiber, other);
  const bool on_reed = m.role[other] == Role::reed;
  const double weight = share_of_points(m, at.fiber, other) * (one_yarn ? m.tributary[p] : m.point_length[at.fiber]);
  // Two contacts of one point, each followed along a bent fiber from a place of its own, have met: then the first counts alone.
  if (before != nullptr && bars_apart(m, *before, c) <= 1) return release(spring, sums.slip_loss);
  if (other == at.fiber && within_own_bend(m, at.fiber, c.node, c.segment, c.image)) return release(spring, sums.slip_loss);
  const double distance = std::sqrt(q.distance2);
  const double gap = distance - touch_reach(m, at.fiber, other);
  // What the fibers may come nearer by in the next step.
  const double approach = g.reach_ahead[p] - g.travel[p] + g.reach_ahead[c.segment] - g.travel[c.segment];
  const bool held = spring.stiffness > 0;
  if (gap >= approach && !held) return let_sleep(g, gap, c);
  const Vec3 n = unit_normal(law, q, distance);
  NormalSum normal;
  normal.gap = gap;
  if (one_yarn) {
    if (gap < 0) push(at, law, q, weight, 0, p, c.segment, reaction[0], normal, sums);
  } else if (gap < approach) {
    normal = push_samples(at, c, law, q, weight, reaction, sums);
  }
  const bool touches = normal.stiffness > 0;
  if (!touches && !held) {
    let_sleep(g, normal.gap, c);
    const double overlap = approach - normal.gap;
    if (overlap <= 0) return;
    // The next step is already chosen, and they may overlap by so much after it: the one after that has to be short enough.
    const double k = weight * law.line_stiffness(std::min(overlap, 0.5 * law.reach));
    at.stiffness[p].add(k, n);
    if (!one_yarn) at.stiffness[p + 1].add(k, n);
    return;
  }
  sums.touching += touches;
  const double friction_stiffness = m.friction * normal.stiffness;
  const Vec3 pushed = normal.on_first + normal.on_second;
  // A reed bar does not give way, which halves what its touch adds to a frequency.
  const double share = on_reed ? 0.5 : 1;
  const ContactStiffness felt = stiffness_along(touches ? Vec3(pushed.normalized()) : n, share * normal.bound, share * friction_stiffness, !one_yarn);
  if (m.friction > 0) {
    const Place on_b{c.segment, q.fraction};
    const Slip slip = one_yarn ? slip_of_node(g, p, on_b, n, distance, at.dt) : slip_of(g, {p, c.fraction}, on_b, n, distance, at.dt);
    if (!touches) return part(spring, slip, sums.slip_loss);
    // Beside the middle of a crossing the samples also push along the fiber, which is no normal force of the two fibers.
    const double along = pushed.dot(g.bar_tangent[p]);
    const double normal_force = std::sqrt(std::max(pushed.squaredNorm() - along * along, 0.0));
    slide(spring, slip, friction_stiffness, m.friction * normal_force, sums.slip_loss);
    const Drag drag = drag_of(spring, slip, g.bar_tangent[p], g.bar_tangent[c.segment], n);
    const double eta = c.fraction;
    normal.on_first += (1 - eta) * drag.force - drag.couple_a;
    normal.on_second += eta * drag.force + drag.couple_a;
    if (!reaction[0].active) reaction[0] = {Vec3::Zero(), Vec3::Zero(), felt, static_cast<float>(q.fraction), c.segment, true};
    reaction[0].on_first -= (1 - q.fraction) * drag.force + drag.couple_b;
    reaction[0].on_second -= q.fraction * drag.force - drag.couple_b;
    reaction[0].stiffness.friction = felt.friction;
    reaction[0].stiffness.all_round = felt.all_round;
    if (at.with_energy) sums.friction_store += stored_in(spring);
  }
  const Vec3& touched = g.bar_tangent[c.segment];
  at.force[p] += normal.on_first;
  felt.add_to(at.stiffness[p], 1 - c.fraction, touched);
  if (!one_yarn) {
    at.force[p + 1] += normal.on_second;
    felt.add_to(at.stiffness[p + 1], c.fraction, touched);
  }
}

/// Node-to-node law of Yang 2015, eq. (3)-(7), kept to compare with: force along the part of the node-to-node vector normal to each
/// fiber's own tangent. Action and reaction differ where fibers cross.
void node_contact(const Target& at, LineContact& c, FrictionSpring& spring, Reaction& reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  const PolylinePoint q = walk_to_point(m, g, g.x[c.node], c.segment, c.image);
  const PairLaw& law = m.pair_law(at.fiber, m.fiber_of[c.segment]);
  const std::uint32_t p = c.node, s = c.segment;
  const std::uint32_t other = q.fraction < 0.5 ? s : s + 1;
  Vec3 r = g.x[p] - g.x[other];
  r.y() -= c.image * m.period_y;
  const Vec3 to_p = r - r.dot(g.node_tangent[p]) * g.node_tangent[p];
  const Vec3 to_q = r - r.dot(g.node_tangent[other]) * g.node_tangent[other];
  const double distance = to_p.norm();
  if (distance >= law.reach) return release(spring, sums.slip_loss);
  const double overlap = law.reach - distance;
  note_overlap(overlap / law.reach, p, s, sums);
  ++sums.touching;
  const double weight = 0.5 * m.tributary[p];
  const auto [force, stiffness] = law.line_response(overlap);
  const double fn = weight * force, kn = weight * stiffness;
  Vec3 on_node = fn / std::max(distance, 1e-3 * law.reach) * to_p;
  Vec3 on_other = -fn / std::max(to_q.norm(), 1e-3 * law.reach) * to_q;
  if (m.friction > 0) {
    const Vec3& t = g.node_tangent[other];
    const double slip = (g.v[p] - g.v[other]).dot(t) * at.dt;
    slide(spring, {.along_a = slip, .along_b = slip, .cosine = 1}, m.friction * kn, m.friction * fn, sums.slip_loss);
    on_node += spring.along * t;
    on_other -= spring.along * t;
  }
  const Vec3& touched = g.bar_tangent[s];
  const double normal_stiffness = kn * (1 + overlap / law.reach);
  const ContactStiffness felt = stiffness_along(to_p / std::max(distance, 1e-3 * law.reach), normal_stiffness, m.friction * kn, false);
  at.force[p] += on_node;
  felt.add_to(at.stiffness[p], 1, touched);
  const ContactStiffness felt_there = stiffness_along(to_q / std::max(to_q.norm(), 1e-3 * law.reach), normal_stiffness, m.friction * kn, false);
  const bool at_first = other == s;
  reaction = {at_first ? on_other : Vec3::Zero(), at_first ? Vec3::Zero() : on_other, felt_there, at_first ? 0.0F : 1.0F, s, true};
  if (at.with_energy) sums.energy += weight * law.line_energy(overlap);
}

/// Asks for the cache lines of an object that is used soon.
template <typename T>
void fetch(const T& object) {
  const auto* bytes = reinterpret_cast<const char*>(&object);
  __builtin_prefetch(bytes);
  __builtin_prefetch(bytes + sizeof(T) - 1);
}

void add_reaction(const Reaction& r, const Vec3& tangent, std::span<Vec3> force, std::span<DirectionalStiffness> stiffness) {
  force[r.segment] += r.on_first;
  force[r.segment + 1] += r.on_second;
  r.stiffness.add_to(stiffness[r.segment], 1 - r.fraction, tangent);
  r.stiffness.add_to(stiffness[r.segment + 1], r.fraction, tangent);
}

}  // namespace

void let_sleep(const FiberGeometry& g, double gap, LineContact& c) {
  c.asleep_until = g.travel[c.node] + g.travel[c.segment] + gap;
}

std::int64_t bars_apart(const Model& m, const LineContact& a, const LineContact& b) {
  const std::uint32_t f = m.fiber_of[a.segment];
  constexpr auto none = std::numeric_limits<std::int64_t>::max();
  if (a.node != b.node || a.fraction != b.fraction || f != m.fiber_of[b.segment]) return none;
  if (!m.periodic[f] && a.image != b.image) return none;
  return std::abs(static_cast<std::int64_t>(a.segment) - b.segment + static_cast<std::int64_t>(a.image - b.image) * m.own_nodes(f));
}

double share_of_points(const Model& m, std::uint32_t a, std::uint32_t b) {
  if (m.role[b] == Role::reed) return 1;
  if (a == b || m.node_contact) return 0.5;
  const auto name = [&](std::uint32_t f) { return std::pair(m.yarn[f], m.place[f]); };
  const bool even = (m.yarn[a] + m.place[a] + m.yarn[b] + m.place[b]) % 2 == 0;
  return (name(a) == name(b) ? a < b : name(a) < name(b)) == even ? 1 : 0;
}

bool meets_at_nodes(const Model& m, std::uint32_t fiber_a, std::uint32_t fiber_b) {
  if (m.role[fiber_b] == Role::reed) return false;
  return m.node_contact || (m.yarn[fiber_a] == m.yarn[fiber_b] && m.role[fiber_a] == m.role[fiber_b]);
}

double touch_reach(const Model& m, std::uint32_t fiber, std::uint32_t other) {
  return m.pair_law(fiber, other).reach + (meets_at_nodes(m, fiber, other) ? 0 : last_offset * m.point_length[fiber]);
}

Vec3 contact_point(const FiberGeometry& g, const LineContact& c) {
  if (c.fraction == 0) return g.x[c.node];
  return g.x[c.node] + double{c.fraction} * (g.x[c.node + 1] - g.x[c.node]);
}

bool within_own_bend(const Model& m, std::uint32_t fiber, std::uint32_t node, std::uint32_t segment, std::int32_t image) {
  if (!m.periodic[fiber] && image != 0) return false;
  const std::int64_t bars = static_cast<std::int64_t>(segment) - node + static_cast<std::int64_t>(image) * m.own_nodes(fiber);
  const double arc = static_cast<double>(std::abs(bars) - 1) * m.rest_length[m.first[fiber]];
  return arc < 2 * std::numbers::pi * m.type_of(fiber).radius;
}

PolylinePoint walk_to_point(const Model& m, const FiberGeometry& g, const Vec3& point, std::uint32_t& segment, std::int32_t& image) {
  OnBar here = nearest_on_bar(g, point, segment, image * m.period_y);
  for (int i = 0; i < walk_limit; ++i) {
    const double along = here.raw * g.bar_length[segment];
    if (nearest_on_this_bar(g, segment, along, along, here.distance2)) break;
    const Step to = here.raw < 0.5 ? previous_bar(m, segment) : next_bar(m, segment);
    if (!to.exists) break;
    const OnBar there = nearest_on_bar(g, point, to.segment, (image + to.wrap) * m.period_y);
    if (there.distance2 >= nearer * here.distance2) break;
    here = there;
    segment = to.segment;
    image += to.wrap;
  }
  return {here.fraction, here.separation, here.distance2};
}

ContactSums evaluate_contacts(const Model& model, const FiberGeometry& geometry, std::uint32_t fiber, double dt, bool with_energy,
                              ContactList& contacts, std::span<Vec3> force, std::span<DirectionalStiffness> stiffness) {
  ContactSums sums;
  const Target at{model, geometry, fiber, dt, with_energy, force, stiffness, sample_offsets()};
  std::array<Reaction, 2> reaction;
  for (ActiveContacts* active : {&contacts.active, &contacts.on_reed}) {
    const LineContact* before = nullptr;
    std::uint32_t slot = 2 * active->of[fiber];
    for (std::uint32_t i = active->of[fiber]; i < active->of[fiber + 1]; ++i) {
      LineContact& contact = active->line[i];
      active->reacts[i] = 0;
      if (geometry.reach_ahead[contact.node] + geometry.reach_ahead[contact.segment] < contact.asleep_until) continue;
      if (model.node_contact && active == &contacts.active) {
        node_contact(at, contact, active->spring[i], reaction[0], sums);
      } else {
        line_contact(at, contact, active->spring[i], before, reaction, sums);
        before = &contact;
      }
      active->slot[i] = slot;
      for (Reaction& r : reaction) {
        if (!r.active) continue;
        active->reaction[slot++] = r;
        ++active->reacts[i];
        r.active = false;
      }
    }
  }
  return sums;
}

void gather_reactions(const Model& model, const FiberGeometry& geometry, const ContactList& contacts, std::uint32_t fiber, std::span<Vec3> force,
                      std::span<DirectionalStiffness> stiffness) {
  const ActiveContacts& active = model.role[fiber] == Role::reed ? contacts.on_reed : contacts.active;
  const std::uint32_t end = active.target_of[fiber + 1];
  for (std::uint32_t i = active.target_of[fiber]; i < end; ++i) {
    if (i + fetch_ahead < end) {
      if (const std::uint32_t ahead = active.target[i + fetch_ahead]; active.reacts[ahead] > 0) fetch(active.reaction[active.slot[ahead]]);
    }
    const std::uint32_t at = active.target[i];
    if (active.reacts[at] == 0) continue;
    for (std::uint32_t k = active.slot[at]; k < active.slot[at] + active.reacts[at]; ++k) {
      const Reaction& reaction = active.reaction[k];
      add_reaction(reaction, geometry.bar_tangent[reaction.segment], force, stiffness);
    }
  }
}

}  // namespace weave
