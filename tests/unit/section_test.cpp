#include "weave/section.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "unit/synthetic_cloth.hpp"

namespace weave {
namespace {

/// One fiber through the given points.
Snapshot one_fiber(const std::vector<Vec3>& points, bool weft) {
  Snapshot s;
  s.cell_width = 4;
  s.offset = {0, static_cast<std::int64_t>(points.size())};
  s.yarn = {3};
  s.fiber = {0};
  s.weft = {static_cast<std::uint8_t>(weft)};
  s.radius = {0.1};
  s.area = {2};
  s.x = points;
  for (std::size_t i = 0; i < points.size(); ++i) {
    s.tension.push_back(static_cast<double>(10 * i));
    s.arc.push_back(0);
  }
  return s;
}

TEST(Section, ObliqueFiberIsAnEllipse) {
  const Snapshot s = one_fiber({{0, 1, 0}, {2, 1, 2}}, false);
  const std::vector<SectionCircle> circles = cut_section(s, SectionAxis::x, 0.5);
  ASSERT_EQ(circles.size(), 1U);
  EXPECT_EQ(circles[0].yarn, 3);
  EXPECT_FALSE(circles[0].weft);
  EXPECT_DOUBLE_EQ(circles[0].u, 1);
  EXPECT_DOUBLE_EQ(circles[0].z, 0.5);
  EXPECT_DOUBLE_EQ(circles[0].aspect, std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(circles[0].angle, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(circles[0].tension, 2.5);
  EXPECT_DOUBLE_EQ(circles[0].stress, 1.25);
}

TEST(Section, LongEllipsesAreCapped) {
  const Snapshot s = one_fiber({{0, 1, 0}, {0.01, 1, 2}}, false);
  EXPECT_DOUBLE_EQ(cut_section(s, SectionAxis::x, 0.005).at(0).aspect, max_section_aspect);
}

TEST(Section, CrossingAtANodeCountsOnce) {
  const Snapshot s = one_fiber({{0, 1, 0}, {1, 1, 0}, {2, 1, 0}}, false);
  EXPECT_EQ(cut_section(s, SectionAxis::x, 1).size(), 1U);
}

TEST(Section, PeriodicImagesOfThePlane) {
  const Snapshot s = one_fiber({{5, -1, 0}, {5, 3, 0}}, true);  // a weft that starts off y = 0
  for (const double y : {-1.0, 0.0, 2.5, 3.0, 3.5, 100.25}) EXPECT_EQ(cut_section(s, SectionAxis::y, y).size(), 1U) << "y = " << y;
  EXPECT_DOUBLE_EQ(cut_section(s, SectionAxis::y, 3.5)[0].u, 5);
}

TEST(Section, PlainWeaveAcrossTheWarps) {
  const SyntheticCloth cloth;
  const Snapshot s = make_synthetic_cloth(cloth);
  // At the center line of weft 0 warp 0 is up, warp 1 down; the weft itself runs along the plane.
  std::set<std::size_t> warp_fibers;
  for (const SectionCircle& circle : cut_section(s, SectionAxis::x, -0.5 * cloth.pitch)) {
    if (circle.weft) continue;
    EXPECT_TRUE(warp_fibers.insert(circle.fiber).second);
    EXPECT_NEAR(circle.aspect, 1, 0.02);
    const double up = circle.yarn == 0 ? 1 : -1;
    EXPECT_NEAR(circle.z, up * cloth.amplitude, 2.01 * cloth.radius);
    if (s.fiber[circle.fiber] == 0) {
      EXPECT_NEAR(circle.z, up * cloth.amplitude, 1e-12);
      EXPECT_NEAR(circle.u, (circle.yarn + 0.5) * cloth.pitch, 1e-12);
    }
  }
  EXPECT_EQ(warp_fibers.size(), 14U);
}

TEST(Section, PlainWeaveBetweenTheWefts) {
  const SyntheticCloth cloth;
  const Snapshot s = make_synthetic_cloth(cloth);
  const std::vector<SectionCircle> circles = cut_section(s, SectionAxis::x, -cloth.pitch);
  EXPECT_EQ(circles.size(), 14U);  // seven fibers of two warps, no weft
  for (const SectionCircle& circle : circles) {
    EXPECT_FALSE(circle.weft);
    EXPECT_GT(circle.aspect, 1.03);
  }
}

TEST(Section, CellEndIsTheCellStart) {
  const Snapshot s = make_synthetic_cloth({});
  const auto start = cut_section(s, SectionAxis::x, s.x_min), end = cut_section(s, SectionAxis::x, s.x_max);
  ASSERT_EQ(start.size(), 14U);
  ASSERT_EQ(end.size(), start.size());
  for (std::size_t i = 0; i < start.size(); ++i) EXPECT_EQ(start[i].fiber, end[i].fiber);
  EXPECT_EQ(section_period(s, SectionAxis::x), s.cell_width);
  EXPECT_EQ(section_period(s, SectionAxis::y), s.cell_length);
}

}  // namespace
}  // namespace weave
