#include "weave/contact.hpp"

#include <algorithm>
#include <cmath>

namespace weave {
namespace {

/// Near a bar's end the neighbor bar may be closer: it is looked at within this fraction of the length.
constexpr double end_zone = 0.2;
constexpr int walk_limit = 8;
/// Two bars are equally close at the vertex they share: the one at hand is kept against round-off, as their angles, and shares, differ.
constexpr double nearer = 1 - 1e-9;

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

std::uint32_t previous_node(const Model& m, std::uint32_t fiber, std::uint32_t p) {
  if (p > m.first[fiber]) return p - 1;
  return m.periodic[fiber] ? m.last(fiber) - 1 : p;
}

struct OnBar {
  double raw, fraction;  ///< unclamped and clamped to the bar
  Vec3 separation;
  double distance2;
};

OnBar nearest_on_bar(const FiberGeometry& g, const Vec3& point, std::uint32_t s, double shift) {
  Vec3 r = point - g.x[s];
  r.y() -= shift;
  const double along = r.dot(g.bar_tangent[s]);
  const double clamped = std::clamp(along, 0.0, g.bar_length[s]);
  r -= clamped * g.bar_tangent[s];
  const double inverse = 1 / g.bar_length[s];
  return {along * inverse, clamped * inverse, r, r.squaredNorm()};
}

PolylinePair nearest_on_bars(const FiberGeometry& g, std::uint32_t a, std::uint32_t b, double shift) {
  Vec3 r = g.x[a] - g.x[b];
  r.y() -= shift;
  const Vec3& ta = g.bar_tangent[a];
  const Vec3& tb = g.bar_tangent[b];
  const double la = g.bar_length[a], lb = g.bar_length[b];
  const double c = ta.dot(tb), ra = r.dot(ta), rb = r.dot(tb);
  const double det = std::max(1 - c * c, 1e-12);
  double s = std::clamp((c * rb - ra) / det, 0.0, la);
  double t = std::clamp(rb + c * s, 0.0, lb);
  s = std::clamp(c * t - ra, 0.0, la);
  r += s * ta - t * tb;
  return {s / la, t / lb, r, r.squaredNorm()};
}

/// Tangential spring of one contact carried to the new stiffness: force kept while the contact hardens, slip kept while it softens, so that
/// neither makes energy (Thornton & Randall 1988). Returns the factor for the force; adds what is lost.
double carry_spring(double force2, double old_stiffness, double new_stiffness, double& lost) {
  if (old_stiffness <= 0) return 0;
  const double factor = new_stiffness < old_stiffness ? new_stiffness / old_stiffness : 1;
  lost += 0.5 * force2 * (1 / old_stiffness - factor * factor / new_stiffness);
  return factor;
}

void release(LineContact& c, double& lost) {
  if (c.stiffness <= 0) return;
  lost += 0.5 * c.friction * c.friction / c.stiffness;
  c.friction = c.stiffness = 0;
}

/// |f|^2 of a force in the plane of two unit vectors, cosine c, from its components along them.
double in_plane_norm2(double fa, double fb, double c) { return (fa * fa + fb * fb - 2 * c * fa * fb) / (1 - c * c); }

void release(CrossingContact& k, double c, double& lost) {
  if (k.stiffness <= 0) return;
  if (1 - c * c > 0.5 * AngleBlend::lower) lost += 0.5 * in_plane_norm2(k.friction_a, k.friction_b, c) / k.stiffness;
  k.friction_a = k.friction_b = k.stiffness = 0;
}

void note_overlap(double ratio, std::uint32_t node, std::uint32_t segment, ContactSums& sums) {
  ++sums.touching;
  if (ratio <= sums.overlap_max) return;
  sums.overlap_max = ratio;
  sums.node_max = node;
  sums.segment_max = segment;
}

struct Target {
  const Model& model;
  const FiberGeometry& g;
  std::uint32_t fiber;
  double dt;
  bool with_energy;
  std::span<Vec3> force;
  std::span<double> stiffness;
};

/// Most listed contacts are apart: seen from the bar at hand, before anything else is computed.
bool clearly_apart(const FiberGeometry& g, const LineContact& c, double period_y, double reach) {
  Vec3 r = g.x[c.node] - g.x[c.segment];
  r.y() -= c.image * period_y;
  const double along = r.dot(g.bar_tangent[c.segment]);
  if (along < 0 || along > g.bar_length[c.segment]) return false;
  // A kink of the touched fiber may bring its neighbor bar nearer by a few percent.
  return r.squaredNorm() - along * along > 1.1 * reach * reach;
}

void line_contact(const Target& at, LineContact& c, Reaction& reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  reaction.active = false;
  if (c.stiffness == 0 && clearly_apart(g, c, m.period_y, m.pair_law(at.fiber, m.fiber_of[c.segment]).reach)) return;
  const PolylinePoint q = walk_to_point(m, g, g.x[c.node], c.segment, c.image);
  const PairLaw& law = m.pair_law(at.fiber, m.fiber_of[c.segment]);
  if (q.distance2 >= law.reach * law.reach) return release(c, sums.slip_loss);
  const std::uint32_t p = c.node, s = c.segment;
  const Vec3& tp = g.node_tangent[p];
  const Vec3& tb = g.bar_tangent[s];
  const double cosine = tp.dot(tb);
  const AngleBlend blend = AngleBlend::at(1 - cosine * cosine);
  if (blend.line <= 0) return release(c, sums.slip_loss);

  const double distance = std::sqrt(q.distance2);
  const Vec3 n = q.separation / std::max(distance, 1e-3 * law.reach);
  const double overlap = law.reach - distance;
  note_overlap(overlap / law.reach, p, s, sums);
  const double half_length = 0.5 * m.tributary(p);  // the other half of the pair's length comes from the other fiber's nodes
  const double weight = half_length * blend.line;
  const double fn = weight * law.line_force(overlap);
  const double kn = weight * law.line_stiffness(overlap);
  const double inverse_length = 1 / g.bar_length[s];
  const double xi = q.fraction;

  Vec3 on_node = fn * n, on_first = -(1 - xi) * on_node, on_second = -xi * on_node;
  if (m.friction > 0) {
    const double kt = m.friction * kn;
    const Vec3 dv = g.v[s + 1] - g.v[s];
    const double arm = distance * inverse_length;
    const double slip_rate = (g.v[p] - g.v[s] - xi * dv).dot(tb) + arm * n.dot(dv);
    double f = c.friction * carry_spring(c.friction * c.friction, c.stiffness, kt, sums.slip_loss) - kt * slip_rate * at.dt;
    const double cap = m.friction * fn;
    if (std::abs(f) > cap) {
      sums.slip_loss += cap * (std::abs(f) - cap) / kt;
      f = std::copysign(cap, f);
    }
    c.friction = f;
    c.stiffness = kt;
    on_node += f * tb;
    on_first -= f * ((1 - xi) * tb + arm * n);
    on_second -= f * (xi * tb - arm * n);
  }
  if (blend.line_slope != 0) {  // U = weight * energy: torque of the changing share
    const double slope = -2 * cosine * half_length * law.line_energy(overlap) * blend.line_slope;
    const Vec3 turn_p = slope / g.node_chord[p] * (tb - cosine * tp);
    const Vec3 turn_b = slope * inverse_length * (tp - cosine * tb);
    if (m.rest_length[p] > 0) at.force[p + 1] -= turn_p; else at.force[p] -= turn_p;
    at.force[previous_node(m, at.fiber, p)] += turn_p;
    on_second -= turn_b;
    on_first += turn_b;
  }
  const double k = kn * (1 + overlap / law.reach) + m.friction * kn;
  at.force[p] += on_node;
  at.stiffness[p] += k;
  reaction = {on_first, on_second, k, s, true};
  if (at.with_energy) {
    sums.energy += weight * law.line_energy(overlap);
    if (c.stiffness > 0) sums.friction_store += 0.5 * c.friction * c.friction / c.stiffness;
  }
}

/// Node-to-node law of Yang 2015, eq. (3)-(7), kept to compare with: force along the part of the node-to-node vector normal to each
/// fiber's own tangent. Action and reaction differ where fibers cross.
void node_contact(const Target& at, LineContact& c, Reaction& reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  reaction.active = false;
  const PolylinePoint q = walk_to_point(m, g, g.x[c.node], c.segment, c.image);
  const PairLaw& law = m.pair_law(at.fiber, m.fiber_of[c.segment]);
  const std::uint32_t p = c.node, s = c.segment;
  const std::uint32_t other = q.fraction < 0.5 ? s : s + 1;
  Vec3 r = g.x[p] - g.x[other];
  r.y() -= c.image * m.period_y;
  const Vec3 to_p = r - r.dot(g.node_tangent[p]) * g.node_tangent[p];
  const Vec3 to_q = r - r.dot(g.node_tangent[other]) * g.node_tangent[other];
  const double distance = to_p.norm();
  if (distance >= law.reach) return release(c, sums.slip_loss);
  const double overlap = law.reach - distance;
  note_overlap(overlap / law.reach, p, s, sums);
  const double weight = 0.5 * m.tributary(p);
  const double fn = weight * law.line_force(overlap), kn = weight * law.line_stiffness(overlap);
  Vec3 on_node = fn / std::max(distance, 1e-3 * law.reach) * to_p;
  Vec3 on_other = -fn / std::max(to_q.norm(), 1e-3 * law.reach) * to_q;
  if (m.friction > 0) {
    const double kt = m.friction * kn, cap = m.friction * fn;
    const Vec3& t = g.node_tangent[other];
    double f = c.friction * carry_spring(c.friction * c.friction, c.stiffness, kt, sums.slip_loss) - kt * (g.v[p] - g.v[other]).dot(t) * at.dt;
    if (std::abs(f) > cap) {
      sums.slip_loss += cap * (std::abs(f) - cap) / kt;
      f = std::copysign(cap, f);
    }
    c.friction = f;
    c.stiffness = kt;
    on_node += f * t;
    on_other -= f * t;
  }
  const double k = kn * (1 + overlap / law.reach + m.friction);
  at.force[p] += on_node;
  at.stiffness[p] += k;
  const bool at_first = other == s;
  reaction = {at_first ? on_other : Vec3::Zero(), at_first ? Vec3::Zero() : on_other, k, s, true};
  if (at.with_energy) sums.energy += weight * law.line_energy(overlap);
}

void crossing_contact(const Target& at, CrossingContact& k, Reaction& reaction, ContactSums& sums) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  reaction.active = false;
  const PolylinePair q = walk_to_pair(m, g, k.segment_a, k.segment_b, k.image);
  const std::uint32_t a = k.segment_a, b = k.segment_b;
  const PairLaw& law = m.pair_law(at.fiber, m.fiber_of[b]);
  const Vec3& ta = g.bar_tangent[a];
  const Vec3& tb = g.bar_tangent[b];
  const double c = ta.dot(tb);
  if (q.distance2 >= law.reach * law.reach) return release(k, c, sums.slip_loss);
  const AngleBlend blend = AngleBlend::at(1 - c * c);
  if (blend.crossing <= 0) return release(k, c, sums.slip_loss);

