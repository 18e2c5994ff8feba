#pragma once
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "heddle/report_page.hpp"

namespace heddle {

/// The engineering constants of a composite beside Reuss' and Voigt's bounds and the laminate, those that `summary` of heddle homogenize
/// has.
PageTable stiffness_table(const nlohmann::ordered_json& summary);

/// Width, height, area, fiber volume fraction and rotation of each yarn's sections, mean and extremes, from the summary of heddle envelope.
PageTable section_table(const nlohmann::ordered_json& summary);

/// Energy by parts, certificate and measures of each state, and by how much each two of them differ, from the summary of heddle compare.
std::vector<PageTable> minima_tables(const nlohmann::ordered_json& summary);

/// Wall time of each stage and of all, from the summary of heddle run.
PageTable wall_table(const nlohmann::ordered_json& summary);

}  // namespace heddle
