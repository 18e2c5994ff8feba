#include "heddle/edge_length.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "weave/units.hpp"

namespace heddle {

EdgeLength parse_edge_length(const std::string& text) {
  const bool bare = text.find_first_not_of("0123456789.eE+-") == std::string::npos;
  try {
    const EdgeLength length{weave::parse_quantity(text, bare ? weave::Dimension::number : weave::Dimension::length), bare};
    if (!(length.value > 0)) throw std::invalid_argument("must be > 0");
    return length;
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("--edge-length {}: {}", text, e.what()));
  }
}

}  // namespace heddle
