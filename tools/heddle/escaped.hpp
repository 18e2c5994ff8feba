#pragma once
#include <string>

namespace heddle {

/// Text as HTML and XML hold it between tags and in attributes.
std::string escaped(const std::string& text);

}  // namespace heddle
