#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "chain.hpp"
#include "contact_samples.hpp"
#include "line_law.hpp"
#include "relax/energy.hpp"

namespace relax {
namespace {

constexpr double bend_mild = 0.6, bend_sharp = 0.9;  ///< curvature of an axis times the reach; from 1 on closest points are not unique
constexpr double bend_seen_within = 1.5;             ///< distance over the reach

/// What moves the separation of a sample: nodes of the point's span, nodes of the touched span, and the cell's free lengths, which move the
/// images of either. By `c` in all directions, or, a length, along its axis alone.
struct Mover {
  bool of_touched = false;
  Eigen::Index axis = -1;     ///< of a length; -1: a node
  std::uint32_t node = 0;     ///< of a node
  Eigen::Index unknown = -1;  ///< of a length
  double c = 0, c_slope = 0;  ///< and its derivative by the place on the touched axis
};

/// Movers of one sample, at most: 3 + 3 nodes and two lengths on each side.
struct Movers {
  std::array<Mover, 10> of;
  std::size_t count = 0;

  void add_span(const Span& span, const Vec3& weight, const Vec3& slope, bool of_touched) {
    for (std::size_t a = 0; a < 3; ++a) {
      const auto k = static_cast<Eigen::Index>(a);
      const double sign = of_touched ? -1 : 1;
      of[count++] = {of_touched, -1, span.node[a], -1, sign * weight[k], of_touched ? -slope[k] : 0};
    }
  }
  /// The lengths by which a side's nodes are moved.
  void add_lengths(const Unknowns& unknowns, const std::array<double, 2>& c, const std::array<double, 2>& c_slope, bool of_touched) {
    for (std::size_t k = 0; k < 2; ++k) {
      if (unknowns.length[k] >= 0 && (c[k] != 0 || c_slope[k] != 0))
        of[count++] = {of_touched, static_cast<Eigen::Index>(k), 0, unknowns.length[k], c[k], c_slope[k]};
    }
  }
};

/// Adds the Hessian of one sample's energy phi(d), with the distance d = min over v of |r|, r = p - y(v). With the coefficients c of the
/// movers in r and n = r/d, the gradient of d is c n, v having no first-order part in it. For psi = d^2/2 = min over v of |r|^2/2 =: min G,
///   d2 psi = G_qq - G_qv G_vq / G_vv, G_qq = c c I, G_qv = c' r - c y', G_vv = y'.y' - r.y'',
/// (c' by v, zero for the point's own nodes), and d2 d = (d2 psi - n n) / d.
void add_hessian(const ChainPoint& at, const Movers& movers, const Unknowns& unknowns, double distance, double force, double slope,
                 const Derivatives& want) {
  const Vec3 n = at.separation / distance;
  const Vec3 tangent = at.span.tangent(at.share);
  const double bend = tangent.squaredNorm() - at.separation.dot(at.span.curve);
  const double turn = want.convex ? 0 : -force / distance;  // phi' / d
  const Eigen::Matrix3d along_n = n * n.transpose();
  std::array<Vec3, std::tuple_size_v<decltype(movers.of)>> g;
  for (std::size_t a = 0; a < movers.count; ++a) g[a] = movers.of[a].c_slope * at.separation - movers.of[a].c * tangent;
  for (std::size_t i = 0; i < movers.count; ++i) {
    const Mover& a = movers.of[i];
    for (std::size_t j = i; j < movers.count; ++j) {
      const Mover& b = movers.of[j];
      if (want.fiber_wise && a.of_touched != b.of_touched) continue;
      Eigen::Matrix3d block = (slope - turn) * a.c * b.c * along_n;
      if (turn != 0) block += turn * (a.c * b.c * Eigen::Matrix3d::Identity() - g[i] * g[j].transpose() / bend);
      if (a.axis < 0 && b.axis < 0) {
        // For i != j it stands for both triangles, also where a fiber touches its own image.
        want.hessian->add(a.node, b.node, i != j && a.node == b.node ? Eigen::Matrix3d(block + block.transpose()) : block);
      } else if (a.axis < 0) {
        want.hessian->add_border(unknowns.border(b.unknown), a.node, block.col(b.axis));
      } else if (a.unknown == b.unknown) {
        want.hessian->add_corner(unknowns.border(a.unknown), (i == j ? 1 : 2) * block(a.axis, b.axis));
      } else {
        want.hessian->add_corner(unknowns.border(a.unknown), unknowns.border(b.unknown), block(a.axis, b.axis));
      }
    }
  }
}

Movers movers_of(const Cell& cell, const Unknowns& unknowns, const SpanContact& contact, const Span& own, double u, const ChainPoint& at) {
  Movers movers;
  const Vec3 own_share = span_weights(u), other_share = span_weights(at.share), other_slope = span_slopes(at.share);
  movers.add_span(own, own_share, Vec3::Zero(), false);
  movers.add_span(at.span, other_share, other_slope, true);
  if (unknowns.length[0] < 0 && unknowns.length[1] < 0) return movers;
  const auto own_axis = static_cast<std::size_t>(cell.axis_of(cell.fiber_of[contact.span]));
  const auto other_axis = static_cast<std::size_t>(cell.axis_of(cell.fiber_of[contact.other]));
  std::array<double, 2> of_own = {0, 0}, of_other = {-1.0 * contact.image_x, -1.0 * contact.image_y}, slope = {0, 0};
  of_own[own_axis] += own.wrap[0] * own_share[0] + own.wrap[2] * own_share[2];
  of_other[other_axis] -= at.walked + at.span.wrap[0] * other_share[0] + at.span.wrap[2] * other_share[2];
  slope[other_axis] -= at.span.wrap[0] * other_slope[0] + at.span.wrap[2] * other_slope[2];
  movers.add_lengths(unknowns, of_own, {0, 0}, false);
  movers.add_lengths(unknowns, of_other, slope, true);
  return movers;
}

/// How far the nodes of each span have gone since a list was built [m].
std::vector<double> ways_since(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q) {
  const double growth = growth_since(cell, list, q);
  std::vector<double> node(cell.nodes()), span(cell.nodes());
  for (std::uint32_t i = 0; i < cell.nodes(); ++i)
    node[i] = growth + (q.segment<3>(3 * Eigen::Index{i}) - list.built_at.segment<3>(3 * Eigen::Index{i})).norm();
  for (std::uint32_t i = 0; i < cell.nodes(); ++i) span[i] = std::max({node[cell.before(i).node], node[i], node[cell.after(i).node]});
  return span;
}

/// Work that is done in parallel is cut into as many parts, whatever the threads: so results do not depend on them.
constexpr std::size_t work_parts = 8;

/// What the contacts of one part of the list give.
struct PartOfContacts {
  double energy = 0;
  Eigen::VectorXd gradient;
  ContactState state;
};

/// Evaluates contact number i of the list at those of its points that can have come to a touch while nodes went `way` [m].
void evaluate(const Cell& cell, const Unknowns& unknowns, const ContactList& list, std::size_t i, double way, const Eigen::VectorXd& q,
              const Derivatives& want, PartOfContacts& part) {
  const SpanContact& contact = list.contacts[i];
  ContactState& state = part.state;
  const std::size_t first = list.first_sample[i], end = list.first_sample[i + 1];
  const auto apart = [&](std::size_t s) { return list.gap[s] > way; };
  std::size_t s = first;
  while (!state.want_overlaps && s < end && apart(s)) ++s;
  if (s == end) return;
  const PairLaw& law = cell.pair_law(cell.fiber_of[contact.span], cell.fiber_of[contact.other]);
  const auto samples = static_cast<double>(end - first);
  const double weight = contact.share * cell.span_length(contact.span) / samples;
  const Span own(cell, q, contact.span);
  const Vec3 shift = image_shift(cell, q, contact.image_x, contact.image_y);
  for (; s < end; ++s) {
    if (apart(s)) {
      if (state.want_overlaps) state.overlaps.push_back(0);
      continue;
    }
    const double u = (static_cast<double>(s - first) + 0.5) / samples;
    const ChainPoint at = closest_on_chain(cell, q, own.point(u), contact.other, shift);
    const double distance2 = at.separation.squaredNorm();
    const bool touches = at.found && distance2 < law.reach * law.reach;
    if (state.want_overlaps) state.overlaps.push_back(at.found ? law.reach - std::sqrt(distance2) : -law.reach);
    if (!touches) continue;
    const double distance = std::sqrt(distance2), overlap = law.reach - distance;
    part.energy += weight * law.line_energy(overlap);
    ++state.touching;
    state.overlap_max = std::max(state.overlap_max, overlap / law.reach);
    if (!want.gradient && !want.hessian) continue;
    const double force = weight * law.line_force(overlap);
    const Movers movers = movers_of(cell, unknowns, contact, own, u, at);
    if (want.gradient) {
      const Vec3 push = -force / distance * at.separation;
      for (std::size_t a = 0; a < movers.count; ++a) {
        const Mover& m = movers.of[a];
        if (m.axis < 0) {
          part.gradient.segment<3>(3 * Eigen::Index{m.node}) += m.c * push;
        } else {
          part.gradient[m.unknown] += m.c * push[m.axis];
        }
      }
    }
    if (want.hessian) add_hessian(at, movers, unknowns, distance, force, weight * line_force_slope(law, overlap), want);
  }
}

/// Sharpest bend of an axis near a point, toward the point: curvature times `reach`. `node`, `shift`: closest span, and its image [m].
double bend_toward(const Cell& cell, const Eigen::VectorXd& q, const Vec3& point, std::uint32_t node, const Vec3& shift, double reach) {
  const Vec3 period = cell.period(cell.fiber_of[node], q);
  const Cell::ChainNode before = cell.before(node), after = cell.after(node);
  double bend = 0;
  for (const Cell::ChainNode n : {before, Cell::ChainNode{node, 0}, after}) {
    const Span span(cell, q, n.node);
    const Vec3 toward = point - shift - n.wrap * period - span.point(0.5);
    const double distance = toward.norm();
    if (distance < bend_seen_within * reach)
      bend = std::max(bend, reach * toward.dot(span.curve) / (distance * span.tangent(0.5).squaredNorm()));
  }
  return bend;
}

/// 0 for bends that leave the closest point unique, 1 for sharp ones.
double sharpness(double bend) {
  const double u = std::clamp((bend - bend_mild) / (bend_sharp - bend_mild), 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

}  // namespace

int samples_on(const Cell& cell, std::uint32_t span, std::uint32_t other, const ContactSampling& sampling) {
  constexpr double round_off = 1e-9;  // of a span's length, which is often a whole number of diameters: the same spans get as many points
  const std::uint32_t f = cell.fiber_of[span], g = cell.fiber_of[other];
  const double d = 2 * std::min(cell.type_of(f).radius, cell.type_of(g).radius);
  const double apart = cell.yarn[f] == cell.yarn[g] ? sampling.within_yarn : sampling.between_yarns;
  return std::max(1, static_cast<int>(std::ceil((1 - round_off) * cell.span_length(span) / (apart * d))));
}

void share_contacts(const Cell& cell, const Eigen::VectorXd& q, ContactList& list) {
#pragma omp parallel for schedule(static)
  for (std::size_t i = 0; i < list.contacts.size(); ++i) {
    SpanContact& contact = list.contacts[i];
    const double reach = cell.pair_law(cell.fiber_of[contact.span], cell.fiber_of[contact.other]).reach;
    const Span own(cell, q, contact.span);
    const Vec3 middle = own.point(0.5);
    const ChainPoint at = closest_on_chain(cell, q, middle, contact.other, image_shift(cell, q, contact.image_x, contact.image_y));
    if (!at.found) continue;
    const double of_other = sharpness(bend_toward(cell, q, middle, at.span.node[1], at.shift, reach));
    const double of_own = sharpness(bend_toward(cell, q, at.span.point(at.share) + at.shift, contact.span, Vec3::Zero(), reach));
    contact.share = 0.5 * (1 - of_other + of_own);
  }
}

void measure_gaps(const Cell& cell, const Eigen::VectorXd& q, const SpanContact& contact, const ContactSampling& sampling,
                  std::vector<double>& gap) {
  const Span own(cell, q, contact.span);
  const Vec3 shift = image_shift(cell, q, contact.image_x, contact.image_y);
  const double reach = cell.pair_law(cell.fiber_of[contact.span], cell.fiber_of[contact.other]).reach;
  const int samples = samples_on(cell, contact.span, contact.other, sampling);
  gap.clear();
  for (int s = 0; s < samples; ++s) {
    const ChainPoint at = closest_on_chain(cell, q, own.point((s + 0.5) / samples), contact.other, shift);
    gap.push_back(at.found ? at.separation.norm() - reach : -std::numeric_limits<double>::infinity());
  }
}

void number_samples(const Cell& cell, ContactList& list) {
  list.first_sample.assign(1, 0);
  for (const SpanContact& c : list.contacts)
    list.first_sample.push_back(list.first_sample.back() + static_cast<std::size_t>(samples_on(cell, c.span, c.other, list.sampling)));
}

double contact_energy(const Cell& cell, const ContactList& list, const Eigen::VectorXd& q, Derivatives want, ContactState* state) {
  if (list.contacts.empty()) return 0;
  const Unknowns unknowns(cell);
  const std::vector<double> way = ways_since(cell, list, q);
  std::array<PartOfContacts, work_parts> part;
#pragma omp parallel for schedule(dynamic, 1) if (want.hessian == nullptr)
  for (std::size_t p = 0; p < work_parts; ++p) {
    if (want.gradient) part[p].gradient = Eigen::VectorXd::Zero(q.size());
    part[p].state.want_overlaps = state && state->want_overlaps;
    for (std::size_t i = p * list.contacts.size() / work_parts; i < (p + 1) * list.contacts.size() / work_parts; ++i) {
      const SpanContact& contact = list.contacts[i];
      const double other = std::max({way[cell.before(contact.other).node], way[contact.other], way[cell.after(contact.other).node]});
      evaluate(cell, unknowns, list, i, way[contact.span] + other, q, want, part[p]);
    }
  }
  double energy = 0;
  for (const PartOfContacts& p : part) {
    energy += p.energy;
    if (want.gradient) *want.gradient += p.gradient;
    if (!state) continue;
    state->touching += p.state.touching;
    state->overlaps.insert(state->overlaps.end(), p.state.overlaps.begin(), p.state.overlaps.end());
    state->overlap_max = std::max(state->overlap_max, p.state.overlap_max);
  }
  return energy;
}

EnergyParts potential(const Cell& cell, const Unknowns& unknowns, const ContactList& list, const Eigen::VectorXd& q, Derivatives want,
                      ContactState* state) {
  if (want.gradient) want.gradient->setZero(unknowns.size);
  if (want.hessian) want.hessian->set_zero();
  EnergyParts parts_of;
  parts_of.bars = bar_energy(cell, unknowns, q, want, &parts_of.tension);
  parts_of.bending = bending_energy(cell, q, want);
  parts_of.contact = contact_energy(cell, list, q, want, state);
  parts_of.platens = platen_energy(cell, unknowns, q, want);
  parts_of.loads = load_energy(cell, unknowns, q, want);
  return parts_of;
}

}  // namespace relax
