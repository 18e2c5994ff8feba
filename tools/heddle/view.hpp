#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "weave/section.hpp"
#include "weave/snapshot.hpp"

namespace weave {
struct ResultsFile;
}

namespace heddle {

/// Lines of a yarn in a section, e.g. where it cuts the yarn's surface: pairs of points (2 x lines), u and z as in weave::SectionCircle
/// [m].
struct YarnLines {
  int yarn = 0;
  bool weft = false;
  std::vector<std::array<double, 2>> ends;
};

/// Draws a section normal to x or y at `value` [m] with the fibers' circles and the given lines over them, repeated by the cell's period.
/// Throws std::runtime_error naming the file if it can not be written.
void draw_section_with_lines(const weave::ResultsFile& results, weave::SectionAxis axis, double value, const std::vector<YarnLines>& lines,
                             const std::filesystem::path& file);

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

/// Draws the side view, the view from above, cross-sections and, where the file has a history, its curves. By default sections lie
/// through the middle of the last weft column, between the last two columns, and along the warps of each section. Where the folder has
/// a unit cell, the views and sections are of the cell, and a side view of the whole loom is drawn beside them.
/// Returns the files written. Throws std::runtime_error naming file or option and what is wrong with it.
std::vector<std::filesystem::path> view(const ViewOptions& options);

/// A cell among others in one picture.
struct SectionPanel {
  std::filesystem::path results;  ///< results file of a unit cell
  std::string label;
};

/// Draws the same section of several cells side by side, all at one scale: through the last weft column if normal to x, along the warps of
/// the first section if normal to y. Throws std::runtime_error naming the file that can not be read or written.
void draw_section_panels(const std::vector<SectionPanel>& panels, weave::SectionAxis axis, const std::string& title,
                         const std::filesystem::path& file);

/// One of several states of a cell that are drawn over one another.
struct SectionLayer {
  weave::Snapshot snapshot;  ///< of a unit cell
  std::string label;
};

/// Draws sections of several states of one cell over one another, a color for each state: the outlines of yarns and fibers, in the planes
/// in which view() cuts the first one. Writes overlay_x_1.png, overlay_x_2.png ... (normal to x) and overlay_y_1.png ... into `folder` and
/// returns the files. case_toml: resolved case. Throws std::runtime_error naming the file that can not be written.
std::vector<std::filesystem::path> draw_section_overlays(const std::vector<SectionLayer>& layers, const std::string& case_toml,
                                                         const std::filesystem::path& folder);

}  // namespace heddle
