#include "outline.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "cap.hpp"
#include "scenes/bundles.hpp"

namespace relax {
namespace {

using std::numbers::pi;

std::vector<Disc> hexagon_of_discs(int rings) {
  std::vector<Disc> discs;
  for (const Vec2& place : scenes::hexagon(rings)) discs.push_back({place, 1});
  return discs;
}

/// Area within the outline that a ball of radius b leaves around a hexagon of k rings of touching discs of radius 1. Beyond the polygon of
/// the outer centers lie, for each of its 6 k sides of length 2, a triangle up to the center of the ball that touches both discs, less the
/// ball's sector in it, and around the corners sectors of discs that turn by 2 pi in all and by twice the triangle's half angle at each
/// side.
double rolled_area(int k, double b) {
  const double polygon = 1.5 * std::sqrt(3.0) * (2.0 * k) * (2.0 * k);
  const double half = std::asin(1 / (1 + b)), height = std::sqrt((1 + b) * (1 + b) - 1);
  return polygon + 6.0 * k * (height - b * b * half + half) + pi;
}

double rolled_length(int k, double b) {
  const double half = std::asin(1 / (1 + b));
  return 6.0 * k * (2 * b * half + 2 * half) + 2 * pi;
}

TEST(Outline, HexagonsRolledByABall) {
  for (const int k : {1, 2, 6}) {
    for (const double ball : {1.0, 4.0, 50.0}) {
      const std::optional<Outline> outline = roll_ball(hexagon_of_discs(k), ball);
      ASSERT_TRUE(outline);
      EXPECT_NEAR(outline->length, rolled_length(k, ball), 1e-9 * outline->length);  // rounding
      // Chords of length h miss at most length h^2 / 12 of an arc of radius 1.
      constexpr std::size_t points = 4000;
      const double h = outline->length / points;
      EXPECT_NEAR(moments_of(outline->points(points)).area, rolled_area(k, ball), outline->length * h * h / 12);
    }
  }
}

TEST(Outline, OneDiscIsACircle) {
  const std::optional<Outline> outline = roll_ball({{Vec2(3, -2), 0.5}}, 1);
  ASSERT_TRUE(outline);
  EXPECT_DOUBLE_EQ(outline->length, pi);
}

TEST(Outline, UnlikeDiscs) {
  // By symmetry the ball above and the ball below touch both; the outline's highest point is that of the larger disc.
  const std::optional<Outline> outline = roll_ball({{Vec2(0, 0), 2}, {Vec2(4, 0), 1}}, 3);
  ASSERT_TRUE(outline);
  Vec2 low = Vec2::Zero(), high = Vec2::Zero();
  for (const Vec2& p : outline->points(20000)) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // A point in 20000 lies within 1e-3 of where an extreme is taken, and so within 1e-6 of it.
  EXPECT_NEAR(low.x(), -2, 1e-6);
  EXPECT_NEAR(high.x(), 5, 1e-6);
  EXPECT_NEAR(high.y(), 2, 1e-6);
  EXPECT_NEAR(low.y(), -2, 1e-6);
}

TEST(Outline, ABallThatFallsThroughIsRefused) {
  const std::vector<Disc> apart = {{Vec2(0, 0), 1}, {Vec2(12, 0), 1}};
  EXPECT_FALSE(roll_ball(apart, 4));  // passes between
  EXPECT_FALSE(roll_ball(apart, 6));  // does not pass, but the balls of both sides overlap
  EXPECT_TRUE(roll_ball(apart, 30));
}

TEST(Outline, PolygonMoments) {
  const PolygonMoments m = moments_of({Vec2(1, 1), Vec2(5, 1), Vec2(5, 3), Vec2(1, 3)});
  EXPECT_DOUBLE_EQ(m.area, 8);
  EXPECT_TRUE(m.centroid.isApprox(Vec2(3, 2)));
  EXPECT_NEAR(m.second(0, 0), 2 * 64.0 / 12, 1e-12);  // b h^3 / 12; rounding
  EXPECT_NEAR(m.second(1, 1), 4 * 8.0 / 12, 1e-12);
  EXPECT_NEAR(m.second(0, 1), 0, 1e-12);
}

TEST(Outline, SimplePolygons) {
  EXPECT_TRUE(is_simple({Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)}));
  EXPECT_FALSE(is_simple({Vec2(0, 0), Vec2(1, 1), Vec2(1, 0), Vec2(0, 1)}));
}

TEST(Outline, UnionOfTwoDiscs) {
  // The lens of two unit discs a radius apart: 2 pi / 3 - sqrt(3) / 2.
  EXPECT_NEAR(union_area({{Vec2(0, 0), 1}, {Vec2(1, 0), 1}}), 2 * pi - (2 * pi / 3 - std::sqrt(3.0) / 2), 1e-12);
}

TEST(Cap, FillsAConcavePolygon) {
  const std::vector<Vec2> polygon = {Vec2(0, 0), Vec2(4, 0), Vec2(4, 3), Vec2(2, 1), Vec2(0, 3)};
  const auto triangles = triangulate_polygon(polygon);
  EXPECT_EQ(triangles.size(), polygon.size() - 2);
  double area = 0;
  for (const auto& t : triangles) {
    const double part = moments_of({polygon[t[0]], polygon[t[1]], polygon[t[2]]}).area;
    EXPECT_GT(part, 0);
    area += part;
  }
  EXPECT_DOUBLE_EQ(area, moments_of(polygon).area);
  EXPECT_THROW(triangulate_polygon({Vec2(0, 0), Vec2(1, 1), Vec2(1, 0), Vec2(0, 1)}), std::runtime_error);
}

}  // namespace
}  // namespace relax
