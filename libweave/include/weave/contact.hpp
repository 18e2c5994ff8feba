#pragma once
#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "weave/axis.hpp"
#include "weave/stiffness.hpp"

namespace weave {

/// State of a contact of fiber a on fiber b while they touch. The tangential spring's force on a is along t_b + across (t_a - (t_a.t_b)
/// t_b), with the tangents t; in the contacts of one yarn's fibers, which run side by side, t_a stands for n x t_b, n the normal.
struct Touch {
  double along = 0;      ///< [N]
  double across = 0;     ///< [N]
  double stiffness = 0;  ///< of the spring at the last step [N/m]; 0: none
  float overlap = 0;     ///< at the last step, of the deepest sample [m]; 0: they were apart
  /// Of the overlap that does not push [m]. Where a fiber bends sharply the closest place of it may vanish and another one, inside already,
  /// be found in its stead; pushing at once would make energy of nothing, so what motion does not explain is spared until it is drawn out.
  float spared = 0;
  [[nodiscard]] bool is_held() const { return overlap > 0; }

  /// Notes the overlap of a step [m], negative if apart, and how much motion can explain.
  void note(double now, double explained);
};

/// Point of one fiber against the closest point of another fiber's axis: the line contact of the pair, integrated at points along one
/// of the two. Fibers of one yarn run side by side and the middles of their spans are points enough; fibers of different yarns may cross,
/// so there the points are not farther apart than half a diameter, and the law is sampled an eighth of a diameter apart around each that is
/// near a touch. A reed bar has no points of its own: the points of the fibers stand for the whole of their contact with it. Friction acts
/// on material slip: along the touched fiber the change of the closest point's arc length, and across it, the more the steeper the fibers
/// cross, the slip along the point's own fiber. Digital fibers, bundles themselves, do not turn about their axes but with their yarn: those
/// of one yarn slip across by their motion over one another less the turning of the yarn's section (YarnTurning). No rigid motion alters
/// any of these; parallel fibers of two yarns are free to roll over one another.
struct LineContact {
  std::uint32_t node = 0;   ///< of the point's span
  std::uint32_t span = 0;   ///< node of the touched span; follows the closest point from step to step
  std::int32_t image = 0;   ///< the touched fiber is shifted by image * period_y
  float at = 0;             ///< of the point along its span: u = -1/2...1/2
  double asleep_until = 0;  ///< travel of the two spans, summed, before which they can not touch; 0: not known, or touching [m]
};

/// A contact found, with its state if it touched before.
struct FoundContact {
  LineContact line;
  Touch touch;
};

/// How a contact resists motion, for the bound on the time step.
struct ContactStiffness {
  DirectionalStiffness springs;
  float swing = 0;  ///< sum of the two ends' amplitudes, Y of DirectionalStiffness; 0: c = 2

  /// Adds a share of it to what a node that swings by `amplitude` feels.
  void add_to(DirectionalStiffness& node, double share_of_end, double amplitude) const {
    node.k += static_cast<float>(share_of_end * (swing > 0 ? swing / amplitude : 2)) * springs.k;
  }
};

/// Reaction of one contact on the touched fiber, gathered as that fiber is moved.
struct Reaction {
  SpanForce force;  ///< [N]
  ContactStiffness stiffness;
  float at;  ///< u on that span
  std::uint32_t span;
  bool active = false;
};

/// Where a contact's reactions are: on the bar at hand and on one beside it, at most. One number, as all contacts at hand are looked
/// through.
class ReactionsOfContact {
 public:
  ReactionsOfContact() = default;
  ReactionsOfContact(std::uint32_t begin, std::uint32_t end) : packed_(4 * begin + (end - begin)) {}
  [[nodiscard]] std::uint32_t begin() const { return packed_ / 4; }
  [[nodiscard]] std::uint32_t end() const { return begin() + packed_ % 4; }
  [[nodiscard]] bool any() const { return packed_ % 4 > 0; }

 private:
  std::uint32_t packed_ = 0;
};

/// Those contacts that are near enough to be evaluated, one after the other in memory.
struct ActiveContacts {
  std::vector<std::uint32_t> number;       ///< in the list, rising
  std::vector<LineContact> line;           ///< as they have been followed since they were picked
  std::vector<Touch> touch;                ///< of the point's own bar on the touched one
  std::vector<std::uint32_t> of;           ///< those of fiber f: of[f] ... of[f+1]-1
  std::vector<std::uint32_t> place;        ///< of each among those sorted by touched fiber, then by number
  std::vector<std::uint32_t> place_of;     ///< places of those that touch fiber f: place_of[f] ... place_of[f+1]-1
  std::vector<ReactionsOfContact> reacts;  ///< by place
  std::vector<Reaction> reaction;          ///< those of fiber f's contacts from 2 of[f] on, one after the other
};

/// Everything within the outer skin is listed at a search; what is within the inner skin is picked from the list more often. What touches
/// is always among the picked. The reed, which moves much faster than what it passes, has contacts of its own, found anew at each of its
/// picks.
struct ContactList {
  std::vector<LineContact> line;       ///< sorted by node; those picked as they were then
  std::vector<std::uint32_t> line_of;  ///< contacts of fiber f: line_of[f] ... line_of[f+1]-1
  ActiveContacts active;
  ActiveContacts on_reed;  ///< `number` counts them
};

/// Geometry that contact reads: the axes of the present step, and how they move. Sizes: nodes.
struct FiberGeometry {
  std::span<const Vec3> x, v;
  std::span<const double> travel;       ///< longest way that a node near this one can have gone since the start [m]
  std::span<const double> reach_ahead;  ///< longest way that it can have gone after the next step [m]
  std::span<const double> turn;         ///< of the yarn's section through the node, about the yarn's axis [rad/s]
  std::span<const double> amplitude;    ///< guess at how far each node swings in the fastest oscillation, relative, positive

