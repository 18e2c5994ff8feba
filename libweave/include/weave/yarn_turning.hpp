#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "weave/contact.hpp"
#include "weave/model.hpp"

namespace weave {

/// How the sections of yarns turn about the yarns' axes, so that friction between fibers of one yarn can tell their sliding over one
/// another, which it resists, from the turning of the yarn as a whole, which it must not notice. A section is made of the nodes of a yarn's
/// fibers that lie beside one another; it turns at that rate about its centroid which takes the fibers' angular momentum, were their masses
/// equal: w = sum (c x v).t / sum |c x t|^2, c from the centroid, t along the yarn.
class YarnTurning {
 public:
  explicit YarnTurning(const Model& model);
  /// Finds the sections anew; x: the nodes' positions (nodes) [m]. Nodes beyond `active_x_max` are in no section.
  void align(const Model& model, std::span<const Vec3> x, double active_x_max);
  /// Leaves out the sections beyond the first and the last that a contact of the yarn's fibers asks for, until they are found anew.
  void leave_out_untouched(const Model& model, const ActiveContacts& contacts);

  /// Whether a fiber is the first of a yarn of several.
  [[nodiscard]] bool is_first(std::uint32_t fiber) const;
  /// Finds how the sections of that fiber's yarn turn. Each yarn has data of its own, so they can be done in any order, on any thread.
  void find(const Model& model, std::uint32_t first_fiber, std::span<const Vec3> x, std::span<const Vec3> v);

  /// Rate at which the section of each node turns (nodes) [rad/s]; 0: it is in none.
  [[nodiscard]] std::span<const double> rate() const { return rate_; }
  /// Work that friction does per angle as a node's section turns (nodes) [N m]: the contacts of fiber f add to its nodes' own.
  [[nodiscard]] std::span<double> couple() { return couple_; }

  /// Forces on a fiber's nodes by the couples of their sections' nodes, summed, once all are known (the adjoint of `rate`): without a
  /// resultant, they take the moment that the friction forces of two fibers have as they act at a distance. Adds to `force` (nodes) [N].
  void add_forces(std::uint32_t fiber, std::span<const Vec3> x, std::span<Vec3> force) const;

 private:
  struct Yarn {
    std::vector<std::uint32_t> fibers;  ///< at least two, rising
    std::vector<std::uint32_t> start;   ///< of each fiber: its node in the yarn's first section
    std::uint32_t sections = 0, first = 0;
    NodeRange needed;  ///< sections that are not left out
  };
  struct Section {
    Vec3 centroid, axis;
    double inverse_inertia = 0;  ///< of sum |c x t|^2 [1/m^2]
  };
  std::vector<Yarn> yarn_;
  std::vector<std::uint32_t> yarn_of_;  ///< by fiber; or none
  std::vector<Section> section_;        ///< those of a yarn from its `first` on
  std::vector<double> rate_, couple_;
};

}  // namespace weave
