#include "heddle/json_file.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

namespace heddle {

nlohmann::ordered_json read_json(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) return {};
  nlohmann::ordered_json content = nlohmann::ordered_json::parse(in, nullptr, false);
  return content.is_discarded() ? nlohmann::ordered_json() : content;
}

}  // namespace heddle
