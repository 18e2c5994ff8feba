#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "weave/model.hpp"
#include "weave/vec.hpp"

namespace relax {

using weave::FiberType;
using weave::PairLaw;
using weave::Vec3;

/// Fibers of a unit cell that is periodic in x and y and free in z. A fiber is a chain of nodes that closes under a translation of the
/// lattice, a warp after +length_x, a weft after +length_y: on itself, or, as fibers change places in a yarn, on another fiber of its yarn.
/// The nodes are the control points of the fiber's axis, a quadratic B-spline: it has a tangent everywhere, so that the distance of two
/// fibers has a gradient everywhere, which that of two poly-lines lacks on the inside of a bend. Span i of the axis belongs to node i and
/// runs from the middle of the bar before it to the middle of the bar after it.
struct Cell {
  double length_x = 0, length_y = 0;  ///< where they are given, else at the start [m]
  /// Forces that pull the cell along x and along y, whose length is free then [N]; none: the length is given.
  std::optional<double> load_x, load_y;
  double pressure = 0;         ///< of two rigid, frictionless platens on the area of the given lengths [Pa]; 0: none
  double slack_strain = 1e-4;  ///< within this strain of its rest length a bar's stiffness passes from that in compression to E

  std::vector<FiberType> types;
  std::vector<PairLaw> pair_laws;  ///< (types x types)

  // per fiber
  std::vector<std::uint32_t> first;  ///< nodes first[f] ... first[f+1]-1; size fibers + 1
  std::vector<std::uint8_t> weft;
  std::vector<std::uint16_t> type;
  std::vector<int> yarn, place;         ///< as in weave::Snapshot
  std::vector<std::uint32_t> next;      ///< fiber that goes on where this one ends, a period later; a permutation of each yarn's fibers
  std::vector<std::uint32_t> previous;  ///< its inverse
  std::vector<double> tension;          ///< prescribed, the rest length being free [N]; 0: the rest lengths are given

  // per node
  std::vector<double> rest_length;  ///< of the bar from this node to the next [m]
  std::vector<std::uint32_t> fiber_of;

  [[nodiscard]] std::size_t fibers() const { return type.size(); }
  [[nodiscard]] std::size_t nodes() const { return fiber_of.size(); }
  [[nodiscard]] std::uint32_t nodes_of(std::size_t fiber) const { return first[fiber + 1] - first[fiber]; }
  [[nodiscard]] const FiberType& type_of(std::size_t fiber) const { return types[type[fiber]]; }
  [[nodiscard]] const PairLaw& pair_law(std::size_t fiber_a, std::size_t fiber_b) const {
    return pair_laws[type[fiber_a] * types.size() + type[fiber_b]];
  }
  /// The cell's lengths at given unknowns [m]: free ones are the last of these.
  [[nodiscard]] double length_x_at(const Eigen::VectorXd& q) const { return load_x ? length_x + q[q.size() - (load_y ? 2 : 1)] : length_x; }
  [[nodiscard]] double length_y_at(const Eigen::VectorXd& q) const { return load_y ? length_y + q[q.size() - 1] : length_y; }
  /// Axis along which a fiber closes.
  [[nodiscard]] Eigen::Index axis_of(std::size_t fiber) const { return weft[fiber] ? 1 : 0; }
  /// Translation after which a fiber closes [m].
  [[nodiscard]] Vec3 period(std::size_t fiber, const Eigen::VectorXd& q) const {
    return weft[fiber] ? Vec3(0, length_y_at(q), 0) : Vec3(length_x_at(q), 0, 0);
  }
  /// Rest length of fiber that span `node` stands for [m].
  [[nodiscard]] double span_length(std::uint32_t node) const { return 0.5 * (rest_length[node] + rest_length[before(node).node]); }

  /// A node in the endless chain of a fiber: its own node and the periods to add.
  struct ChainNode {
    std::uint32_t node;
    int wrap;
  };
  [[nodiscard]] ChainNode after(std::uint32_t node) const {
    const std::uint32_t f = fiber_of[node];
    return node + 1 < first[f + 1] ? ChainNode{node + 1, 0} : ChainNode{first[next[f]], 1};
  }
  [[nodiscard]] ChainNode before(std::uint32_t node) const {
    const std::uint32_t f = fiber_of[node];
    return node > first[f] ? ChainNode{node - 1, 0} : ChainNode{first[previous[f] + 1] - 1, -1};
  }
};

/// One fiber to be added to a cell.
struct CellFiber {
  bool weft = false;
  std::uint16_t type = 0;
  int yarn = 0, place = 0;
  double tension = 0;               ///< as in Cell [N]
  std::vector<Vec3> x;              ///< nodes, the first one's image left out; at least three [m]
  std::vector<double> rest_length;  ///< of the bars, as many as nodes [m]
};

/// Fills `pair_laws` from `types`.
void finish_types(Cell& cell);

/// Lets each fiber go on in `next` (fibers). Throws std::invalid_argument unless that is a permutation within each yarn.
void close_fibers(Cell& cell, const std::vector<std::uint32_t>& next);

/// Appends a fiber that closes on itself to the cell and its nodes to `x`. Throws std::invalid_argument for fewer than three nodes or a
/// rest length <= 0.
void add_fiber(Cell& cell, const CellFiber& fiber, std::vector<Vec3>& x);

/// Where the unknowns of a cell stand in one vector, all of them lengths [m]: three coordinates per node; then for each fiber of prescribed
/// tension the rest length that it has drawn in beyond the given one; then, under pressure, the heights of the lower and the upper platen;
/// then what each free length of the cell has grown by.
struct Unknowns {
  Eigen::Index nodes = 0;
  std::vector<Eigen::Index> drawn;                ///< per fiber; -1: none
  Eigen::Index platens = -1;                      ///< lower; upper is the next; -1: none
  std::array<Eigen::Index, 2> length = {-1, -1};  ///< of the cell along x, along y; -1: given
  Eigen::Index size = 0;

  explicit Unknowns(const Cell& cell);
  /// Half of what a step may bring two points of neighboring images together by, at most: the largest way of a node or a platen, and what
  /// the cell grows by [m].
  [[nodiscard]] double way(const Eigen::VectorXd& step) const;
  [[nodiscard]] Eigen::Index borders() const { return size - 3 * nodes; }
  /// Number of an unknown that is no node's among those.
  [[nodiscard]] Eigen::Index border(Eigen::Index unknown) const { return unknown - 3 * nodes; }
};

/// Nodes with which the middle of each span comes to a given point of its fiber's axis. Points taken as nodes would not do: an axis of wave
/// number k loses (k h)^2 / 8 of its height to nodes h apart, and yarns their crimp with it.
std::vector<Vec3> nodes_through(const Cell& cell, const std::vector<Vec3>& points);

/// Unknowns for nodes at `x`: no rest length drawn in, platens touching the highest and the lowest fiber.
Eigen::VectorXd unknowns_at(const Cell& cell, const std::vector<Vec3>& x);

/// Puts a cell at `q` under another pressure [Pa], everything else staying as it is: platens that were there stay where they are, new ones
/// touch the highest and the lowest fiber.
void set_pressure(Cell& cell, double pressure, Eigen::VectorXd& q);

/// Takes free lengths at `q` as those of the cell, and sets what they have grown by to zero. The platens keep their force.
void settle_lengths(Cell& cell, Eigen::VectorXd& q);

/// Point of a fiber's axis at `share` (0...1) of span `node` [m].
Vec3 axis_point(const Cell& cell, const Eigen::VectorXd& q, std::uint32_t node, double share);

}  // namespace relax
