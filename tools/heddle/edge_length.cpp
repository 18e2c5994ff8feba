#include "heddle/edge_length.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "weave/units.hpp"

namespace heddle {

EdgeLength parse_edge_length(const std::string& text) {
  const bool bare = text.find_first_not_of("0123456789.eE+-") == std::string::npos;
  try {
    return {weave::parse_quantity(text, bare ? weave::Dimension::number : weave::Dimension::length), bare};
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("--edge-length {}: {}", text, e.what()));
  }
}

}  // namespace heddle
