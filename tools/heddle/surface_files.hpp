#pragma once
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "relax/envelope.hpp"

namespace heddle {

/// A surface with the number that its triangles bear in formats that can hold one.
struct NamedSurface {
  std::string name;
  int yarn = 0;
  const relax::SurfaceMesh* surface = nullptr;
};

/// The endings that write_surfaces knows, without a dot.
inline const std::vector<std::string> surface_formats = {"stl", "obj", "ply", "off", "vtp"};

/// Writes surfaces into one file, in meters, by its ending: .stl (binary, single precision), .obj (an object for each surface), .ply and
/// .vtp (with the yarn of each triangle), .off. All but STL hold the coordinates to the last bit. Aside first, then renamed. Throws
/// std::runtime_error naming the file if that fails or the ending is none of these.
void write_surfaces(const std::filesystem::path& file, std::span<const NamedSurface> surfaces);

}  // namespace heddle
