#include "weave/contact.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "contact_terms.hpp"
#include "nearest_points.hpp"
#include "yarn_contacts.hpp"

namespace weave {
namespace {

constexpr int walk_limit = 50;
/// Of the line law on the length of fiber, half a diameter at most, that a point between two yarns stands for.
constexpr int samples = 4;
/// How many reactions ahead memory is asked for that another core has written.
constexpr std::uint32_t reaction_ahead = 12;

struct Step {
  bool exists = false;
  std::uint32_t span = 0;
  std::int32_t wrap = 0;  ///< periods by which the fiber's own coordinates fall short after passing its seam
};

Step next_span(const Model& m, std::uint32_t s) {
  const SpanNodes n = nodes_of_span(m, m.fiber_of[s], s);
  return {n.has_after, n.after, n.wraps_after ? 1 : 0};
}

Step previous_span(const Model& m, std::uint32_t s) {
  const SpanNodes n = nodes_of_span(m, m.fiber_of[s], s);
  return {n.has_before, n.before, n.wraps_before ? -1 : 0};
}

/// u of the point of a span, thought to go on beyond its ends, that is nearest to a point `from_middle` its middle.
inline double nearest_on_span(const Span& s, const Vec3& from_middle) {
  const NearnessCubic<double> cubic = nearness_cubic(s);
  const double along = from_middle.dot(s.slope), steep = cubic.slope2 - from_middle.dot(s.curve);
  double u = 0;
  for (int i = 0; i < newton_limit; ++i) {
    const double slope = cubic.minus_slope(steep, u), length2 = cubic.length2_of_tangent(u);
    const bool newton = slope > flattest * length2;
    const double change = cubic.value(along, steep, u) / (newton ? slope : length2);
    u += change;
    if (std::abs(change) < (newton ? nearly_converged : converged)) break;
  }
  return u;
}

void release(Touch& touch, double& lost) {
  lost += stored_in(touch);
  touch = {};
}

/// Relative motion of a contact's two fibers during the last step.
struct Slip {
  double along_a = 0, along_b = 0;  ///< of the material of a on b, along a's axis and along b's [m]
  double cosine = 0;                ///< between the two axes
  double arm_a = 0, arm_b = 0;      ///< distance / length of c'(u): a turning axis slips by the distance from it
  Vec3 t_a, t_b;                    ///< unit tangents
  [[nodiscard]] double across() const { return along_a - cosine * along_b; }
  [[nodiscard]] double sine2() const { return 1 - cosine * cosine; }
};

/// A place on a fiber's axis.
struct Place {
  std::uint32_t span;
  double u;
};

/// Slip of a place of fiber a on fiber b over a time dt, for the unit normal n from b to a. Fibers that run `side_by_side` slip along
/// b, and over one another by what their yarn's turning does not explain.
inline Slip slip_of(const Model& m, const FiberGeometry& g, const Place& a, const Place& b, const Vec3& n, double distance,
                    bool side_by_side, double dt) {
  Slip slip;
  const auto rate = [&](const Place& at) { return span_at(m, m.fiber_of[at.span], at.span, g.v, Vec3::Zero()); };
  const Span rate_a = rate(a), rate_b = rate(b);
  const Vec3 relative = rate_a.point(a.u) - rate_b.point(b.u);
  slip.t_b = g.span(m, m.fiber_of[b.span], b.span).tangent(b.u);
  const double inverse_b = 1 / slip.t_b.norm();
  slip.t_b *= inverse_b;
  slip.arm_b = distance * inverse_b;
  slip.along_b = dt * (relative.dot(slip.t_b) + slip.arm_b * n.dot(rate_b.tangent(b.u)));
  if (side_by_side) {
    slip.t_a = n.cross(slip.t_b);
    slip.along_a = dt * (relative.dot(slip.t_a) + distance * g.turn[a.span]);
    return slip;
  }
  slip.t_a = g.span(m, m.fiber_of[a.span], a.span).tangent(a.u);
  const double inverse_a = 1 / slip.t_a.norm();
  slip.t_a *= inverse_a;
  slip.arm_a = distance * inverse_a;
  slip.along_a = dt * (relative.dot(slip.t_a) + slip.arm_a * n.dot(rate_a.tangent(a.u)));
  slip.cosine = slip.t_a.dot(slip.t_b);
  return slip;
}

/// Moves a touch's spring by a slip, with Coulomb's cap on the force [N], which across the fibers may pass it by `interlock` [N]: that much
/// holds there whatever slides along. Lost is the work done on the spring, by the trapezoidal rule as the motion has it, that the spring
/// does not store. The force is kept while the contact hardens, the slip while it softens, so that neither makes energy (Thornton & Randall
/// 1988).
inline void slide(Touch& touch, const Slip& slip, double stiffness, double cap, double interlock, double& lost) {
  const double softness = touch.stiffness > 0 ? 1 / touch.stiffness : 0;
  const double share = touch.stiffness > 0 ? std::min(stiffness * softness, 1.0) : 0;
  double f = touch.along * share - stiffness * slip.along_b, a = touch.across * share - stiffness * slip.across();
  const double locked = std::clamp(a, -interlock, interlock), free = a - locked;
  const double force2 = f * f + slip.sine2() * free * free;
  if (force2 > cap * cap) {
    const double back = cap / std::sqrt(force2);
    f *= back;
    a = locked + back * free;
  }
  lost += 0.5 * ((touch.along * touch.along + touch.across * touch.across) * softness - (f * f + a * a) / stiffness -
                 (touch.along + f) * slip.along_b - (touch.across + a) * slip.across());
  touch.along = f;
  touch.across = a;
  touch.stiffness = stiffness;
}

/// Lets a spring go as the fibers part: its force has acted in the first half of the last step.
void part(Touch& touch, const Slip& slip, double& lost) {
  lost += stored_in(touch) - 0.5 * (touch.along * slip.along_b + touch.across * slip.across());
  touch.along = touch.across = touch.stiffness = 0;
}

using Samples = Numbers<samples>;
/// Places of the samples about their point, in shares of the length that the point stands for.
const Samples sample_offsets = Samples::LinSpaced(0.5 / samples - 0.5, 0.5 - 0.5 / samples);
constexpr double last_offset = 0.5 - 0.5 / samples;

/// From the touched fiber to the point; short where their axes cross, so that it stays finite.
inline Vec3 unit_normal(const PairLaw& law, const Vec3& separation, double distance) {
  return (1 / std::max(distance, shortest_separation * law.reach)) * separation;
}

/// Normal force of a contact, summed over its samples.
struct NormalSum {
  SpanForce force;                    ///< on the point's span [N]
  double stiffness = 0;               ///< sum of slopes [N/m]
  double bound = 0;                   ///< on the stiffness along the normal that a node can feel [N/m]
  double gap = 0;                     ///< where nothing touches: the smallest of a sample [m]
  double size = 0, u_a = 0, u_b = 0;  ///< sum of the forces' sizes; sums of the places on the two spans times these
};

/// Pushes one sample of a contact, a share `weight` [m] of fiber at `u` of the point's span, off its closest point q on the span `span`.
/// Returns its bound on the stiffness along the normal [N/m].
inline double push(const ContactTarget& at, const PairLaw& law, const AxisPoint& q, double spared, double weight, double u,
                   std::uint32_t node, std::uint32_t span, Reaction& reaction, NormalSum& sum, ContactSums& sums) {
  const double distance = std::sqrt(q.distance2);
  const double overlap = law.reach - distance - spared, ratio = overlap * law.inverse_reach;
  const auto [force, stiffness] = law.line_response(overlap);
  const Vec3 n = unit_normal(law, q.separation, distance);
  const Vec3 pull = (weight * force) * n;
  const double bound = weight * stiffness * (1 + ratio);
  sum.force.add(pull, u);
  sum.stiffness += weight * stiffness;
  sum.bound += bound;
  sum.size += weight * force;
  sum.u_a += weight * force * u;
  sum.u_b += weight * force * q.u;
  if (!reaction.active) reaction = {{}, {}, static_cast<float>(q.u), span, true};
  reaction.force.add(-pull, q.u);
  note_overlap((law.reach - distance) * law.inverse_reach, node, span, sums);
  if (at.with_energy) sums.energy += weight * law.line_energy(overlap);
  return bound;
}

/// All samples of a contact at once where their closest points lie on one span. False, with nothing done, where they do not.
inline bool push_samples_on_span(const ContactTarget& at, const LineContact& c, Touch& touch, double explained, const PairLaw& law,
                                 double weight, Reaction& reaction, NormalSum& sum, ContactSums& sums) {
  const FiberGeometry& g = at.g;
  const Model& m = at.model;
  const Span a = g.span(m, at.fiber, c.node), b = g.span(m, m.fiber_of[c.span], c.span);
  Vec3 start = a.middle - b.middle;
  start.y() -= c.image * m.period_y;
  const Samples u = double{c.at} + sample_offsets / m.points[at.fiber];
  const Vectors<samples> from_middle = Vectors<samples>::on_curve(start, a.slope, a.curve, u);
  const NearnessCubic<double> cubic = nearness_cubic(b);
  const Samples along = from_middle.dot(b.slope), steep = cubic.slope2 - from_middle.dot(b.curve);
  const Samples v = nearest_on_spans<double, samples>(cubic, along, steep);
  if (v.minCoeff() < b.low || v.maxCoeff() > b.high) return false;

  const Vectors<samples> r = from_middle - Vectors<samples>::on_curve(Vec3::Zero(), b.slope, b.curve, v);
  const double w = weight / samples * law.line;
  const Samples distance = r.dot(r).sqrt();
  sum.gap = distance.minCoeff() - law.reach;
  touch.note(-sum.gap, explained);
  if (-sum.gap <= touch.spared) return true;
  note_overlap(-sum.gap * law.inverse_reach, c.node, c.span, sums);
  const Samples overlap = (law.reach - touch.spared - distance).max(0);
  const Samples slope = w * overlap.sqrt() / (law.reach - overlap), force = slope * overlap, per_r = force / distance;
  if (at.with_energy) {
    for (const double o : overlap) sums.energy += weight / samples * law.line_energy(o);
  }
  const Samples per_r_v = per_r * v, per_r_u = per_r * u;
  const Vec3 pull = r.sum(per_r);
  sum.force = {pull, r.sum(per_r_u), r.sum(0.5 * per_r_u * u)};
  sum.stiffness = 1.5 * slope.sum();
  sum.bound = 1.5 * (slope * (1 + law.inverse_reach * overlap)).sum();
  sum.size = force.sum();
  sum.u_a = (force * u).sum();
  sum.u_b = (force * v).sum();
  reaction = {{-pull, -r.sum(per_r_v), -r.sum(0.5 * per_r_v * v)}, {}, static_cast<float>(sum.u_b / sum.size), c.span, true};
  return true;
}

/// The samples of a contact between two yarns: the law is integrated over the length of fiber that the point stands for, as its closest
/// points lie, so that a crossing is felt alike wherever it is between two points. They may lie on the span at hand and on one beside it.
inline NormalSum push_samples(const ContactTarget& at, const LineContact& c, Touch& touch, double explained, const PairLaw& law,
                              double weight, std::span<Reaction, 2> reaction, ContactSums& sums) {
  const FiberGeometry& g = at.g;
  const Model& m = at.model;
  NormalSum sum;
  if (push_samples_on_span(at, c, touch, explained, law, weight, reaction[0], sum, sums)) return sum;
  const Span point_span = g.span(m, at.fiber, c.node);
  const double cell = 1.0 / m.points[at.fiber];
  std::array<AxisPoint, samples> nearest;
  std::array<std::uint32_t, samples> span;
  double nearest2 = std::numeric_limits<double>::infinity();
  for (int k = 0; k < samples; ++k) {
    span[k] = c.span;
    std::int32_t image = c.image;
    nearest[k] = walk_to_point(m, g, point_span.point(c.at + sample_offsets[k] * cell), span[k], image);
    nearest2 = std::min(nearest2, nearest[k].distance2);
  }
  sum.gap = std::sqrt(nearest2) - law.reach;
  touch.note(-sum.gap, explained);
  const double reach = law.reach - touch.spared;
  for (int k = 0; k < samples; ++k) {
    if (nearest[k].distance2 >= reach * reach) continue;
    Reaction& on_span = reaction[span[k] == c.span ? 0 : 1];
    if (on_span.active && on_span.span != span[k]) continue;
    const double u = c.at + sample_offsets[k] * cell;
    const double bound = push(at, law, nearest[k], touch.spared, weight / samples, u, c.node, span[k], on_span, sum, sums);
    on_span.stiffness.springs.add(bound, unit_normal(law, nearest[k].separation, std::sqrt(nearest[k].distance2)));
  }
  return sum;
}

/// Whether a contact and the one evaluated before it, if any, are two of one point, each followed along a bent fiber from a place of its
/// own, that have met: then the first counts alone.
bool has_met(const Model& m, const LineContact* before, const LineContact& c) {
  return before != nullptr && spans_apart(m, *before, c) <= 1;
}

/// `nearest`: closest point on the touched span, if it is known. `before`: the contact evaluated before this one, or none.
void line_contact(const ContactTarget& at, FiberPairs& pairs, const std::optional<AxisPoint>& nearest, LineContact& c, Touch& touch,
                  const LineContact* before, std::span<Reaction, 2> reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  const std::uint32_t p = c.node, other = m.fiber_of[c.span];
  const FiberPair& pair = pairs.with(other);
  const PairLaw& law = *pair.law;
  // If they were apart: how far they can be inside one another now.
  const double inside_at_most = c.asleep_until != 0 ? g.travel[p] + g.travel[c.span] - c.asleep_until : law.reach;
  c.asleep_until = 0;
  const AxisPoint q = nearest ? *nearest : walk_to_point(m, g, contact_point(m, g, c), c.span, c.image);
  const bool one_yarn = pair.meets_at_nodes, on_reed = pair.on_reed;
  const double weight = pair.share_of_points * (one_yarn ? m.tributary[p] : m.point_length[at.fiber]);
  if (has_met(m, before, c) || (other == at.fiber && within_own_bend(m, at.fiber, c.node, c.span, c.image))) {
    release(touch, sums.slip_loss);
    return let_sleep(g, 0, c);
  }
  const double distance = std::sqrt(q.distance2);
  const double gap = distance - pair.touch_reach;
  const double way = approach(g, p, c.span);
  const bool held = touch.is_held();
  if (gap >= way && !held) return let_sleep(g, gap, c);
  const double explained = (held ? touch.overlap + way : inside_at_most) + unexplained * law.reach;
  NormalSum normal;
  normal.gap = gap;
  if (one_yarn) {
    touch.note(-gap, explained);
    if (-gap > touch.spared) push(at, law, q, touch.spared, weight, 0, p, c.span, reaction[0], normal, sums);
  } else if (gap < way) {
    normal = push_samples(at, c, touch, explained, law, weight, reaction, sums);
  } else {
    touch.note(-gap, explained);
  }
  const bool touches = normal.stiffness > 0;
  if (!touches && !held) {
    const bool spared = touch.is_held();  // all of the overlap
    if (!spared) let_sleep(g, normal.gap, c);
    const double overlap = way - (spared ? 0 : normal.gap);
    if (overlap <= 0) return;
    // The next step is already chosen, and they may overlap by so much after it: the one after that has to be short enough.
    const double k = weight * law.line_stiffness(std::min(overlap, 0.5 * law.reach));
    const Vec3 n = unit_normal(law, q.separation, distance);
    add_stiffness(m, g, at.fiber, p, c.at, {DirectionalStiffness::along(n, k, 0)}, at.stiffness);
    return;
  }
  sums.touching += touches;
  const double friction = one_yarn ? m.friction_within(at.fiber) : m.friction;
  const double friction_stiffness = friction * normal.stiffness;
  // A reed bar does not give way, which halves what its touch adds to a frequency.
  const double share = on_reed ? 0.5 : 1;
  // Where friction acts: in the middle of the samples' forces, or in the point itself where they are on two spans.
  Place on_a{p, c.at}, on_b{c.span, q.u};
  Vec3 apart = q.separation;
  if (reaction[0].active && !reaction[1].active) {
    on_a.u = normal.u_a / normal.size;
    on_b.u = normal.u_b / normal.size;
    apart = g.span(m, at.fiber, p).point(on_a.u) - g.span(m, other, c.span).point(on_b.u);
    apart.y() -= c.image * m.period_y;
  }
  const double arm = apart.norm();
  const Vec3 n = unit_normal(law, apart, arm);
  ContactStiffness felt{DirectionalStiffness::along(n, share * normal.bound, share * friction_stiffness)};
  if (held && !on_reed && !reaction[1].active) {  // the guesses have not seen what is new
    felt.swing = static_cast<float>(swing_at(m, g, at.fiber, p, on_a.u) + swing_at(m, g, other, c.span, on_b.u));
  }
  if (!touches && !touch.is_held()) let_sleep(g, normal.gap, c);
  if (friction > 0) {
    const Slip slip = slip_of(m, g, on_a, on_b, n, arm, one_yarn, at.dt);
    if (!touches) return part(touch, slip, sums.slip_loss);
    // Beside the middle of a crossing the samples also push along the fiber, which is no normal force of the two fibers.
    const Vec3& pushed = normal.force.on_middle;
    const double along = pushed.dot(slip.t_a);
    const double normal_force = std::sqrt(std::max(pushed.squaredNorm() - along * along, 0.0));
    const double cap = std::min(friction, m.friction) * normal_force;
    slide(touch, slip, friction_stiffness, cap, friction * normal_force - cap, sums.slip_loss);
    const double along_b = touch.along - slip.cosine * touch.across;
    const Vec3 drag = along_b * slip.t_b + touch.across * slip.t_a;
    normal.force.add(drag, on_a.u);
    if (one_yarn) at.couple[p] += arm * touch.across;
    normal.force.add_to_tangent((touch.across * slip.arm_a) * n, on_a.u);
    if (!reaction[0].active) reaction[0] = {{}, {}, static_cast<float>(on_b.u), c.span, true};
    reaction[0].force.add(-drag, on_b.u);
    reaction[0].force.add_to_tangent((along_b * slip.arm_b) * n, on_b.u);
    if (reaction[1].active) reaction[0].stiffness.springs += DirectionalStiffness::along(n, 0, friction_stiffness);
    if (at.with_energy) sums.friction_store += stored_in(touch);
  }
  if (!touches) return;
  add_span_force(m, at.fiber, p, normal.force, at.force);
  add_stiffness(m, g, at.fiber, p, on_a.u, felt, at.stiffness);
  if (!reaction[1].active) {
    reaction[0].stiffness = felt;
    reaction[0].at = static_cast<float>(on_b.u);  // the place that its swing is of
  }
}

/// Node-to-node law of Yang 2015, eq. (3)-(7), kept to compare with: force along the part of the node-to-node vector normal to each
/// fiber's own tangent. Action and reaction differ where fibers cross.
void node_contact(const ContactTarget& at, LineContact& c, Touch& touch, Reaction& reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  c.asleep_until = 0;
  walk_to_point(m, g, g.x[c.node], c.span, c.image);
  const PairLaw& law = m.pair_law(at.fiber, m.fiber_of[c.span]);
  const std::uint32_t p = c.node, other = c.span;
  Vec3 r = g.x[p] - g.x[other];
  r.y() -= c.image * m.period_y;
  const Vec3 t = g.span(m, m.fiber_of[other], other).slope.normalized(), t_p = g.span(m, at.fiber, p).slope.normalized();
  const Vec3 to_p = r - r.dot(t_p) * t_p;
  const Vec3 to_q = r - r.dot(t) * t;
  const double distance = to_p.norm();
  if (distance >= law.reach) return release(touch, sums.slip_loss);
  const double overlap = law.reach - distance;
  touch.overlap = static_cast<float>(overlap);
  note_overlap(overlap / law.reach, p, other, sums);
  ++sums.touching;
  const double weight = 0.5 * m.tributary[p];
  const auto [force, stiffness] = law.line_response(overlap);
  const double fn = weight * force, kn = weight * stiffness;
  const double friction = m.yarn[at.fiber] == m.yarn[m.fiber_of[other]] ? m.friction_within(at.fiber) : m.friction;
  Vec3 on_node = fn / std::max(distance, 1e-3 * law.reach) * to_p;
  Vec3 on_other = -fn / std::max(to_q.norm(), 1e-3 * law.reach) * to_q;
  if (friction > 0) {
    Slip slip;
    slip.along_a = slip.along_b = (g.v[p] - g.v[other]).dot(t) * at.dt;
    slip.cosine = 1;
    slide(touch, slip, friction * kn, std::min(friction, m.friction) * fn, 0, sums.slip_loss);
    on_node += touch.along * t;
    on_other -= touch.along * t;
  }
  const double normal_stiffness = kn * (1 + overlap / law.reach);
  const auto felt = [&](const Vec3& to) {
    ContactStiffness along_and_sideways;
    along_and_sideways.springs.add(normal_stiffness, to / std::max(to.norm(), 1e-3 * law.reach));
    along_and_sideways.springs.add(friction * kn, t);
    return along_and_sideways;
  };
  at.force[p] += on_node;
  felt(to_p).add_to(at.stiffness[p], 1, 1);
  reaction = {{}, felt(to_q), 0, other, true};
  reaction.force.add_to_node(on_other);
  if (at.with_energy) sums.energy += weight * law.line_energy(overlap);
}

/// Those of a fiber's contacts that come next and may touch in this step.
struct AwakeContacts {
  static constexpr int most = 32;
  std::array<std::uint32_t, most> number;
  int count = 0;
};

/// Asks for the cache lines of an object that is used soon.
template <typename T>
void fetch(const T& object) {
  const auto* bytes = reinterpret_cast<const char*>(&object);
  __builtin_prefetch(bytes);
  __builtin_prefetch(bytes + sizeof(T) - 1);
}

/// From contact i on, which is moved to the first one not looked at; before `end`.
AwakeContacts next_awake(const FiberGeometry& g, const ActiveContacts& active, std::uint32_t& i, std::uint32_t end) {
  AwakeContacts awake;
  for (; i < end && awake.count < AwakeContacts::most; ++i) {
    const LineContact& c = active.line[i];
    if (g.reach_ahead[c.node] + g.reach_ahead[c.span] < c.asleep_until) continue;
    awake.number[awake.count++] = i;
    fetch(g.x[c.span]);
    fetch(g.v[c.span]);
  }
  return awake;
}

}  // namespace

void Touch::note(double now, double explained) {
  if (now > explained) spared = static_cast<float>(now - std::max(overlap - spared, 0.0F));
  overlap = static_cast<float>(std::max(now, 0.0));
  spared = std::min(spared, overlap);
}

void let_sleep(const FiberGeometry& g, double gap, LineContact& c) {
  c.asleep_until = g.travel[c.node] + g.travel[c.span] + gap;
}

std::int64_t spans_apart(const Model& m, const LineContact& a, const LineContact& b) {
  const std::uint32_t f = m.fiber_of[a.span];
  constexpr auto none = std::numeric_limits<std::int64_t>::max();
  if (a.node != b.node || a.at != b.at || f != m.fiber_of[b.span]) return none;
  if (!m.periodic[f] && a.image != b.image) return none;
  return std::abs(static_cast<std::int64_t>(a.span) - b.span + static_cast<std::int64_t>(a.image - b.image) * m.own_nodes(f));
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

Vec3 contact_point(const Model& m, const FiberGeometry& g, const LineContact& c) {
  return g.span(m, m.fiber_of[c.node], c.node).point(c.at);
}

bool within_own_bend(const Model& m, std::uint32_t fiber, std::uint32_t node, std::uint32_t span, std::int32_t image) {
  if (!m.periodic[fiber] && image != 0) return false;
  const std::int64_t spans = static_cast<std::int64_t>(span) - node + static_cast<std::int64_t>(image) * m.own_nodes(fiber);
  const double arc = static_cast<double>(std::abs(spans) - 1) * m.rest_length[m.first[fiber]];
  return arc < 2 * std::numbers::pi * m.type_of(fiber).radius;
}

AxisPoint walk_to_point(const Model& m, const FiberGeometry& g, const Vec3& point, std::uint32_t& span, std::int32_t& image) {
  const std::uint32_t fiber = m.fiber_of[span];
  int way = 0;
  for (int i = 0;; ++i) {
    const Span s = g.span(m, fiber, span);
    Vec3 from_middle = point - s.middle;
    from_middle.y() -= image * m.period_y;
    double u = nearest_on_span(s, from_middle);
    if (u < s.low || u > s.high) {
      const int to = u < s.low ? -1 : 1;
      const Step step = to < 0 ? previous_span(m, span) : next_span(m, span);
      // Beyond the axis's center of curvature both spans may send to the other.
      if (step.exists && to != -way && i < walk_limit) {
        way = to;
        span = step.span;
        image += step.wrap;
        continue;
      }
      u = std::clamp(u, s.low, s.high);
    }
    const Vec3 r = from_middle - u * s.slope - (0.5 * u * u) * s.curve;
    return {u, r, r.squaredNorm()};
  }
}

ContactSums evaluate_contacts(const Model& model, const FiberGeometry& geometry, std::uint32_t fiber, double dt, bool with_energy,
                              ContactList& contacts, std::span<Vec3> force, std::span<DirectionalStiffness> stiffness,
                              std::span<double> couple) {
  ContactSums sums;
  const ContactTarget at{model, geometry, fiber, dt, with_energy, force, stiffness, couple};
  FiberPairs pairs(model, fiber);
  YarnContacts of_yarn;
  NearestPoints nearest;
  std::array<Reaction, 2> reaction;
  for (ActiveContacts* active : {&contacts.active, &contacts.on_reed}) {
    const bool by_node = model.node_contact && active == &contacts.active;
    const LineContact* before = nullptr;
    std::uint32_t slot = 2 * active->of[fiber];
    const std::uint32_t end = active->of[fiber + 1];
    for (std::uint32_t i = active->of[fiber]; i < end;) {
      const AwakeContacts awake = next_awake(geometry, *active, i, end);
      of_yarn.clear();
      nearest.clear();
      std::array<int, AwakeContacts::most> in_yarn, alone;
      for (int k = 0; k < awake.count && !by_node; ++k) {
        const LineContact& contact = active->line[awake.number[k]];
        const Touch& touch = active->touch[awake.number[k]];
        in_yarn[k] = of_yarn.take(at, pairs, contact, touch);
        alone[k] = in_yarn[k] < 0 ? nearest.take(at, contact) : -1;
      }
      of_yarn.evaluate(at, pairs);
      nearest.find(at);
      for (int k = 0; k < awake.count; ++k) {
        const std::uint32_t number = awake.number[k];
        LineContact& contact = active->line[number];
        Touch& touch = active->touch[number];
        sums.nodes.add(contact.node);
        const std::uint32_t first = slot;
        if (by_node) {
          node_contact(at, contact, touch, reaction[0], sums);
        } else if (in_yarn[k] >= 0 && of_yarn.holds(in_yarn[k]) && !has_met(model, before, contact)) {
          of_yarn.apply(in_yarn[k], at, contact, touch, active->reaction[slot++], sums);
        } else {
          const bool found = alone[k] >= 0 && nearest.on_span(alone[k]);
          const std::optional<AxisPoint> point = found ? std::optional(nearest[alone[k]]) : std::nullopt;
          line_contact(at, pairs, point, contact, touch, before, reaction, sums);
        }
        for (Reaction& r : reaction) {
          if (!r.active) continue;
          active->reaction[slot++] = r;
          r.active = false;
        }
        active->reacts[active->place[number]] = {first, slot};
        before = &contact;
      }
    }
  }
  of_yarn.flush(at);
  return sums;
}

NodeRange gather_reactions(const Model& model, const FiberGeometry& geometry, const ContactList& contacts, std::uint32_t fiber,
                           std::span<Vec3> force, std::span<DirectionalStiffness> stiffness) {
  const ActiveContacts& active = model.role[fiber] == Role::reed ? contacts.on_reed : contacts.active;
  const std::uint32_t end = active.place_of[fiber + 1];
  NodeRange touched;
  for (std::uint32_t i = active.place_of[fiber]; i < end; ++i) {
    if (const std::uint32_t ahead = i + reaction_ahead; ahead < end && active.reacts[ahead].any())
      fetch(active.reaction[active.reacts[ahead].begin()]);
    for (std::uint32_t k = active.reacts[i].begin(); k < active.reacts[i].end(); ++k) {
      const Reaction& r = active.reaction[k];
      touched.add(r.span);
      add_span_force(model, fiber, r.span, r.force, force);
      if (model.node_contact && model.role[fiber] != Role::reed) {
        r.stiffness.add_to(stiffness[r.span], 1, 1);
      } else {
        add_stiffness(model, geometry, fiber, r.span, r.at, r.stiffness, stiffness);
      }
    }
  }
  return touched;
}

}  // namespace weave
