#include "yarn_contacts.hpp"

namespace weave {
int YarnContacts::take(const ContactTarget& at, FiberPairs& pairs, const LineContact& c, const Touch& touch) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  const std::uint32_t p = c.node, s = c.span, other = m.fiber_of[s];
  if (!touch.is_held() || other == at.fiber) return -1;
  if (s == m.first[other] || s + 1 >= m.first[other] + m.own_nodes(other)) return -1;
  const FiberPair& pair = pairs.with(other);
  if (!pair.meets_at_nodes) return -1;
  if (taken_at_ != p) {
    taken_at_ = p;
    speed_ = span_at(m, at.fiber, p, g.v, Vec3::Zero()).middle;
    swing_ = swing_at(m, g, at.fiber, p, 0);
  }
  Batch& b = batch_[batch_of(count_)];
  const int k = count_ % lanes;
  const Span& span = g.span[s];
  Vec3 separation = g.span[p].middle - span.middle;
  separation.y() -= c.image * m.period_y;
  b.separation.set(k, separation);
  b.slope.set(k, span.slope);
  b.curve.set(k, span.curve);
  b.low[k] = span.low;
  b.high[k] = span.high;
  b.speed_before.set(k, speed_ - g.v[s - 1]);
  b.speed_here.set(k, speed_ - g.v[s]);
  b.speed_after.set(k, speed_ - g.v[s + 1]);
  b.swing[k] = swing_;
  b.swing_before[k] = g.amplitude[s - 1];
  b.swing_here[k] = g.amplitude[s];
  b.swing_after[k] = g.amplitude[s + 1];
  b.turn[k] = g.turn[p];
  b.weight[k] = pair.share_of_points * m.tributary[p];
  b.reach[k] = pair.law->reach;
  b.line[k] = pair.law->line;
  b.way[k] = approach(g, p, s);
  b.along[k] = touch.along;
  b.across[k] = touch.across;
  b.spring[k] = touch.stiffness;
  b.overlap[k] = touch.overlap;
  b.spared[k] = touch.spared;
  last_contact_ = &c;
  last_touch_ = &touch;
  return count_++;
}

void YarnContacts::evaluate(const ContactTarget& at, FiberPairs& pairs) {
  while (count_ % lanes != 0) take(at, pairs, *last_contact_, *last_touch_);
  for (int first = 0; first < count_; first += lanes) compute(at, batch_[batch_of(first)]);
}

