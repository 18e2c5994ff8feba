#pragma once
#include <filesystem>

namespace heddle {

/// The folder of a stage in that of a whole run, if `folder` is one that `heddle run` wrote; else the folder itself.
std::filesystem::path stage_folder(const std::filesystem::path& folder, const char* stage);

/// Throws std::runtime_error where work would begin anew over the checkpoint of what was interrupted.
void expect_no_unfinished(const std::filesystem::path& checkpoint, bool resume);

}  // namespace heddle
