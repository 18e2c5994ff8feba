#include "heddle/surface_files.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <cstring>
#include <iterator>
#include <stdexcept>

#include "weave/results.hpp"

namespace heddle {
namespace {

using relax::SurfaceMesh;
using weave::Vec3;

struct Counts {
  std::size_t points = 0, triangles = 0;
};

Counts count(std::span<const NamedSurface> surfaces) {
  Counts all;
  for (const NamedSurface& s : surfaces) {
    all.points += s.surface->points.size();
    all.triangles += s.surface->triangles.size();
  }
  return all;
}

/// One line for each point; a double's shortest text that reads back as itself.
void add_points(std::string& text, std::span<const NamedSurface> surfaces, const char* line) {
  for (const NamedSurface& s : surfaces)
    for (const Vec3& x : s.surface->points) fmt::format_to(std::back_inserter(text), fmt::runtime(line), x.x(), x.y(), x.z());
}

/// One line for each triangle: its points, counted from `first` over all surfaces, and its yarn.
void add_triangles(std::string& text, std::span<const NamedSurface> surfaces, const char* line) {
  std::size_t first = 0;
  for (const NamedSurface& s : surfaces) {
    for (const auto& t : s.surface->triangles)
      fmt::format_to(std::back_inserter(text), fmt::runtime(line), first + t[0], first + t[1], first + t[2], s.yarn);
    first += s.surface->points.size();
  }
}

std::string stl(std::span<const NamedSurface> surfaces) {
  const auto bytes = [](auto value) {
    std::array<char, sizeof value> raw;
    std::memcpy(raw.data(), &value, sizeof value);
    return std::string(raw.data(), raw.size());
  };
  std::string text(80, ' ');
  const std::string title = "yarns by Heddle, in meters";
  text.replace(0, title.size(), title);
  text += bytes(static_cast<std::uint32_t>(count(surfaces).triangles));
  for (const NamedSurface& s : surfaces) {
    for (const auto& t : s.surface->triangles) {
      const Vec3 &a = s.surface->points[t[0]], &b = s.surface->points[t[1]], &c = s.surface->points[t[2]];
      const Vec3 normal = (b - a).cross(c - a).normalized();
      for (const Vec3& x : {normal, a, b, c})
        for (int i = 0; i < 3; ++i) text += bytes(static_cast<float>(x[i]));
      text += bytes(std::uint16_t{0});
    }
  }
  return text;
}

std::string obj(std::span<const NamedSurface> surfaces) {
  std::string text = "# yarns by Heddle, in meters\n";
  std::size_t first = 1;
  for (const NamedSurface& s : surfaces) {
    fmt::format_to(std::back_inserter(text), "o {}\n", s.name);
    for (const Vec3& x : s.surface->points) fmt::format_to(std::back_inserter(text), "v {} {} {}\n", x.x(), x.y(), x.z());
    for (const auto& t : s.surface->triangles)
      fmt::format_to(std::back_inserter(text), "f {} {} {}\n", first + t[0], first + t[1], first + t[2]);
    first += s.surface->points.size();
  }
  return text;
}

std::string ply(std::span<const NamedSurface> surfaces) {
  const Counts all = count(surfaces);
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment yarns by Heddle, in meters\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\n"
      "element face {}\nproperty list uchar int vertex_indices\nproperty int yarn\nend_header\n",
      all.points, all.triangles);
  add_points(text, surfaces, "{} {} {}\n");
  add_triangles(text, surfaces, "3 {} {} {} {}\n");
  return text;
}

std::string off(std::span<const NamedSurface> surfaces) {
  const Counts all = count(surfaces);
  std::string text = fmt::format("OFF\n{} {} 0\n", all.points, all.triangles);
  add_points(text, surfaces, "{} {} {}\n");
  add_triangles(text, surfaces, "3 {} {} {}\n");
  return text;
}

std::string vtp(std::span<const NamedSurface> surfaces) {
  const Counts all = count(surfaces);
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n"
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n"
      "<Points>\n<DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">\n",
      all.points, all.triangles);
  add_points(text, surfaces, "{} {} {}\n");
  text += "</DataArray>\n</Points>\n<Polys>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n";
  add_triangles(text, surfaces, "{} {} {}\n");
  text += "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n";
  for (std::size_t i = 1; i <= all.triangles; ++i) fmt::format_to(std::back_inserter(text), "{}\n", 3 * i);
  text += "</DataArray>\n</Polys>\n<CellData Scalars=\"yarn\">\n<DataArray type=\"Int32\" Name=\"yarn\" format=\"ascii\">\n";
  add_triangles(text, surfaces, "{3}\n");
  text += "</DataArray>\n</CellData>\n</Piece>\n</PolyData>\n</VTKFile>\n";
  return text;
}

}  // namespace

void write_surfaces(const std::filesystem::path& file, std::span<const NamedSurface> surfaces) {
  const std::string ending = file.extension().string();
  std::string text;
  if (ending == ".stl") {
    text = stl(surfaces);
  } else if (ending == ".obj") {
    text = obj(surfaces);
  } else if (ending == ".ply") {
    text = ply(surfaces);
  } else if (ending == ".off") {
    text = off(surfaces);
  } else if (ending == ".vtp") {
    text = vtp(surfaces);
  } else {
    throw std::runtime_error(file.string() + ": the ending of a surface's file must be .stl, .obj, .ply, .off or .vtp");
  }
  weave::write_text_file(file, text);
}

}  // namespace heddle
