#include "relax/surface_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

namespace relax {
namespace {

/// Lines that hold more than a comment, with their numbers.
class LineReader {
 public:
  explicit LineReader(const std::filesystem::path& file) : file_(file), stream_(file) {
    if (!stream_) throw std::runtime_error(file.string() + ": cannot be opened");
  }
  std::istringstream next() {
    std::string line;
    while (std::getline(stream_, line)) {
      ++number_;
      line.erase(std::find(line.begin(), line.end(), '#'), line.end());
      if (line.find_first_not_of(" \t\r") != std::string::npos) return std::istringstream(line);
    }
    fail("the file ends too early");
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(file_.string() + ":" + std::to_string(number_) + ": " + what);
  }

 private:
  std::filesystem::path file_;
  std::ifstream stream_;
  std::size_t number_ = 0;
};

void check_closed(const SurfaceMesh& surface, const std::filesystem::path& file) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, reversed;
  for (const auto& t : surface.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      edges.emplace_back(t[i], t[(i + 1) % 3]);
      reversed.emplace_back(t[(i + 1) % 3], t[i]);
    }
  std::sort(edges.begin(), edges.end());
  std::sort(reversed.begin(), reversed.end());
  const auto twice = std::adjacent_find(edges.begin(), edges.end());
  const auto odd = std::mismatch(edges.begin(), edges.end(), reversed.begin());
  if (twice == edges.end() && odd.first == edges.end()) return;
  const auto edge = twice != edges.end() ? *twice : *odd.first;
  throw std::runtime_error(file.string() + ": the surface is not closed and oriented: the edge between points " +
                           std::to_string(edge.first) + " and " + std::to_string(edge.second) + " has not one triangle on each side");
}

}  // namespace

SurfaceMesh read_closed_off(const std::filesystem::path& file) {
  LineReader lines(file);
  std::string word;
  if (!(lines.next() >> word) || word != "OFF") lines.fail("an OFF file begins with \"OFF\"");
  std::int64_t points = 0, facets = 0;
  if (!(lines.next() >> points >> facets) || points < 4 || facets < 4)
    lines.fail("the numbers of points and facets of a closed surface, at least 4 each, are expected");

  SurfaceMesh surface;
  for (std::int64_t i = 0; i < points; ++i) {
    Vec3 x;
    if (!(lines.next() >> x[0] >> x[1] >> x[2]) || !x.allFinite()) lines.fail("three finite coordinates are expected");
    surface.points.push_back(x);
  }
  for (std::int64_t i = 0; i < facets; ++i) {
    std::int64_t corners = 0, a = 0, b = 0, c = 0;
    std::istringstream line = lines.next();
    if (!(line >> corners >> a >> b >> c) || corners != 3) lines.fail("a triangle, \"3 a b c\", is expected");
    for (const std::int64_t p : {a, b, c})
      if (p < 0 || p >= points) lines.fail("point " + std::to_string(p) + " is not one of 0..." + std::to_string(points - 1));
    surface.triangles.push_back({static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(c)});
  }
  check_closed(surface, file);
  if (!(enclosed_volume(surface) > 0)) throw std::runtime_error(file.string() + ": the triangles face inward, or bound no volume");
  return surface;
}

double enclosed_volume(const SurfaceMesh& surface) {
  // Points from one of the surface's own, as those of a small surface far from the origin would lose digits.
  const Vec3 origin = surface.points.empty() ? Vec3::Zero() : surface.points.front();
  double six_volumes = 0;
  for (const auto& t : surface.triangles) {
    const Vec3 a = surface.points[t[0]] - origin, b = surface.points[t[1]] - origin, c = surface.points[t[2]] - origin;
    six_volumes += a.dot(b.cross(c));
  }
  return six_volumes / 6;
}

}  // namespace relax
