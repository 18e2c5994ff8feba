#include "yarn_contacts.hpp"

namespace weave {
int YarnContacts::take(const ContactTarget& at, FiberPairs& pairs, const LineContact& c, const Touch& touch) {
  const Model& m = at.model;
  const FiberGeometry& g = at.g;
  const std::uint32_t p = c.node, s = c.span, other = m.fiber_of[s];
  if (!touch.is_held() || other == at.fiber || !is_inner_span(m, other, s)) return -1;
  const FiberPair& pair = pairs.with(other);
  if (!pair.meets_at_nodes) return -1;
  if (taken_at_ != p) {
    taken_at_ = p;
    middle_ = g.span(m, at.fiber, p).middle;
    speed_ = span_at(m, at.fiber, p, g.v, Vec3::Zero()).middle;
    swing_ = swing_at(m, g, at.fiber, p, 0);
  }
  Batch& b = batch_[batch_of(count_)];
  const int k = count_ % lanes;
  b.point.set(k, middle_ - Vec3(0, c.image * m.period_y, 0));
  b.position.set(k, g.x, s);
  b.velocity.set(k, g.v, s);
  b.amplitude.set(k, g.amplitude, s);
  b.speed.set(k, speed_);
  b.turn[k] = g.turn[p];
  b.reach[k] = pair.law->reach;
  b.line[k] = pair.law->line;
  b.way[k] = approach(g, p, s);
  b.weight[k] = pair.share_of_points * m.tributary[p];
  b.touch.set(k, touch);
  b.swing[k] = swing_;
  last_contact_ = &c;
  last_touch_ = &touch;
  return count_++;
}

void YarnContacts::evaluate(const ContactTarget& at, FiberPairs& pairs) {
  while (count_ % lanes != 0) take(at, pairs, *last_contact_, *last_touch_);
  for (int first = 0; first < count_; first += lanes) compute(at, batch_[batch_of(first)]);
}

void YarnContacts::compute(const ContactTarget& at, Batch& b) {
  const InnerSpanLanes span(b.position);
  const LaneVectors separation = b.point - span.middle;
  const LaneNumbers u = span.nearest(separation);
  const LaneVectors apart = separation - span.from_middle(u);
  const LaneNumbers distance = root(apart.dot(apart)), inside = b.reach - distance;
  b.u = u;
  b.inside = inside;
  b.ratio = inside / b.reach;
  b.holds = span.has(u) && inside <= b.touch.overlap + b.way + unexplained * b.reach && inside > b.touch.spared;

  b.pressing = (inside - b.touch.spared).max(0);
  const LaneNumbers slope = b.weight * b.line * root(b.pressing) / (b.reach - b.pressing), size = slope * b.pressing;
  const LaneVectors n = apart.times(1 / distance.max(shortest_separation * b.reach));
  const LaneNumbers bound = 1.5 * slope * (1 + b.pressing / b.reach);
  const ShareLanes share = ShareLanes::at(u);
  b.swing += b.amplitude.sum(share);
  b.force = n.times(size);
  b.lost = b.couple = LaneNumbers::Zero();
  LaneNumbers spring = LaneNumbers::Zero();
  LaneVectors pull = LaneVectors::zero();  // on the touched axis's tangent
  // Slip along the touched fiber, and across it over one another by what the yarn's turning does not explain.
  if (const double friction = at.model.friction_within(at.fiber); friction > 0) {
    const LaneVectors tangent = span.tangent(u);
    const LaneNumbers inverse = 1 / root(tangent.dot(tangent)), arm = distance * inverse;
    const LaneVectors t = tangent.times(inverse), over = n.cross(t), speed = b.speed - b.velocity.sum(share);
    const LaneNumbers slip = at.dt * (speed.dot(t) + arm * n.dot(b.velocity.sum(ShareLanes::slope_at(u))));
    const LaneNumbers slip_over = at.dt * (speed.dot(over) + distance * b.turn);
    spring = friction * 1.5 * slope;
    const LaneNumbers cap = std::min(friction, at.model.friction) * size;
    b.lost = b.touch.slide(slip, slip_over, LaneNumbers::Ones(), spring, cap, friction * size - cap);
    b.couple = distance * b.touch.across;
    b.force = b.force + t.times(b.touch.along) + over.times(b.touch.across);
    pull = n.times(b.touch.along * arm);
  }
  b.felt = StiffnessLanes::along(n, bound, spring);
  b.reaction = {LaneVectors::zero(), LaneVectors::zero(), LaneVectors::zero()};
  b.reaction.add(b.force.times(LaneNumbers::Constant(-1)), u);
  b.reaction.add_to_tangent(pull, u);
}

void YarnContacts::apply(int place, const ContactTarget& at, const LineContact& c, Touch& touch, Reaction& reaction, ContactSums& sums) {
  const int k = place % lanes;
  const Batch& b = batch_[batch_of(place)];
  const std::uint32_t p = c.node;
  b.touch.get(k, b.inside[k], touch);
  ++sums.touching;
  note_overlap(b.ratio[k], p, c.span, sums);
  sums.slip_loss += b.lost[k];
  if (at.with_energy) {
    sums.energy += b.weight[k] * PairLaw{b.reach[k], 1 / b.reach[k], b.line[k]}.line_energy(b.pressing[k]);
    sums.friction_store += stored_in(touch);
  }
  at.couple[p] += b.couple[k];
  SpanForce force;
  force.on_middle = b.force[k];
  add_span_force(at.model, at.fiber, p, force, at.force);
  reaction.force = b.reaction[k];
  b.felt.get(k, reaction.stiffness.springs);
  reaction.stiffness.swing = static_cast<float>(b.swing[k]);
  reaction.at = static_cast<float>(b.u[k]);
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
  each_node_at(at.model, at.fiber, felt_at_, 0,
               [&](std::uint32_t p, double share) { at.stiffness[p].k += static_cast<float>(share / at.g.amplitude[p]) * felt_; });
  felt_at_ = none;
}

}  // namespace weave
