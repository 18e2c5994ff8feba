#include "heddle/surface_files.hpp"
#include "scenes/temporary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace heddle {
namespace {

using testing::HasSubstr;
using weave::Vec3;

/// Two tetrahedra, the second with coordinates that no short decimal holds.
struct TwoSurfaces {
  relax::SurfaceMesh a{{Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
  relax::SurfaceMesh b = a;
  TwoSurfaces() {
    for (Vec3& x : b.points) x = (x + Vec3(2, 0, 0)) / 3;
  }
  [[nodiscard]] std::string written(const std::string& ending) const {
    const std::filesystem::path file = scenes::temporary("two_surfaces") += "." + ending;
    const std::vector<NamedSurface> surfaces = {{"warp_0", 0, &a}, {"weft_7", 7, &b}};
    write_surfaces(file, surfaces);
    std::ifstream in(file, std::ios::binary);
    std::ostringstream text;
    text << in.rdbuf();
    std::filesystem::remove(file);
    return text.str();
  }
};

TEST(SurfaceFiles, OffReadsBackToTheLastBit) {
  const TwoSurfaces s;
  std::istringstream in(s.written("off"));
  std::string word;
  std::size_t points = 0, triangles = 0, edges = 0;
  in >> word >> points >> triangles >> edges;
  EXPECT_EQ(word, "OFF");
  ASSERT_EQ(points, 8U);
  ASSERT_EQ(triangles, 8U);
  for (const relax::SurfaceMesh* surface : {&s.a, &s.b})
    for (const Vec3& x : surface->points)
      for (int i = 0; i < 3; ++i) {
        in >> word;
        EXPECT_EQ(std::stod(word), x[i]);
      }
  std::uint32_t first = 0;
  for (const relax::SurfaceMesh* surface : {&s.a, &s.b}) {
    for (const auto& t : surface->triangles) {
      std::uint32_t corners = 0, a = 0, b = 0, c = 0;
      in >> corners >> a >> b >> c;
      EXPECT_EQ(corners, 3U);
      EXPECT_EQ((std::array{a - first, b - first, c - first}), t);
    }
    first += 4;
  }
}

TEST(SurfaceFiles, EachFormatHoldsBothSurfaces) {
  const TwoSurfaces s;
  EXPECT_EQ(s.written("stl").size(), 84U + 8U * 50U);  // header, count, and 50 bytes a triangle
  const std::string obj = s.written("obj");
  EXPECT_THAT(obj, HasSubstr("o warp_0\n"));
  EXPECT_THAT(obj, HasSubstr("o weft_7\n"));
  EXPECT_THAT(obj, HasSubstr("f 6 7 8\n"));  // points count from one, over all surfaces
  const std::string ply = s.written("ply");
  EXPECT_THAT(ply, HasSubstr("element vertex 8\n"));
  EXPECT_THAT(ply, HasSubstr("\n3 5 6 7 7\n"));  // and the yarn
  const std::string vtp = s.written("vtp");
  EXPECT_THAT(vtp, HasSubstr("NumberOfPolys=\"8\""));
  EXPECT_THAT(vtp, HasSubstr("0\n0\n0\n0\n7\n7\n7\n7\n"));
}

TEST(SurfaceFiles, OtherEndingsAreRefused) {
  EXPECT_THROW(write_surfaces(scenes::temporary("surface") += ".xyz", {}), std::runtime_error);
}

}  // namespace
}  // namespace heddle
