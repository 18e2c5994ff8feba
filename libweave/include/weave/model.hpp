#pragma once
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "weave/contact_law.hpp"
#include "weave/vec.hpp"

namespace weave {

enum class Role : std::uint8_t { reed, warp, weft };

/// Properties shared by the digital fibers of one yarn type.
struct FiberType {
  double radius = 0;                           ///< for contact [m]
  double area = 0;                             ///< solid [m^2]
  double youngs_modulus = 0;                   ///< [Pa]
  double compression_factor = 1;               ///< of the axial stiffness in compression
  double transverse_modulus = 0;               ///< E_T [Pa]
  double density = 0;                          ///< solid [kg/m^3]
  double bending_stiffness = 0;                ///< E I of one digital fiber [N m^2]
  std::optional<double> friction_within = {};  ///< Coulomb's, between the fibers of a yarn; else the model's
};

/// Fibers as chains of nodes, stored fiber after fiber. A periodic fiber (a weft) closes on itself across the cell: its last node is a
/// ghost, the first node's image at y + period_y. Nothing in here changes between two edits of the topology (at the start of a pick).
struct Model {
  double period_y = 0;         ///< cell width [m]; 0: not periodic
  double friction = 0;         ///< Coulomb coefficient between fibers, if their yarn gives none of its own
  double damping = 0;          ///< mass-proportional [1/s]
  double axial_damping = 0;    ///< of the bars, fraction of critical for one bar between two node masses
  bool implicit_axial = true;  ///< axial terms implicit (IMEX), else explicit
  bool node_contact = false;   ///< node-to-node contact law of Yang 2015 instead of line contact

  /// Heddle plane: behind it a warp is guided in y and z, and touches nothing [m].
  double guide_x = std::numeric_limits<double>::infinity();
  double guide_ramp = 0;  ///< length over which the guide takes hold behind the plane [m]

  std::vector<FiberType> types;
  std::vector<PairLaw> pair_laws;  ///< (types x types)

  // per fiber
  std::vector<std::uint32_t> first;  ///< nodes first[f] ... first[f+1]-1, ghosts included; size fibers + 1
  std::vector<Role> role;
  std::vector<std::uint8_t> periodic;
  std::vector<std::uint16_t> type;
  std::vector<int> yarn;                ///< yarn number; warps 0...n_warps-1, wefts n_warps + pick, reed bars -1
  std::vector<int> place;               ///< of the fiber in its yarn
  std::vector<double> end_force;        ///< constant pull along +x at the last node [N]
  std::vector<double> guide_stiffness;  ///< of the heddle guide on one node [N/m]; 0: no guide
  std::vector<double> guide_y;          ///< [m]
  std::vector<std::uint32_t> points;    ///< on each bar against other yarns: no farther apart than half a diameter
  std::vector<double> point_length;     ///< rest length of fiber that each of them stands for [m]

  // per node
  std::vector<double> rest_length;   ///< of the bar from this node to the next [m]; 0 at a fiber's last node
  std::vector<double> tributary;     ///< rest length of fiber that the node stands for [m]; 0 for a ghost
  std::vector<double> mass;          ///< lumped [kg]; a ghost has none of its own
  std::vector<double> inverse_mass;  ///< 0: held, moved at a given velocity
  std::vector<std::uint32_t> fiber_of;

  [[nodiscard]] std::size_t fibers() const { return role.size(); }
  [[nodiscard]] std::size_t nodes() const { return mass.size(); }
  [[nodiscard]] const FiberType& type_of(std::size_t fiber) const { return types[type[fiber]]; }
  [[nodiscard]] const PairLaw& pair_law(std::size_t fiber_a, std::size_t fiber_b) const {
    return pair_laws[type[fiber_a] * types.size() + type[fiber_b]];
  }
  /// Coulomb coefficient between this fiber and others of its yarn, across them; along them no more than `friction`.
  [[nodiscard]] double friction_within(std::size_t fiber) const { return type_of(fiber).friction_within.value_or(friction); }
  [[nodiscard]] bool has_friction() const;
  /// Last node of a fiber; the ghost of a periodic one.
  [[nodiscard]] std::uint32_t last(std::size_t fiber) const { return first[fiber + 1] - 1; }
  /// Number of nodes that carry mass.
  [[nodiscard]] std::uint32_t own_nodes(std::size_t fiber) const { return first[fiber + 1] - first[fiber] - periodic[fiber]; }
};

/// Adds a type and returns its number; call `finish_types` after the last.
std::uint16_t add_type(Model& model, const FiberType& type);
void finish_types(Model& model);

/// One fiber to be added to a model.
struct FiberSpec {
  Role role = Role::warp;
  bool periodic = false;  ///< closes across y; `x` without the ghost
  std::uint16_t type = 0;
  int yarn = 0, place = 0;
  std::vector<Vec3> x;              ///< nodes [m]
  std::vector<double> rest_length;  ///< bars; one fewer than nodes, or as many if periodic [m]
  bool hold_first = false, hold_all = false;
  double end_force = 0;  ///< [N]
  double guide_stiffness = 0, guide_y = 0;
};

/// Appends a fiber to the model and its positions (ghost included) to `x`. Velocities are the caller's.
void add_fiber(Model& model, const FiberSpec& spec, std::vector<Vec3>& x);

}  // namespace weave
