#pragma once
#include <string>

namespace heddle {

/// An edge length as given on the command line.
struct EdgeLength {
  double value = 0;
  bool in_diameters = false;  ///< of fibers; else [m]
};

/// A bare number counts fiber diameters, others have a unit of length. Throws std::invalid_argument naming the option and the text.
EdgeLength parse_edge_length(const std::string& text);

}  // namespace heddle
