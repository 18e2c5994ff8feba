#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

struct ViewOptions {
  /// A results file, or a results folder with weave.vtkhdf (loom or final cloth, and history) and perhaps cell.vtkhdf (last unit cell), or
  /// with relax.vtkhdf (relaxed cell).
  std::filesystem::path results;
  std::filesystem::path output;         ///< folder of the pictures, made if it is missing
  std::string format = "png";           ///< "png", "svg" or "pdf"
  std::string color = "yarn";           ///< "yarn" or "stress"
  std::vector<double> sections_x = {};  ///< positions of the sections normal to x [m]; none given in both lists: default positions
  std::vector<double> sections_y = {};  ///< and normal to y [m]
  int width_px = 1600;                  ///< of every picture [px]
};

/// Draws the side view, the view from above, cross-sections and, where the file has a history, its curves; of a relaxed cell how it
/// converged. By default sections lie through the middle of the last weft column, between the last two columns, and along the warps of each
/// section. Where the folder has a unit cell, the views and sections are of the cell, and a side view of the whole loom is drawn beside
/// them. Returns the files written. Throws std::runtime_error naming file or option and what is wrong with it.
std::vector<std::filesystem::path> view(const ViewOptions& options);

}  // namespace heddle
