#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "relax/composite.hpp"
#include "relax/envelope.hpp"
#include "relax/volume_mesh.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"

namespace heddle {

/// What the commands that mesh a composite unit cell have in common.
struct CompositeOptions {
  std::filesystem::path input;   ///< folder that `heddle envelope` wrote: fibers.vtkhdf, and an OFF file for each yarn
  std::filesystem::path output;  ///< folder of the results
  std::vector<int> voxels;       ///< along x, y, z; empty: by voxel_size or elements
  double voxel_size = 0;         ///< [m]; 0: by elements
  int elements = 12000;          ///< about so many
  bool tetrahedra = false;       ///< that conform to the yarns' surfaces, in place of voxels
  std::string edge_length;       ///< of the tetrahedra, in fiber diameters, or with a unit; empty: as relax::TetOptions
  bool quadratic = false;        ///< tetrahedra with nodes at the middles of their edges
  double resin_margin = 0;       ///< [m]
  double kernel_radius = 2;      ///< of the estimate of local volume fractions [fiber diameters]
  std::string fiber;             ///< one of weave::known_fibers(); empty: as the case says, else "e_glass"
  double fiber_e1 = 0, fiber_e2 = 0, fiber_g12 = 0, fiber_nu12 = -1, fiber_nu23 = -1;  ///< 0 or -1: as `fiber` has it [Pa]
  double matrix_e = 0;                                                                 ///< [Pa]; 0: as the case says, else 3.45e9
  double matrix_nu = -1;                                                               ///< -1: as the case says, else 0.35
  std::string rule = "chamis";                                                         ///< "chamis" or "mori_tanaka"
  int bins = 10;                                                                       ///< of local volume fraction
  bool free_z = false;                                                                 ///< sides normal to z free, not periodic
};

/// Envelopes with the cell that they were made of.
struct CompositeInput {
  std::vector<relax::YarnEnvelope> envelopes;
  weave::ResultsFile source;
  weave::Case source_case;  ///< empty where the results hold none
  std::string case_name;
};

/// Reads a folder of envelopes. Throws std::runtime_error naming the file and what is wrong: no fibers.vtkhdf, no surface of a yarn, or one
/// that is not closed.
CompositeInput read_composite_input(const std::filesystem::path& folder);

relax::VoxelOptions voxel_options(const CompositeOptions& options);

/// A mesh, and of tetrahedra their shape.
struct MeshedCell {
  relax::CompositeMesh composite;
  std::optional<relax::TetQuality> tetrahedra;
};
MeshedCell mesh_cell(const CompositeInput& input, const CompositeOptions& options);

/// Materials by the options, or, where these are silent, by the case. Throws std::invalid_argument for a fiber or rule that is not known,
/// constants that are not those of a material, or a case whose yarns are of several materials.
relax::Constituents constituents_of(const CompositeOptions& options, const weave::Case& source_case);

/// Entries of a summary that say what was meshed and of what materials, as JSON text of an object.
std::string composite_summary(const CompositeInput& input, const MeshedCell& meshed, const relax::Constituents& constituents,
                              const CompositeOptions& options);

/// The same for the reader at the terminal.
void print_composite(const CompositeInput& input, const MeshedCell& meshed, const relax::Constituents& constituents);

}  // namespace heddle
