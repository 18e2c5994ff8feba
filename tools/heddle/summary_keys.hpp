#pragma once
#include <string>

namespace heddle {

/// What is wrong with a figure "STAGE.KEY" by the summary.json that the stage writes; empty: nothing. Deeper keys, and entries of lists by
/// number or "last", follow after more dots. A key that is not there is told with those nearest to it. How many entries a list has only a
/// run tells.
std::string figure_mistake(const std::string& figure);

}  // namespace heddle
