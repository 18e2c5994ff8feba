#pragma once
#include "heddle/composite_input.hpp"

namespace heddle {

/// Meshes a composite unit cell with voxels or tetrahedra and writes mesh.vtu, mesh.msh, abaqus.inp, calculix.inp and summary.json into the
/// output folder (default INPUT/mesh). Returns the exit status.
int mesh_command(const CompositeOptions& options);

}  // namespace heddle