void YarnContacts::compute(const ContactTarget& at, Batch& b) {
  const V &slope = b.slope, &curve = b.curve, &r = b.separation;
  const NearnessCubic<N> cubic{slope.dot(slope), slope.dot(curve), curve.dot(curve)};
  const N u = nearest_on_spans<N, lanes>(cubic, r.dot(slope), cubic.slope2 - r.dot(curve));
  const N half2 = 0.5 * u * u;
  const V apart = r - slope.times(u) - curve.times(half2);
  const N distance = root(apart.dot(apart)), inside = b.reach - distance;
  b.u = u;
  b.inside = inside;
  b.ratio = inside / b.reach;
  b.holds = u >= b.low && u <= b.high && inside <= b.overlap + b.way + unexplained * b.reach && inside > b.spared;

  // The normal force.
  b.pressing = (inside - b.spared).max(0);
  const N stiffness = b.weight * b.line * root(b.pressing) / (b.reach - b.pressing), size = stiffness * b.pressing;
  const V n = apart.times(1 / distance.max(shortest_separation * b.reach));
  const N bound = 1.5 * stiffness * (1 + b.pressing / b.reach);
  const N before = 0.5 * (0.5 - u) * (0.5 - u), after = 0.5 * (0.5 + u) * (0.5 + u), here = 0.75 - u * u;
  b.swing += before * b.swing_before + here * b.swing_here + after * b.swing_after;

  // Friction: slip along the touched fiber, and across it over one another by what the yarn's turning does not explain.
  const double friction = at.model.friction_within(at.fiber);
  N across_bound = N::Zero();
  b.force = n.times(size);
  b.on_slope = {N::Zero(), N::Zero(), N::Zero()};
  b.couple = b.lost = N::Zero();
  if (friction > 0) {
    const V tangent = slope + curve.times(u);
    const N inverse = 1 / root(tangent.dot(tangent)), arm = distance * inverse;
    const V t = tangent.times(inverse), over = n.cross(t);
    const V speed = b.speed_before.times(before) + b.speed_here.times(here) + b.speed_after.times(after);
    // Of the axis's tangent; the point's own speed is in all three and goes out.
    const V tangent_rate = b.speed_before.times(0.5 - u) + b.speed_here.times(2 * u) - b.speed_after.times(0.5 + u);
    const N slip = at.dt * (speed.dot(t) + arm * n.dot(tangent_rate)), slip_over = at.dt * (speed.dot(over) + distance * b.turn);
    const N spring = friction * 1.5 * stiffness;
    const N softness = (b.spring > 0).select(1 / b.spring, 0), share = (spring * softness).min(1);
    N f = b.along * share - spring * slip;
    const N wanted = b.across * share - spring * slip_over;
    const N cap = std::min(friction, at.model.friction) * size, interlock = friction * size - cap;
    const N locked = wanted.max(-interlock).min(interlock), free = wanted - locked;
    const N force2 = f * f + free * free;
    const N back = (force2 > cap * cap).select(cap / root(force2), 1);
    f *= back;
    const N a = locked + back * free;
    b.lost = 0.5 * ((b.along * b.along + b.across * b.across) * softness - (f * f + a * a) / spring - (b.along + f) * slip -
                    (b.across + a) * slip_over);
    b.along = f;
    b.across = a;
    b.spring = spring;
    b.couple = distance * a;
    b.force = b.force + t.times(f) + over.times(a);
    b.on_slope = n.times(f * arm);
    across_bound = spring;
  }
  const N along_n = bound - across_bound;
  b.xx = along_n * n.x * n.x + across_bound;
  b.yy = along_n * n.y * n.y + across_bound;
  b.zz = along_n * n.z * n.z + across_bound;
  b.xy = along_n * n.x * n.y;
  b.xz = along_n * n.x * n.z;
  b.yz = along_n * n.y * n.z;
}

void YarnContacts::apply(int place, const ContactTarget& at, const LineContact& c, Touch& touch, Reaction& reaction, ContactSums& sums) {
  const int k = place % lanes;
  const Batch& b = batch_[batch_of(place)];
  const std::uint32_t p = c.node;
  const double u = b.u[k];
  touch.overlap = static_cast<float>(b.inside[k]);
  touch.spared = std::min(touch.spared, touch.overlap);
  touch.along = b.along[k];
  touch.across = b.across[k];
  touch.stiffness = b.spring[k];
  ++sums.touching;
  note_overlap(b.ratio[k], p, c.span, sums);
  sums.slip_loss += b.lost[k];
  if (at.with_energy) {
    const double weight = b.weight[k];
    sums.energy += weight * PairLaw{b.reach[k], 1 / b.reach[k], b.line[k]}.line_energy(b.pressing[k]);
    sums.friction_store += stored_in(touch);
  }
  at.couple[p] += b.couple[k];
  const Vec3 force = b.force[k];
  at.force[p].on_middle += force;
  reaction.force = {};
  reaction.force.add(-force, u);
  reaction.force.add_to_tangent(b.on_slope[k], u);
  reaction.stiffness.springs.k << static_cast<float>(b.xx[k]), static_cast<float>(b.yy[k]), static_cast<float>(b.zz[k]),
      static_cast<float>(b.xy[k]), static_cast<float>(b.xz[k]), static_cast<float>(b.yz[k]), 0, 0;
  reaction.stiffness.swing = static_cast<float>(b.swing[k]);
  reaction.at = static_cast<float>(u);
  reaction.span = c.span;
  reaction.active = true;
  if (felt_at_ != p) {
    flush(at);
    felt_at_ = p;
    felt_.setZero();
  }
  felt_ += reaction.stiffness.swing * reaction.stiffness.springs.k;
}

void YarnContacts::flush(const ContactTarget& at) {
  if (felt_at_ == none) return;
  each_node_at(at.model, at.g, at.fiber, felt_at_, 0,
               [&](std::uint32_t p, double share) { at.stiffness[p].k += static_cast<float>(share / at.g.amplitude[p]) * felt_; });
  felt_at_ = none;
}

}  // namespace weave
