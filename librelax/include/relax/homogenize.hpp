#pragma once
#include <filesystem>
#include <string>

#include "relax/deck.hpp"

namespace relax {

struct HomogenizeOptions {
  std::string ccx = "ccx";  ///< CalculiX: a program on the PATH, or its path
  LinearSolver solver = LinearSolver::iterative;
  bool periodic_z = true;  ///< else the sides normal to z are free
  int bins = 10;           ///< of local volume fraction
  std::string title = {};
};

struct Homogenization {
  /// Mean stress per macroscopic strain, Voigt's order, symmetrized [Pa]. With free sides normal to z only the rows and columns of xx, yy
  /// and xy are set; they are those of a layer that can not bend.
  Matrix6 stiffness = Matrix6::Zero();
  double asymmetry = 0;    ///< largest |C_ij - C_ji| / 2 before, over the largest entry: the solver's error
  double bin_width = 0;    ///< of local volume fraction
  std::size_t capped = 0;  ///< elements, as in MaterialBins
  StiffnessBounds bounds;  ///< with free sides of a layer in plane stress; Reuss' then bounds nothing, as mean stresses out of the plane
                           ///< vanish, but not the local ones
  double solve_wall = 0;   ///< [s]
};

/// Path of the program if it can be run; throws std::runtime_error saying how to get CalculiX if not.
std::filesystem::path find_ccx(const std::string& ccx);

/// Stiffness of the periodic cell by CalculiX: writes NAME.inp into the folder, runs it there, its output in NAME.log, and reads the forces
/// on the cell's sides from NAME.dat. Throws std::runtime_error naming the file that tells more if CalculiX does not finish the load cases.
Homogenization homogenize(const VolumeMesh& mesh, const Constituents& constituents, const HomogenizeOptions& options,
                          const std::filesystem::path& folder, const std::string& name);

}  // namespace relax