  /// Around a fiber's node that is no ghost. Made anew each time: its nodes' places take a quarter of the memory, and memory is what a step
  /// of many fibers waits for.
  [[nodiscard]] Span span(const Model& m, std::uint32_t fiber, std::uint32_t node) const {
    return span_at(m, fiber, node, x, Vec3(0, m.period_y, 0));
  }
};

/// Nodes from the first to the last of those that were added.
struct NodeRange {
  std::uint32_t begin = std::numeric_limits<std::uint32_t>::max(), end = 0;
  void add(std::uint32_t node) { *this |= {node, node + 1}; }
  NodeRange& operator|=(const NodeRange& o) {
    begin = std::min(begin, o.begin);
    end = std::max(end, o.end);
    return *this;
  }
  [[nodiscard]] bool empty() const { return begin >= end; }
  [[nodiscard]] bool has(std::uint32_t node) const { return begin <= node && node < end; }
};

/// What the spans of two nodes may come nearer to one another by in the next step, and have come by in the last one at most [m].
inline double approach(const FiberGeometry& g, std::uint32_t a, std::uint32_t b) {
  return g.reach_ahead[a] - g.travel[a] + g.reach_ahead[b] - g.travel[b];
}

/// Sums over the contacts owned by one fiber.
struct ContactSums {
  NodeRange nodes;                           ///< whose spans' points were looked at
  double overlap_max = 0;                    ///< largest overlap / reach
  std::uint32_t node_max = 0, span_max = 0;  ///< where
  double slip_loss = 0;                      ///< energy lost in this step by slip and by change of the friction springs [J]
  double energy = 0;                         ///< only where asked for
  double friction_store = 0;                 ///< only where asked for
  std::uint32_t touching = 0;
};

/// Share of the contact of two fibers that the points of the first stand for: all or nothing, so that each pair is evaluated once; half for
/// a fiber on its own images and for the node-to-node law. The fibers of a model take turns by the numbers of yarns and places.
double share_of_points(const Model& model, std::uint32_t fiber_a, std::uint32_t fiber_b);
/// Whether the nodes are the points of the contact of a fiber on another: they are of one yarn, or the law is node-to-node (never on a reed
/// bar).
bool meets_at_nodes(const Model& model, std::uint32_t fiber_a, std::uint32_t fiber_b);
/// Distance of a point of `fiber` from the axis of `other` within which the fibers may touch: the point's samples lie to both sides of it
/// [m].
double touch_reach(const Model& model, std::uint32_t fiber, std::uint32_t other);
Vec3 contact_point(const Model& model, const FiberGeometry& geometry, const LineContact& contact);
/// Spans along the touched fiber between two contacts of one point; the largest number if they are not of one point and fiber.
std::int64_t spans_apart(const Model& model, const LineContact& a, const LineContact& b);

/// Lets a contact that does not touch sleep for as long as its fibers, apart by `gap` [m], need to come near a touch. It then costs next to
/// nothing and the result does not change, as only a contact that is near counts.
void let_sleep(const FiberGeometry& geometry, double gap, LineContact& contact);

/// Forces of the contacts owned by `fiber` (its points against other fibers). Adds to `force` and `stiffness`
/// of the fiber's own nodes only, ghosts included, and to `couple` what friction does there as the yarn turns (YarnTurning::couple), and
/// stores the reactions; so fibers can be evaluated in any order, on any thread, to the same bits.
ContactSums evaluate_contacts(const Model& model, const FiberGeometry& geometry, std::uint32_t fiber, double dt, bool with_energy,
                              ContactList& contacts, std::span<Vec3> force, std::span<DirectionalStiffness> stiffness,
                              std::span<double> couple);

/// Adds the stored reactions on `fiber` to its nodes, in a fixed order. Returns the nodes of the spans that are touched.
NodeRange gather_reactions(const Model& model, const FiberGeometry& geometry, const ContactList& contacts, std::uint32_t fiber,
                           std::span<Vec3> force, std::span<DirectionalStiffness> stiffness);

/// A bent fiber must not push itself: whether a span of the node's own fiber lies within half a turn of its tightest bend from the node.
bool within_own_bend(const Model& model, std::uint32_t fiber, std::uint32_t node, std::uint32_t span, std::int32_t image);

/// Closest point of a fiber's axis to a point, starting from `span` and `image` and walking along the fiber.
struct AxisPoint {
  double u = 0;     ///< on the span
  Vec3 separation;  ///< from the closest point to the point
  double distance2 = 0;
};
AxisPoint walk_to_point(const Model& model, const FiberGeometry& geometry, const Vec3& point, std::uint32_t& span, std::int32_t& image);

}  // namespace weave