  const double distance = std::sqrt(q.distance2);
  const Vec3 n = q.separation / std::max(distance, 1e-3 * law.reach);
  const double overlap = law.reach - distance;
  note_overlap(overlap / law.reach, a, b, sums);
  const double fn = blend.crossing * law.crossing_force(overlap);
  const double kn = blend.crossing * law.crossing_stiffness(overlap);
  const double s = q.fraction_a, t = q.fraction_b;
  const double inverse_a = 1 / g.bar_length[a], inverse_b = 1 / g.bar_length[b];

  Vec3 pull = fn * n;  // on fiber a at the contact
  Vec3 couple_a = Vec3::Zero(), couple_b = Vec3::Zero();
  if (m.friction > 0) {
    const double kt = m.friction * kn;
    const Vec3 dva = g.v[a + 1] - g.v[a], dvb = g.v[b + 1] - g.v[b];
    const Vec3 relative = g.v[a] + s * dva - g.v[b] - t * dvb;
    const double arm_a = distance * inverse_a, arm_b = distance * inverse_b;
    const double factor = carry_spring(in_plane_norm2(k.friction_a, k.friction_b, c), k.stiffness, kt, sums.slip_loss);
    double fa = k.friction_a * factor - kt * at.dt * (relative.dot(ta) + arm_a * n.dot(dva));
    double fb = k.friction_b * factor - kt * at.dt * (relative.dot(tb) + arm_b * n.dot(dvb));
    const double cap = m.friction * fn;
    const double norm = std::sqrt(in_plane_norm2(fa, fb, c));
    if (norm > cap) {
      sums.slip_loss += cap * (norm - cap) / kt;
      fa *= cap / norm;
      fb *= cap / norm;
    }
    k.friction_a = fa;
    k.friction_b = fb;
    k.stiffness = kt;
    const double share_a = (fa - c * fb) / (1 - c * c), share_b = (fb - c * fa) / (1 - c * c);
    pull += share_a * ta + share_b * tb;
    couple_a = share_a * arm_a * n;
    couple_b = share_b * arm_b * n;
  }
  if (blend.crossing_slope != 0) {
    const double slope = -2 * c * law.crossing_energy(overlap) * blend.crossing_slope;
    couple_a -= slope * inverse_a * (tb - c * ta);
    couple_b -= slope * inverse_b * (ta - c * tb);
  }
  const double stiffness = kn * (1 + overlap / law.reach) + m.friction * kn;
  at.force[a] += (1 - s) * pull - couple_a;
  at.force[a + 1] += s * pull + couple_a;
  at.stiffness[a] += (1 - s) * stiffness;
  at.stiffness[a + 1] += s * stiffness;
  reaction = {-(1 - t) * pull - couple_b, -t * pull + couple_b, stiffness, b, true};
  if (at.with_energy) {
    sums.energy += blend.crossing * law.crossing_energy(overlap);
    if (k.stiffness > 0) sums.friction_store += 0.5 * in_plane_norm2(k.friction_a, k.friction_b, c) / k.stiffness;
  }
}

void add_reaction(const Reaction& r, std::span<Vec3> force, std::span<double> stiffness) {
  if (!r.active) return;
  force[r.segment] += r.on_first;
  force[r.segment + 1] += r.on_second;
  // Shares of the stiffness follow the force; the larger one bounds both within a factor of two.
  stiffness[r.segment] += 0.5 * r.stiffness;
  stiffness[r.segment + 1] += 0.5 * r.stiffness;
}

}  // namespace

