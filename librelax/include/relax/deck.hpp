#pragma once
#include <string>
#include <vector>

#include "relax/composite.hpp"
#include "relax/periodic_sets.hpp"

namespace relax {

enum class DeckProgram { abaqus, calculix };
enum class LinearSolver {
  direct,     ///< the program's direct solver
  iterative,  ///< CalculiX: conjugate gradients with incomplete Cholesky, to a residual of 1e-4; Abaqus: the direct solver all the same
};

struct DeckOptions {
  DeckProgram program = DeckProgram::calculix;
  LinearSolver solver = LinearSolver::direct;
  bool periodic_z = true;  ///< else the sides normal to z are free of stress
  std::string title = {};
};

/// Strain components that are load cases, by their place in Voigt's order: all six, or with free sides normal to z xx, yy and xy.
std::vector<int> load_cases(bool periodic_z);

/// An input deck in mm, N and MPa for the six (three) unit macroscopic strains of the cell, one step each.
///
/// Node and element sets of the matrix (MATRIX, NODES_MATRIX), of each yarn (YARN_n, NODES_YARN_n, n as in weave::Snapshot) and of all
/// yarns (YARNS); element sets FRACTION_k of the bins of volume fraction with their materials, axes of each yarn element by a distribution
/// (axis 1 along the fibers); the disjoint boundary sets of PeriodicSets; HIGH_X, HIGH_Y, HIGH_Z of all points of a high side.
///
/// Two reference nodes carry the macroscopic strain: STRAIN_NORMAL with the displacements (xx, yy, zz), STRAIN_SHEAR with (yz, xz, xy),
/// engineering shears. Equations tie each point of a high side to its image: u+ - u- = H (x+ - x-), with the upper triangular displacement
/// gradient H = [xx xy xz; 0 yy yz; 0 0 zz]. The lower corner of the cell is held. Mean stress: the sum of the nodal forces on the high
/// side normal to j, times the period along j, over the cell's volume (virtual work; sides that are not tied give the traction on them).
std::string deck(const VolumeMesh& mesh, const PeriodicSets& sets, const Constituents& constituents, const MaterialBins& bins,
                 const DeckOptions& options);

}  // namespace relax
