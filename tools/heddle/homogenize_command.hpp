#pragma once
#include "composite_input.hpp"

namespace heddle {

struct HomogenizeCommandOptions : CompositeOptions {
  std::string ccx = "ccx";
  std::string solver = "auto";  ///< "direct", "iterative" or "auto": direct up to `direct_elements_largest`
  bool mesh_error = true;       ///< also on a mesh of 2/3 as many elements along each axis
};

/// Up to so many elements CalculiX' direct solver takes about 10 s for the six load cases; its time grows with the square of their number.
inline constexpr int direct_elements_largest = 3000;

/// Stiffness of a composite unit cell by CalculiX, printed and written with the decks to the output folder (default INPUT/homogenized).
/// Returns the exit status.
int homogenize_command(const HomogenizeCommandOptions& options);

}  // namespace heddle
