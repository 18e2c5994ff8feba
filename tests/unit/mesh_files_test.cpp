#include "relax/mesh_files.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <set>

#include "relax/deck.hpp"
#include "relax/surface_file.hpp"
#include "scenes/temporary.hpp"
#include "scenes/yarn_surfaces.hpp"
#include "weave/results.hpp"

namespace relax {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

VolumeMesh small_mesh() {
  VolumeMesh m = scenes::yarn_block({3, 2, 4}, {0.3e-3, 0.7e-3, 0.1e-3}, {1, 1, 0}, 0.6);
  m.yarns = {5};
  for (std::size_t i = 0; i < m.elements(); i += 2) m.yarn[i] = -1;
  return m;
}

TEST(PeriodicSets, PairOffExactly) {
  const VolumeMesh m = small_mesh();
  const PeriodicSets sets = periodic_sets(m, true);
  const Vec3 size = m.high - m.low;
  std::set<std::uint32_t> seen;
  std::size_t members = 0;
  std::map<std::string, std::vector<std::uint32_t>> by_name;
  for (const PointSet& s : sets.sets) {
    by_name[s.name] = s.points;
    members += s.points.size();
    seen.insert(s.points.begin(), s.points.end());
  }
  EXPECT_EQ(by_name.size(), 26U);
  EXPECT_EQ(members, 4U * 3U * 5U - 2U * 1U * 3U);  // all but the points within
  EXPECT_EQ(seen.size(), members);                  // disjoint
  EXPECT_EQ(by_name["CORNER_X0Y0Z0"], std::vector<std::uint32_t>{sets.corner});
  for (const auto& [low, high, axis] :
       {std::tuple{"FACE_X0", "FACE_X1", 0}, std::tuple{"FACE_Y0", "FACE_Y1", 1}, std::tuple{"FACE_Z0", "FACE_Z1", 2},
        std::tuple{"EDGE_X0Y0", "EDGE_X1Y0", 0}, std::tuple{"EDGE_Y0Z1", "EDGE_Y1Z1", 1}}) {
    ASSERT_EQ(by_name[low].size(), by_name[high].size());
    EXPECT_FALSE(by_name[low].empty());
    for (std::size_t i = 0; i < by_name[low].size(); ++i) {
      Vec3 image = m.points[by_name[high][i]];
      image[axis] -= size[axis];
      EXPECT_EQ(image, m.points[by_name[low][i]]);
    }
  }
  // Each point on a high side hangs on one that lies on none.
  EXPECT_EQ(sets.pairs.size(), 4U * 3U * 5U - 3U * 2U * 4U);
  for (const PeriodicPair& pair : sets.pairs) {
    Vec3 image = m.points[pair.point];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(pair.across[static_cast<std::size_t>(axis)], image[axis] == m.high[axis]);
      if (pair.across[static_cast<std::size_t>(axis)]) image[axis] = m.low[axis];
    }
    EXPECT_EQ(m.points[pair.image], image);
  }
  for (const PeriodicPair& pair : periodic_sets(m, false).pairs) EXPECT_FALSE(pair.across[2]);
}

TEST(PeriodicSets, AMissingImageIsNamed) {
  VolumeMesh m = small_mesh();
  m.points[periodic_sets(m, true).sets.front().points.front()].x() += 1e-6;
  EXPECT_THAT([&] { periodic_sets(m, true); }, ThrowsMessage<std::invalid_argument>(HasSubstr("no point at (")));
}

