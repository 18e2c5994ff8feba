#pragma once
#include <string>
#include <vector>

#include "relax/composite.hpp"
#include "relax/periodic_sets.hpp"

namespace relax {

enum class DeckProgram { abaqus, calculix };
enum class DeckLoads {
  unit_strains,  ///< a step for each macroscopic strain
  green,  ///< for CalculiX: one step *GREEN of a unit force on each component of the reference nodes, for which the matrix is factorized
          ///< but once
};

struct DeckOptions {
  DeckProgram program = DeckProgram::calculix;
  DeckLoads loads = DeckLoads::unit_strains;
  bool periodic_z = true;  ///< else the sides normal to z are free of stress
  std::string title = {};
};

/// Strain components that are load cases, by their place in Voigt's order: all six, or with free sides normal to z xx, yy and xy.
std::vector<int> load_cases(bool periodic_z);

/// An input deck in mm, N and MPa for the six (three) macroscopic load cases of the cell.
///
/// Node and element sets of the matrix (MATRIX, NODES_MATRIX), of each yarn (YARN_n, NODES_YARN_n, n as in weave::Snapshot) and of all
/// yarns (YARNS); element sets FRACTION_k of the bins of volume fraction with their materials, axes of each yarn element by a distribution
/// (axis 1 along the fibers); the disjoint boundary sets of PeriodicSets; HIGH_X, HIGH_Y, HIGH_Z of all points of a high side.
///
/// Two reference nodes carry the macroscopic strain: STRAIN_NORMAL with the displacements (xx, yy, zz), STRAIN_SHEAR with (yz, xz, xy),
/// engineering shears. Equations tie each point of a high side to its image: u+ - u- = H (x+ - x-), with the upper triangular displacement
/// gradient H = [xx xy xz; 0 yy yz; 0 0 zz]. The lower corner of the cell is held. Mean stress, by virtual work: the force on a component
/// of the reference nodes over the cell's volume. CalculiX, unlike Abaqus, gives no reactions at nodes without elements; there it is the
/// sum of the nodal forces RF on the high side normal to j over that side's area.
std::string deck(const VolumeMesh& mesh, const PeriodicSets& sets, const Constituents& constituents, const MaterialBins& bins,
                 const DeckOptions& options);

}  // namespace relax
