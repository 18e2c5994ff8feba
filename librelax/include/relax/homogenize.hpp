#pragma once
#include <filesystem>
#include <string>

#include "relax/deck.hpp"

namespace relax {

struct HomogenizeOptions {
  std::string ccx = "ccx";  ///< CalculiX: a program on the PATH, or its path
  bool periodic_z = true;   ///< else the sides normal to z are free
  int bins = 10;            ///< of local volume fraction
  std::string title = {};
};

struct Homogenization {
  /// Mean stress per macroscopic strain, Voigt's order, symmetrized [Pa]. With free sides normal to z only the rows and columns of xx, yy
  /// and xy are set: those of a layer in plane stress on the mean, which can not bend.
  Matrix6 stiffness = Matrix6::Zero();
  double asymmetry = 0;    ///< of the compliance as CalculiX gives it: largest |S_ij - S_ji| / 2 over the largest entry, the solver's error
  double bin_width = 0;    ///< of local volume fraction
  std::size_t capped = 0;  ///< elements, as in MaterialBins
  StiffnessBounds bounds;
  Matrix6 laminate = Matrix6::Zero();  ///< laminate_stiffness of the mesh [Pa]
  double solve_wall = 0;               ///< [s]
};

/// Path of the program if it can be run; throws std::runtime_error saying how to get CalculiX if not.
std::filesystem::path find_ccx(const std::string& ccx);

/// Stiffness of the periodic cell by CalculiX: the inverse of the compliance that its answers to unit macroscopic stresses make, with the
/// matrix factorized once by its direct solver. (Its iterative one stops at a residual of 1e-4, at which stiffnesses were off by a
/// percent.) Writes NAME.inp into the folder, runs CalculiX there, its output in NAME.log, and reads NAME.dat. Threads: as CalculiX takes
/// them from OMP_NUM_THREADS. Throws std::runtime_error naming the file that tells more if CalculiX does not finish.
Homogenization homogenize(const VolumeMesh& mesh, const Constituents& constituents, const HomogenizeOptions& options,
                          const std::filesystem::path& folder, const std::string& name);

}  // namespace relax
