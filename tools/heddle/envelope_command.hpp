#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

/// Of surfaces, and of the sections for TexGen.
inline const std::vector<std::string> envelope_formats = {"stl", "obj", "ply", "off", "vtp", "tg3"};

struct EnvelopeCommandOptions {
  std::filesystem::path input;      ///< results folder with relax.vtkhdf or cell.vtkhdf, or such a file
  std::filesystem::path output;     ///< default INPUT/envelope
  std::string edge_length = "0.4";  ///< in fiber diameters, or with a unit of length
  double ring_distance = 0;         ///< [fiber diameters]; 0: two edge lengths, at most 1
  double ball_radius = 2;           ///< [fiber diameters]
  double gap = 0.05;                ///< [fiber diameters]
  double tolerance = 0;             ///< of the surfaces' distance from the fibers [fiber radii]; 0: as the edge length leaves it
  bool unconverged = false;         ///< also of a relaxed cell that is no certified minimum
  std::vector<std::string> formats = {"off", "vtp", "stl"};
};

/// Makes the surfaces of a unit cell's yarns; writes them one by one and together, their sections as CSV and HDF5, pictures, and
/// summary.json. Returns the exit status: 0 closed and disjoint surfaces, 1 not so. Throws std::runtime_error naming file and certificate
/// for a relaxed cell that is no certified minimum, before any work, unless that is accepted.
int envelope_command(const EnvelopeCommandOptions& options);

}  // namespace heddle