TEST(Deck, ProgramsHaveTheirOwnCards) {
  const VolumeMesh m = small_mesh();
  const Constituents c{"fiber", "epoxy", isotropic(80e9, 0.2), 3.5e9, 0.35, Micromechanics::chamis};
  const MaterialBins bins = bin_materials(m, c, 3);
  const std::string calculix = deck(m, periodic_sets(m, true), c, bins, {});
  EXPECT_THAT(calculix, AllOf(HasSubstr("*ELSET, ELSET=MATRIX\n"), HasSubstr("*ELSET, ELSET=YARN_5\n"),
                              HasSubstr("*NSET, NSET=NODES_YARN_5\n"), HasSubstr("*NSET, NSET=CORNER_X1Y1Z1\n60\n"),
                              HasSubstr("*STEP\n*STATIC\n*BOUNDARY\n"), Not(HasSubstr("DISTRIBUTION TABLE"))));
  const std::string abaqus = deck(m, periodic_sets(m, false), c, bins, {.program = DeckProgram::abaqus, .periodic_z = false});
  EXPECT_THAT(abaqus, AllOf(HasSubstr("*DISTRIBUTION TABLE, NAME=AXES_TABLE\n"), HasSubstr("*STEP, NAME=STRAIN_xy, PERTURBATION\n"),
                            Not(HasSubstr("STRAIN_zz")), Not(HasSubstr("*EL FILE"))));
  const std::string green = deck(m, periodic_sets(m, false), c, bins, {.loads = DeckLoads::green, .periodic_z = false});
  EXPECT_THAT(green, AllOf(HasSubstr("*GREEN\n*CLOAD\n61, 1, 1.\n61, 2, 1.\n62, 3, 1.\n*NODE PRINT"), Not(HasSubstr("*STATIC"))));
  const auto longest_line = [](const std::string& text) {
    std::size_t longest = 0;
    for (std::size_t at = 0, end = 0; (end = text.find('\n', at)) != std::string::npos; at = end + 1) longest = std::max(longest, end - at);
    return longest;
  };
  EXPECT_LE(longest_line(calculix), 132U);  // what CalculiX reads of a line
  EXPECT_LE(longest_line(abaqus), 256U);    // and Abaqus
}

class SurfaceFile : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    file_ = scenes::temporary(::testing::UnitTest::GetInstance()->current_test_info()->name()) += ".off";
    weave::write_text_file(file_, text);
    return file_;
  }
  void TearDown() override { std::filesystem::remove(file_); }
  void expect_error(const std::string& text, const std::string& part) {
    EXPECT_THAT([&] { read_closed_off(write(text)); },
                ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(file_.string()), HasSubstr(part))));
  }
  std::filesystem::path file_;
};

const std::string points = "OFF # tetrahedron\n4 4 6\n0 0 0\n1 0 0\n\n0 1 0\n0 0 1\n";

TEST_F(SurfaceFile, ATetrahedron) {
  const SurfaceMesh s = read_closed_off(write(points + "3 0 2 1\n3 0 1 3\n3 1 2 3 # slanted\n3 0 3 2 255 0 0\n"));
  EXPECT_EQ(s.points.size(), 4U);
  EXPECT_EQ(s.triangles.size(), 4U);
  EXPECT_DOUBLE_EQ(enclosed_volume(s), 1.0 / 6);
}

TEST_F(SurfaceFile, BadFilesAreNamed) {
  write("");
  expect_error("", ":0: the file ends too early");
  expect_error("PLY\n", ":1: an OFF file begins with");
  expect_error("OFF\n4 x\n", ":2: the numbers");
  expect_error("OFF\n4 4 0\n0 0 nan\n", ":3: three finite");
  expect_error(points + "3 0 2 1\n4 0 1 3 2\n", ":9: a triangle");
  expect_error(points + "3 0 2 4\n", ":8: point 4 is not one of 0...3");
  expect_error(points + "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 2 3\n", "not closed and oriented: the edge between points");
  expect_error(points + "3 0 1 2\n3 0 3 1\n3 1 3 2\n3 0 2 3\n", "face inward");
  EXPECT_THAT([] { read_closed_off("/no/such.off"); }, ThrowsMessage<std::runtime_error>(HasSubstr("/no/such.off: cannot be opened")));
}

}  // namespace
}  // namespace relax
