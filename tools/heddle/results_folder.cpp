#include "heddle/results_folder.hpp"

#include <stdexcept>

namespace heddle {

std::filesystem::path stage_folder(const std::filesystem::path& folder, const char* stage) {
  return !folder.empty() && std::filesystem::exists(folder / stage / "stage.json") ? folder / stage : folder;
}

void expect_no_unfinished(const std::filesystem::path& checkpoint, bool resume) {
  if (!resume && std::filesystem::exists(checkpoint))
    throw std::runtime_error(checkpoint.string() + ": is of work that was interrupted; go on with --resume, or remove it to begin anew");
}

}  // namespace heddle
