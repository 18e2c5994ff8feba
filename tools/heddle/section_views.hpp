#pragma once
#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "heddle/view_page.hpp"
#include "weave/section.hpp"

namespace heddle {

struct SectionPlane {
  weave::SectionAxis axis = weave::SectionAxis::x;
  double value = 0;     ///< [m]
  std::string meaning;  ///< what lies there, for the title
};

/// Sections normal to x and y at the given places [m]. None given: through the middle of the last weft column, between the last two
/// columns, and along the warps of each section.
std::vector<SectionPlane> section_planes(const Scene& scene, const std::vector<double>& at_x = {}, const std::vector<double>& at_y = {});

/// Lines of a yarn in a section, e.g. where it cuts the yarn's surface: pairs of points (2 x lines), u and z as in weave::SectionCircle
/// [m].
struct YarnLines {
  int yarn = 0;
  bool weft = false;
  std::vector<std::array<double, 2>> ends;
};

/// Draws a section, with lines in the place of the yarns' outlines where they are given. Throws std::runtime_error naming the file if it
/// can not be written.
void draw_section(const Scene& scene, const SectionPlane& plane, const std::filesystem::path& file,
                  const std::vector<YarnLines>* lines = nullptr);

/// Draws a section, through the last weft column if normal to x, along the warps of the first section if normal to y, with the fibers'
/// circles and lines over them, repeated by the cell's period; `lines` gives them for the plane's place on the axis [m]. Throws
/// std::runtime_error naming the file if it can not be written.
void draw_section_with_lines(const weave::ResultsFile& results, weave::SectionAxis axis,
                             const std::function<std::vector<YarnLines>(double)>& lines, const std::filesystem::path& file);

/// Draws the same section of several cells side by side, all at one scale and where draw_section_with_lines has it. Throws
/// std::runtime_error naming the file that can not be read or written.
void draw_section_panels(const std::vector<CellPanel>& panels, weave::SectionAxis axis, const std::string& title,
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
