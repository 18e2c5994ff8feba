#pragma once
#include <filesystem>
#include <vector>

#include "relax/envelope.hpp"

namespace heddle {

/// Draws width, height, area, fiber volume fraction and rotation of the sections of all warps or of all wefts along the yarns. Throws
/// std::runtime_error naming the file if it can not be written.
void draw_section_data(const std::vector<relax::YarnEnvelope>& yarns, bool weft, const std::filesystem::path& file);

}  // namespace heddle
