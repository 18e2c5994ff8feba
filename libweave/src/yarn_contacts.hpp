#pragma once
#include <array>
#include <cstdint>

#include "contact_lanes.hpp"

namespace weave {

/// Contacts between the fibers of one yarn, eight at a time. They are most of what touches, and each by itself is a chain of arithmetic in
/// which every number waits for the one before. Taken are those that touch, away from the fibers' ends and seams; those of them that part,
/// leave their span or are found inside by what motion does not explain are then left to be evaluated one by one.
class YarnContacts {
 public:
  void clear() { count_ = 0; }
  /// Takes a contact to be evaluated, if it is of this kind. Returns its place, or -1.
  int take(const ContactTarget& at, FiberPairs& pairs, const LineContact& contact, const Touch& touch);
  /// Evaluates those taken. Changes nothing else.
  void evaluate(const ContactTarget& at, FiberPairs& pairs);
  /// Whether the one at a place goes on to touch as it did.
  [[nodiscard]] bool holds(int place) const { return batch_[batch_of(place)].holds[place % lanes]; }
  /// Adds what a contact, at a place that holds, does to its own fiber, changes its state, and tells its reaction on the other fiber. What
  /// its node feels is added by `flush`, or with a contact of the next node.
  void apply(int place, const ContactTarget& at, const LineContact& contact, Touch& touch, Reaction& reaction, ContactSums& sums);
  void flush(const ContactTarget& at);

 private:
  static constexpr int capacity = 32;

  /// What eight contacts are evaluated from, and what comes of it.
  struct Batch {
    LaneVectors point;                   ///< as the touched fiber's image has it
    NodeVectorLanes position, velocity;  ///< of the touched span's nodes
    NodeNumberLanes amplitude;           ///< likewise
    LaneVectors speed;                   ///< of the point
    LaneNumbers turn, reach, line, way;  ///< of the yarn's section, PairLaw, approach
    LaneNumbers weight;                  ///< length of fiber that the point stands for [m]
    TouchLanes touch;
    LaneFlags holds;
    LaneNumbers u, inside, ratio, pressing;  ///< inside: overlap [m]; ratio: over the reach; pressing: what of it pushes [m]
    LaneNumbers couple, lost, swing;         ///< swing: of ContactStiffness
    LaneVectors force;                       ///< on the point
    SpanForceLanes reaction;
    StiffnessLanes felt;
  };

  static void compute(const ContactTarget& at, Batch& b);

  static std::size_t batch_of(int place) { return static_cast<std::size_t>(place / lanes); }

  std::array<Batch, capacity / lanes> batch_;
  int count_ = 0;
  const LineContact* last_contact_ = nullptr;  ///< taken; fills the lanes that nothing came to
  const Touch* last_touch_ = nullptr;

  static constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t taken_at_ = none;  ///< node that these two are of
  Vec3 middle_ = Vec3::Zero(), speed_ = Vec3::Zero();
  double swing_ = 0;
  std::uint32_t felt_at_ = none;        ///< node that these are of
  DirectionalStiffness::Numbers felt_;  ///< sum of its contacts' springs, each times its swing
};

}  // namespace weave