PolylinePoint walk_to_point(const Model& m, const FiberGeometry& g, const Vec3& point, std::uint32_t& segment, std::int32_t& image) {
  OnBar here = nearest_on_bar(g, point, segment, image * m.period_y);
  for (int i = 0; i < walk_limit; ++i) {
    Step to;
    if (here.raw < end_zone) {
      to = previous_bar(m, segment);
    } else if (here.raw > 1 - end_zone) {
      to = next_bar(m, segment);
    }
    if (!to.exists) break;
    const OnBar there = nearest_on_bar(g, point, to.segment, (image + to.wrap) * m.period_y);
    if (there.distance2 >= nearer * here.distance2) break;
    here = there;
    segment = to.segment;
    image += to.wrap;
  }
  return {here.fraction, here.separation, here.distance2};
}

PolylinePair walk_to_pair(const Model& m, const FiberGeometry& g, std::uint32_t& a, std::uint32_t& b, std::int32_t& image) {
  PolylinePair here = nearest_on_bars(g, a, b, image * m.period_y);
  const auto try_step = [&](const Step& to, bool on_a) {
    if (!to.exists) return false;
    const std::uint32_t na = on_a ? to.segment : a, nb = on_a ? b : to.segment;
    const std::int32_t ni = image + (on_a ? -to.wrap : to.wrap);
    const PolylinePair there = nearest_on_bars(g, na, nb, ni * m.period_y);
    if (there.distance2 >= nearer * here.distance2) return false;
    here = there;
    a = na;
    b = nb;
    image = ni;
    return true;
  };
  for (int i = 0; i < walk_limit; ++i) {
    bool moved = false;
    if (here.fraction_a < end_zone) moved = try_step(previous_bar(m, a), true);
    else if (here.fraction_a > 1 - end_zone) moved = try_step(next_bar(m, a), true);
    if (here.fraction_b < end_zone) moved = try_step(previous_bar(m, b), false) || moved;
    else if (here.fraction_b > 1 - end_zone) moved = try_step(next_bar(m, b), false) || moved;
    if (!moved) break;
  }
  return here;
}

