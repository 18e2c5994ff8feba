#pragma once
#include <span>
#include "weave/contact.hpp"

namespace weave {

/// Finds all contacts between fibers that can come about while no two of them approach by more than the skin (cell grid, periodic in y),
/// and keeps the friction of those that stood in the old list. Only nodes around which something has moved are searched anew; cloth at rest
/// costs nothing. Bits do not depend on the number of threads. active_x_max: nodes beyond it (the stored warp) touch nothing [m].
class NeighborSearch {
 public:
  /// Adds to `moved` (nodes) [m] the farthest that a node near each can have gone from `x_before` to the present: nodes within two slabs of
  /// x as wide as the reach of the list. Infinite at and around a node that comes into the active part; a new model starts with infinity.
  static void note_motion(const Model& model, const FiberGeometry& geometry, std::span<const Vec3> x_before, double skin,
                          double active_x_max, std::vector<double>& moved);
  /// Searches for the contacts of all nodes that have `moved` farther than `moved_limit` [m] and sets that to zero; other nodes keep
  /// theirs.
  void build(const Model& model, const FiberGeometry& geometry, double skin, double active_x_max, double moved_limit,
             std::vector<double>& moved, ContactList& contacts);

 private:
  struct Bin {
    std::vector<std::uint32_t> start, span, fiber;
    std::vector<std::int32_t> wrap;  ///< periods by which the span's middle was shifted into the cell
    std::vector<Vec3> middle;        ///< of the span, in the cell
    std::vector<Vec3> tangent;       ///< there, unit
    Vec3 origin = Vec3::Zero(), size = Vec3::Ones();
    int nx = 0, ny = 0, nz = 0;
  };
  void bin_spans(const Model& model, const FiberGeometry& geometry, double reach, double active_x_max);
  void search_fiber(const Model& model, const FiberGeometry& geometry, std::uint32_t fiber, double skin, double active_x_max,
                    const std::vector<std::uint8_t>& stale, const ContactList& old, std::vector<FoundContact>& found) const;
  Bin bins_;
  double bar_max_ = 0, reach_max_ = 0;
  std::vector<std::vector<FoundContact>> found_;  ///< by fiber
  std::vector<std::uint8_t> stale_;               ///< per node: whether to be searched, and why
  std::vector<std::uint32_t> cell_;               ///< per node: of its span; beyond the last where it is not searched
};

}  // namespace weave
