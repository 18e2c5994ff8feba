#pragma once
#include <filesystem>

#include "weave/case.hpp"

namespace heddle {

/// Draws a designer's sketch of a case's weave: for each warp section its warps' paths over and under the weft circles, one period from
/// the first column on the left, and the whole fabric's weaving matrix as a grid (filled: warp up). A section whose matrix no warp
/// positions describe has the grid only. `file` ends in .png, .svg or .pdf. Throws std::runtime_error naming file and cause.
void draw_draft(const weave::Case& spec, const std::filesystem::path& file);

}  // namespace heddle
