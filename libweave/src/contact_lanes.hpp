#pragma once
#include "contact_terms.hpp"

namespace weave {

/// Contacts that are evaluated side by side.
constexpr int lanes = 8;
using LaneNumbers = Numbers<lanes>;
using LaneVectors = Vectors<lanes>;
using LaneFlags = Eigen::Array<bool, lanes, 1>;

/// Axes of spans (Span), each seen from its own middle.
struct AxisLanes {
  LaneVectors slope, curve;

  [[nodiscard]] LaneVectors from_middle(const LaneNumbers& u) const { return slope.times(u) + curve.times(0.5 * u * u); }
  [[nodiscard]] LaneVectors tangent(const LaneNumbers& u) const { return slope + curve.times(u); }
  /// u of the points nearest to points r from the middles.
  [[nodiscard]] LaneNumbers nearest(const LaneVectors& r) const {
    const LaneNumbers slope2 = slope.dot(slope);
    const NearnessCubic<LaneNumbers> cubic{slope2, slope.dot(curve), curve.dot(curve)};
    return nearest_on_spans<LaneNumbers, lanes>(cubic, r.dot(slope), slope2 - r.dot(curve));
  }
};

/// Spans.
struct SpanLanes : AxisLanes {
  LaneNumbers low, high;

  void set(int k, const Span& s) {
    slope.set(k, s.slope);
    curve.set(k, s.curve);
    low[k] = s.low;
    high[k] = s.high;
  }
  [[nodiscard]] LaneFlags has(const LaneNumbers& u) const { return u >= low && u <= high; }
};

/// Shares of the nodes before, at and after inner spans that carry a place (node_shares), and their slopes.
struct ShareLanes {
  LaneNumbers before, here, after;

  static ShareLanes at(const LaneNumbers& u) { return {0.5 * (0.5 - u) * (0.5 - u), 0.75 - u * u, 0.5 * (0.5 + u) * (0.5 + u)}; }
  static ShareLanes slope_at(const LaneNumbers& u) { return {u - 0.5, -2 * u, u + 0.5}; }
};

/// What the nodes before, at and after inner spans carry.
struct NodeVectorLanes {
  LaneVectors before, here, after;

  void set(int k, std::span<const Vec3> y, std::uint32_t span) {
    before.set(k, y[span - 1]);
    here.set(k, y[span]);
    after.set(k, y[span + 1]);
  }
  [[nodiscard]] LaneVectors sum(const ShareLanes& s) const { return before.times(s.before) + here.times(s.here) + after.times(s.after); }
};
struct NodeNumberLanes {
  LaneNumbers before, here, after;

  void set(int k, std::span<const double> y, std::uint32_t span) {
    before[k] = y[span - 1];
    here[k] = y[span];
    after[k] = y[span + 1];
  }
  [[nodiscard]] LaneNumbers sum(const ShareLanes& s) const { return before * s.before + here * s.here + after * s.after; }
};

/// Inner spans between nodes.
struct InnerSpanLanes : AxisLanes {
  LaneVectors middle;

  explicit InnerSpanLanes(const NodeVectorLanes& x)
      : AxisLanes{(x.after - x.before).times(0.5), x.before + x.after - x.here.times(2)},
        middle((x.before + x.after).times(0.125) + x.here.times(0.75)) {}
  [[nodiscard]] static LaneFlags has(const LaneNumbers& u) { return u.abs() <= 0.5; }
};

/// Whether a span has a node before and one after it that are stored beside its own.
inline bool is_inner_span(const Model& m, std::uint32_t fiber, std::uint32_t span) {
  return span > m.first[fiber] && span + 1 < m.first[fiber] + m.own_nodes(fiber);
}

/// Touch.
struct TouchLanes {
  LaneNumbers along, across, stiffness, overlap, spared;

  void set(int k, const Touch& t) {
    along[k] = t.along;
    across[k] = t.across;
    stiffness[k] = t.stiffness;
    overlap[k] = t.overlap;
    spared[k] = t.spared;
  }
  /// `inside`: the overlap of this step [m], above what was spared.
  void get(int k, double inside, Touch& t) const {
    t.along = along[k];
    t.across = across[k];
    t.stiffness = stiffness[k];
    t.overlap = static_cast<float>(inside);
    t.spared = std::min(t.spared, t.overlap);
  }

  /// Moves the springs as `slide` does one of them; returns what is lost [J].
  LaneNumbers slide(const LaneNumbers& slip_along, const LaneNumbers& slip_across, const LaneNumbers& sine2, const LaneNumbers& spring,
                    const LaneNumbers& cap, const LaneNumbers& interlock) {
    const LaneNumbers softness = (stiffness > 0).select(1 / stiffness, 0), share = (spring * softness).min(1);
    LaneNumbers f = along * share - spring * slip_along;
    const LaneNumbers wanted = across * share - spring * slip_across;
    const LaneNumbers locked = wanted.max(-interlock).min(interlock), free = wanted - locked;
    const LaneNumbers force2 = f * f + sine2 * free * free;
    const LaneNumbers back = (force2 > cap * cap).select(cap / root(force2), 1);
    f *= back;
    const LaneNumbers a = locked + back * free;
    const LaneNumbers lost = 0.5 * ((along * along + across * across) * softness - (f * f + a * a) / spring - (along + f) * slip_along -
                                    (across + a) * slip_across);
    along = f;
    across = a;
    stiffness = spring;
    return lost;
  }
};

/// DirectionalStiffness.
struct StiffnessLanes {
  LaneNumbers xx, yy, zz, xy, xz, yz;

  static StiffnessLanes along(const LaneVectors& n, const LaneNumbers& normal, const LaneNumbers& across) {
    const LaneNumbers k = normal - across;
    return {k * n.x * n.x + across, k * n.y * n.y + across, k * n.z * n.z + across, k * n.x * n.y, k * n.x * n.z, k * n.y * n.z};
  }
  void get(int k, DirectionalStiffness& s) const {
    s.k << static_cast<float>(xx[k]), static_cast<float>(yy[k]), static_cast<float>(zz[k]), static_cast<float>(xy[k]),
        static_cast<float>(xz[k]), static_cast<float>(yz[k]), 0, 0;
  }
};

/// SpanForce.
struct SpanForceLanes {
  LaneVectors on_middle, on_slope, on_curve;

  void add(const LaneVectors& force, const LaneNumbers& u) {
    on_middle = on_middle + force;
    on_slope = on_slope + force.times(u);
    on_curve = on_curve + force.times(0.5 * u * u);
  }
  void add_to_tangent(const LaneVectors& pull, const LaneNumbers& u) {
    on_slope = on_slope + pull;
    on_curve = on_curve + pull.times(u);
  }
  [[nodiscard]] SpanForce operator[](int k) const { return {on_middle[k], on_slope[k], on_curve[k]}; }
};

}  // namespace weave
