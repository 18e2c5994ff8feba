#pragma once
#include <array>
#include <cstdint>

#include "contact_terms.hpp"

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
  static constexpr int lanes = 8, capacity = 32;
  using N = Numbers<lanes>;
  using V = Vectors<lanes>;

  /// Eight contacts: what they are evaluated from, and what comes of it.
  struct Batch {
    V separation, slope, curve;                ///< from the touched span's middle to the point; of that span
    N low, high;                               ///< of u
    V speed_before, speed_here, speed_after;   ///< of the point over the nodes of the touched span
    N swing_before, swing_here, swing_after;   ///< their amplitudes
    N turn, weight, reach, line, way;          ///< weight: length of fiber that the point stands for [m]
    N along, across, spring, overlap, spared;  ///< of Touch
    N u, inside, ratio, pressing;              ///< inside: overlap [m]; ratio: over the reach; pressing: what of it pushes [m]
    N couple, lost, swing;                     ///< swing: of the place on the touched fiber
    V force, on_slope;                         ///< on the point; on the touched span's slope, beside the force at u
    N xx, yy, zz, xy, xz, yz;                  ///< of DirectionalStiffness
    Eigen::Array<bool, lanes, 1> holds;
  };

  static void compute(const ContactTarget& at, Batch& b);

  static std::size_t batch_of(int place) { return static_cast<std::size_t>(place / lanes); }

  std::array<Batch, capacity / lanes> batch_;
  int count_ = 0;
  const LineContact* last_contact_ = nullptr;  ///< taken; fills the lanes that nothing came to
  const Touch* last_touch_ = nullptr;

  static constexpr auto none = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t taken_at_ = none;  ///< node that these two are of
  Vec3 speed_ = Vec3::Zero();
  double swing_ = 0;
  std::uint32_t felt_at_ = none;        ///< node that these are of
  DirectionalStiffness::Numbers felt_;  ///< sum of its contacts' springs, each times its swing
};

}  // namespace weave
