#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "heddle/view_page.hpp"

namespace heddle {

/// All fibers as seen along y. Throws std::runtime_error naming the file if it can not be written.
void draw_side_view(const Scene& scene, const std::filesystem::path& file, const std::string& title);

/// As seen from above: two periods along y, and two along x of a unit cell; what is repeated is drawn lighter. Throws as draw_side_view.
void draw_top_view(const Scene& scene, const std::filesystem::path& file);

/// Draws several cells side by side as seen from above, a period of each, all at one scale, with the middle lines of the wefts over what
/// lies on them where all yarns pass the cell whole. Throws std::runtime_error naming the file that can not be read or written.
void draw_top_panels(const std::vector<CellPanel>& panels, const std::string& title, const std::filesystem::path& file);

}  // namespace heddle
