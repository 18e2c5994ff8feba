#pragma once
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace heddle {

/// Content of a JSON file; null where there is none or it is not whole.
nlohmann::ordered_json read_json(const std::filesystem::path& file);

}  // namespace heddle
