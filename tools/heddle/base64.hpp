#pragma once
#include <string>

namespace heddle {

/// Bytes in base 64 (RFC 4648), as a page holds its pictures.
std::string base64(const std::string& bytes);

}  // namespace heddle
