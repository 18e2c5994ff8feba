#include "heddle/stage_folder.hpp"

namespace heddle {

std::filesystem::path stage_folder(const std::filesystem::path& folder, const char* stage) {
  return !folder.empty() && std::filesystem::exists(folder / stage / "stage.json") ? folder / stage : folder;
}

}  // namespace heddle
