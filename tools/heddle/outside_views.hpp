#pragma once
#include <filesystem>
#include <string>

#include "heddle/view_page.hpp"

namespace heddle {

/// All fibers as seen along y. Throws std::runtime_error naming the file if it can not be written.
void draw_side_view(const Scene& scene, const std::filesystem::path& file, const std::string& title);

/// As seen from above: two periods along y, and two along x of a unit cell; what is repeated is drawn lighter. Throws as draw_side_view.
void draw_top_view(const Scene& scene, const std::filesystem::path& file);

}  // namespace heddle
