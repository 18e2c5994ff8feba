#pragma once
#include <array>

#include "contact_lanes.hpp"

namespace weave {

/// Closest points of contacts on the spans that they were on, eight at a time.
class NearestPoints {
 public:
  void clear() { count_ = 0; }
  /// Takes a contact to be looked at. Returns its place.
  int take(const ContactTarget& at, const LineContact& contact);
  void find(const ContactTarget& at);
  /// Whether the closest point at a place is on its span; if not, it is elsewhere on the fiber.
  [[nodiscard]] bool on_span(int place) const { return batch_[batch_of(place)].on_span[place % lanes]; }
  [[nodiscard]] AxisPoint operator[](int place) const;

 private:
  struct Batch {
    LaneVectors from_middle;  ///< of the touched span
    SpanLanes span;
    LaneNumbers u, distance2;
    LaneVectors separation;
    LaneFlags on_span;
  };
  static constexpr int capacity = 32;
  static std::size_t batch_of(int place) { return static_cast<std::size_t>(place / lanes); }

  std::array<Batch, capacity / lanes> batch_;
  int count_ = 0;
  const LineContact* last_ = nullptr;  ///< taken; fills the lanes that nothing came to
};

}  // namespace weave