ContactSums evaluate_contacts(const Model& model, const FiberGeometry& geometry, std::uint32_t fiber, double dt, bool with_energy,
                              ContactList& contacts, std::span<Vec3> force, std::span<double> stiffness) {
  ContactSums sums;
  const Target at{model, geometry, fiber, dt, with_energy, force, stiffness};
  ActiveContacts& lines = contacts.active_line;
  for (std::uint32_t i = lines.of[fiber]; i < lines.of[fiber + 1]; ++i) {
    LineContact& contact = contacts.line[lines.number[i]];
    if (model.node_contact) {
      node_contact(at, contact, lines.reaction[i], sums);
    } else {
      line_contact(at, contact, lines.reaction[i], sums);
    }
  }
  ActiveContacts& crossings = contacts.active_crossing;
  for (std::uint32_t i = crossings.of[fiber]; i < crossings.of[fiber + 1]; ++i) {
    crossing_contact(at, contacts.crossing[crossings.number[i]], crossings.reaction[i], sums);
  }
  return sums;
}

void gather_reactions(const ContactList& contacts, std::uint32_t fiber, std::span<Vec3> force, std::span<double> stiffness) {
  for (const ActiveContacts* active : {&contacts.active_line, &contacts.active_crossing}) {
    for (std::uint32_t i = active->target_of[fiber]; i < active->target_of[fiber + 1]; ++i) {
      add_reaction(active->reaction[active->target[i]], force, stiffness);
    }
  }
}

}  // namespace weave
