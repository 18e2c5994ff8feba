#pragma once
#include <random>
#include <string>

#include "relax/cell.hpp"
#include "relax/energy.hpp"
#include "weave/case.hpp"

/// Unit cells that tests of relaxation share.
namespace scenes {

/// Plain weave of two warps and two wefts at a given pitch, with fibers of 0.1 mm in diameter.
struct PlainWeave {
  int fibers = 1;
  double pitch = 6e-4;                                    ///< [m]
  double youngs_modulus = 1e9, transverse_modulus = 1e9;  ///< [Pa]
  int repeat_x = 1, repeat_y = 1;                         ///< of the weave's repeat in the cell
};
weave::Case plain_weave(const PlainWeave& weave);

struct PosedCell {
  relax::Cell cell;
  std::vector<weave::Vec3> x;
  [[nodiscard]] Eigen::VectorXd unknowns() const { return relax::unknowns_at(cell, x); }
};

/// Its start from topology under equal tensions per yarn [N].
PosedCell plain_weave_cell(const PlainWeave& weave, double tension, double element_length = 2);

/// One cell with room for hand-made fibers of 0.1 mm in diameter.
relax::Cell empty_cell(double length_x, double length_y, double youngs_modulus = 1e9, double transverse_modulus = 1e9);

/// Straight fiber along the cell through a point, nodes evenly spread [m].
relax::CellFiber straight_fiber(const relax::Cell& cell, bool weft, const weave::Vec3& through, int nodes, int yarn, double tension);

/// Adds a normal deviate of the given size to each unknown [m].
void shake(Eigen::VectorXd& q, double size, std::uint64_t seed);

}  // namespace scenes
