#pragma once
#include "heddle/composite_input.hpp"

namespace heddle {

struct HomogenizeCommandOptions : CompositeOptions {
  std::string ccx = "ccx";
  bool mesh_error = true;  ///< also on voxels half as large again, or on tetrahedra of four nodes
};

/// Stiffness of a composite unit cell by CalculiX, printed and written with the decks to the output folder (default INPUT/homogenized).
/// Returns the exit status.
int homogenize_command(const HomogenizeCommandOptions& options);

}  // namespace heddle
