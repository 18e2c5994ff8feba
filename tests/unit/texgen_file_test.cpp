#include "heddle/texgen_file.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <regex>

#include "relax/report.hpp"
#include "scenes/cells.hpp"

namespace {

using ::testing::HasSubstr;
using weave::Vec3;

/// Numbers in the values of an attribute of all elements of a name, in order.
std::vector<std::vector<double>> values(const std::string& text, const std::string& element, const std::string& attribute) {
  std::vector<std::vector<double>> found;
  const std::regex pattern("<" + element + " [^>]*\\b" + attribute + "=\"([^\"]*)\"");
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) {
    std::istringstream in((*it)[1].str());
    found.emplace_back();
    for (double value = 0; in >> value; in.ignore()) found.back().push_back(value);  // as TexGen reads them: a comma is passed over
  }
  return found;
}

std::vector<std::string> elements(const std::string& text, const std::string& element) {
  std::vector<std::string> found;
  for (std::size_t at = text.find("<" + element + " "); at != std::string::npos; at = text.find("<" + element + " ", at + 1))
    found.push_back(text.substr(at, text.find("</" + element + ">", at) - at));
  return found;
}

struct TexGen : testing::Test {
  scenes::PosedCell start = scenes::plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.2, 1);
  relax::Envelopes envelopes = relax::make_envelopes(relax::snapshot_of(start.cell, start.unknowns()), {});
  std::string text = heddle::texgen_text(envelopes, "a \"plain\" <weave>");
};

TEST_F(TexGen, SectionsLieOnTheirPlanesWithTheirAreas) {
  const std::vector<std::string> yarns = elements(text, "Yarn");
  ASSERT_EQ(yarns.size(), envelopes.yarns.size());
  for (std::size_t y = 0; y < yarns.size(); ++y) {
    const relax::YarnEnvelope& e = envelopes.yarns[y];
    const auto position = values(yarns[y], "MasterNode", "Position"), tangent = values(yarns[y], "MasterNode", "Tangent"),
               up = values(yarns[y], "MasterNode", "Up");
    const std::vector<std::string> sections = elements(yarns[y], "NodeSection");
    ASSERT_EQ(sections.size(), e.rings);
    ASSERT_EQ(position.size(), e.rings);
    for (std::size_t k = 0; k < e.rings; ++k) {
      const Vec3 t(tangent[k].data()), u(up[k].data()), node(position[k].data()), side = t.cross(u);
      EXPECT_NEAR(t.dot(u), 0, 1e-12);
      const auto points = values(sections[k], "PolygonPoint", "value");
      ASSERT_EQ(points.size(), e.ring_points);  // TexGen closes a polygon from its last point to its first
      double area = 0;
      for (std::size_t j = 0; j < points.size(); ++j) {
        const auto &a = points[j], &b = points[(j + 1) % points.size()];
        area += 0.5 * (a[0] * b[1] - a[1] * b[0]);
        // Where TexGen puts it is where a point of the ring lies, seen along the tangent, to round-off of coordinates of 1e-3 m.
        const Vec3 x = 1e-3 * (node + a[0] * side + a[1] * u);
        double nearest = 1, off_plane = 1;
        for (std::uint32_t i = 0; i < e.ring_points; ++i) {
          const Vec3 away = e.surface.points[k * e.ring_points + i] - x;
          if (away.cross(t).norm() > nearest) continue;
          nearest = away.cross(t).norm();
          off_plane = std::abs(away.dot(t));
        }
        EXPECT_LT(nearest, 1e-12);
        EXPECT_LT(off_plane, 0.05 * 1e-4);  // a point is moved apart by less than a twentieth of a fiber here
      }
      EXPECT_NEAR(1e-6 * area, e.sections[k].area, 1e-9 * e.sections[k].area);  // positive: counterclockwise
    }
    // The last node is the first, one repeat on.
    const Vec3 period = Vec3(position.back().data()) - Vec3(position.front().data());
    EXPECT_LT((1e-3 * period - e.period).norm(), 1e-12);
    const auto repeats = values(yarns[y], "Repeat", "value");
    ASSERT_EQ(repeats.size(), 2U);
    EXPECT_LT((1e-3 * Vec3(repeats[e.weft ? 1 : 0].data()) - e.period).norm(), 1e-12);
  }
}

TEST_F(TexGen, DomainIsTheCell) {
  const auto d = values(text, "Plane", "d");
  ASSERT_EQ(d.size(), 6U);
  EXPECT_NEAR(-d[1][0] - d[0][0], 1.4, 1e-12);  // two pitches of 0.7 mm
  EXPECT_NEAR(-d[3][0] - d[2][0], 1.4, 1e-12);
  EXPECT_GT(-d[5][0] - d[4][0], 0.2);  // at least two fibers of 0.1 mm over one another
  EXPECT_THAT(text, HasSubstr("<Textile name=\"a &quot;plain&quot; &lt;weave&gt;\""));
}

TEST_F(TexGen, FibersFillTheirShareOfEachYarn) {
  const auto areas = values(text, "Yarn", "FibreAreaValue");
  ASSERT_EQ(areas.size(), envelopes.yarns.size());
  // Solid area of three fibers, cut at the yarn's slope, which is less than 45 degrees.
  const double solid = 1e6 * 3 * start.cell.types.front().area;
  for (const auto& area : areas) {
    EXPECT_GE(area[0], solid * (1 - 1e-9));
    EXPECT_LT(area[0], solid * std::sqrt(2));
  }
}

}  // namespace
