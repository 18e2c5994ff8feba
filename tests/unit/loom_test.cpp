#include "weave/loom.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "scenes/small_case.hpp"
#include "weave/measures.hpp"

namespace weave {
namespace {

/// Of every motion: from rest with constant acceleration, so that its top speed is twice the mean (Yang 2015, eq. 10, 11).
TEST(LoomMotion, IsFromRestWithConstantAcceleration) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml", {"beat_up.dwell=\"0.1 ms\"", "beat_up.return_time=\"0.3 ms\""});
  const PickTimes times = pick_times(c, true, true);
  const auto expect_stroke = [&](auto&& position, double from, double time) {
    const double start = position(from), end = position(from + time), way = end - start;
    EXPECT_DOUBLE_EQ(position(from - 1e-5), start);
    for (const double share : {0.1, 0.5, 0.9})
      EXPECT_NEAR(position(from + share * time), start + share * share * way, 1e-12 * std::abs(way));
    return way;
  };
  const double stroke = 2 * c.beat_up.travel / c.beat_up.top_speed, h = 1e-9;
  const auto reed = [&](double t) { return reed_position(c, times, t); };
  EXPECT_NEAR(reed(0), c.beat_up.travel + c.loom.reed_bar_radius, 1e-15);
  EXPECT_NEAR(expect_stroke(reed, times.beat_up, stroke), -c.beat_up.travel, 1e-15);
  EXPECT_NEAR((reed(times.beat_up + stroke - h) - reed(times.beat_up + stroke)) / h, c.beat_up.top_speed, 1e-3 * c.beat_up.top_speed);
  EXPECT_NEAR(reed(times.reed_return), c.loom.reed_bar_radius, 1e-15);  // its bars touch the fell
  EXPECT_NEAR(expect_stroke(reed, times.reed_return, c.beat_up.return_time), c.beat_up.travel, 1e-15);
  EXPECT_NEAR(expect_stroke([&](double t) { return shed_progress(c, times, t); }, times.shedding, c.shedding.time), 1, 1e-15);
  EXPECT_NEAR(expect_stroke([&](double t) { return take_up_progress(c, times, t); }, times.take_up, c.take_up.time), 1, 1e-15);
}

TEST(LoomMotion, OneActionFollowsTheOther) {
  const Case late = parse_case(scenes::small_case_text(), "small.toml", {"beat_up.dwell=\"0.1 ms\"", "beat_up.return_time=\"0.3 ms\""});
  const double stroke = 2 * late.beat_up.travel / late.beat_up.top_speed, rest = late.settle_time;
  PickTimes t = pick_times(late, true, true);
  EXPECT_DOUBLE_EQ(t.beat_up, rest);
  EXPECT_DOUBLE_EQ(t.shedding, t.beat_up + stroke + late.beat_up.dwell);
  EXPECT_DOUBLE_EQ(t.reed_return, t.shedding + late.shedding.time);  // it holds the weft until the shed has changed
  EXPECT_DOUBLE_EQ(t.take_up, t.reed_return + late.beat_up.return_time + rest);
  EXPECT_DOUBLE_EQ(t.end, t.take_up + late.take_up.time + rest);

  Case early = late;
  early.beat_up.return_delay = 0;
  t = pick_times(early, true, false);
  EXPECT_DOUBLE_EQ(t.reed_return, t.beat_up + stroke + early.beat_up.dwell);
  EXPECT_DOUBLE_EQ(t.shedding, t.reed_return + early.beat_up.return_time + rest);
  EXPECT_DOUBLE_EQ(t.end, t.shedding + early.shedding.time + rest);
  t = pick_times(early, false, false);  // the shed stays
  EXPECT_DOUBLE_EQ(t.end, t.reed_return + early.beat_up.return_time + rest);

  Case without = late;
  without.beat_up.enabled = false;
  t = pick_times(without, true, true);
  EXPECT_DOUBLE_EQ(t.shedding, rest);
  EXPECT_DOUBLE_EQ(t.end, t.shedding + without.shedding.time + rest + without.take_up.time + rest);
}

TEST(BundleSection, FibersTouchButForTheGap) {
  const double radius = 0.5, gap = 0.01;
  for (const int fibers : {3, 5, 7, 19, 37}) {
    for (const double width : {1.02, 3.3, 100.0}) {  // one and three fibers across, and the shape that it likes best
      const auto places = bundle_section(fibers, radius, gap, width);
      ASSERT_EQ(places.size(), static_cast<std::size_t>(fibers));
      for (std::size_t i = 0; i < places.size(); ++i) {
        EXPECT_LE(2 * std::abs(places[i].x()) + 2 * radius, width + 1e-12);
        double nearest = 1e300;
        for (std::size_t j = 0; j < places.size(); ++j) {
          if (i != j) nearest = std::min(nearest, (places[i] - places[j]).norm());
        }
        EXPECT_NEAR(nearest, 2 * radius + gap, 1e-12) << fibers << " fibers, width " << width;
      }
    }
  }
}

TEST(BundleSection, RowsLieInTheValleysOfOthers) {
  const double radius = 0.5, width = 100;
  const double apart = (bundle_height(7, radius, width) - 1) / std::sqrt(3.0);  // one diameter and the gap of the start
  EXPECT_NEAR(apart, 1.06, 1e-12);
  EXPECT_DOUBLE_EQ(bundle_height(1, radius, width), 1);
  EXPECT_NEAR(bundle_height(3, radius, width), 1 + std::sqrt(0.75) * apart, 1e-12);
  EXPECT_NEAR(bundle_height(5, radius, width), 1 + std::sqrt(0.75) * apart, 1e-12);  // three below two: no higher than seven
  EXPECT_NEAR(bundle_height(19, radius, width), 1 + 2 * std::sqrt(3.0) * apart, 1e-12);
  EXPECT_NEAR(bundle_height(7, radius, apart), 1 + 6 * apart, 1e-12);  // one over the other where there is no room
}

constexpr double mm = 1e-3;

void add_fiber(bool weft, int yarn, const std::vector<Vec3>& x, Snapshot& snap) {
  if (snap.offset.empty()) snap.offset.push_back(0);
  snap.yarn.push_back(yarn);
  snap.fiber.push_back(0);
  snap.weft.push_back(weft);
  snap.radius.push_back(0.1 * mm);
  snap.area.push_back(0.01 * mm * mm);
  double arc = 0;
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (p > 0) arc += (x[p] - x[p - 1]).norm();
    snap.x.push_back(mm * x[p]);
    snap.arc.push_back(mm * arc);
    snap.tension.push_back(1);
  }
  snap.offset.push_back(static_cast<std::int64_t>(snap.x.size()));
}

/// The small case's loom, columns 0.8 mm apart, the last one at `last` [mm]; a warp that climbs and falls between columns in legs that lean
/// back, as those of a binder do, and a straight one.
Snapshot loom_with_steep_legs(double last) {
  Snapshot loom;
  loom.cell_width = 1.6 * mm;
  std::vector<Vec3> binder;
  for (double x = -4.4; x < 1; x += 1.6) {  // over the column at x, under the one at x + 0.8; its legs lie at x + 0.4 and x + 1.2
    for (const double z : {1.0, 0.0, -1.0}) binder.emplace_back(x + 0.4 - 0.02 * z * (z - 1), 0.4, z);
    for (const double z : {-1.0, 0.0, 1.0}) binder.emplace_back(x + 1.2 + 0.02 * z * (z + 1), 0.4, z);
  }
  add_fiber(false, 0, binder, loom);
  add_fiber(false, 1, {{-5, 1.2, 0}, {-3, 1.2, 0}, {2, 1.2, 0}}, loom);
  for (int pick = 0; pick < 4; ++pick) {
    const double x = last - 0.8 * (3 - pick);
    add_fiber(true, 2 + pick, {{x, 0, 0.5}, {x, 0.8, 0.5}, {x, 1.6, 0.5}}, loom);
  }
  return loom;
}

TEST(CutCell, WarpIsCutWhereItFirstCrossesTheFaces) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  const Snapshot cell = cut_cell(c, loom_with_steep_legs(-0.42), 2);
  EXPECT_NEAR(cell.x_max, -0.42 * mm, 1e-12);
  EXPECT_NEAR(cell.cell_length, 1.6 * mm, 1e-12);
  ASSERT_EQ(cell.yarn, (std::vector<int>{0, 1, 2, 3}));
  for (std::size_t f = 0; f < 2; ++f) {
    const auto begin = cell.offset[f], last = cell.offset[f + 1] - 1;
    EXPECT_NEAR(cell.x[begin].x(), cell.x_min, 1e-12);
    EXPECT_NEAR(cell.x[last].x(), cell.x_max, 1e-12);
    EXPECT_EQ(cell.arc[begin], 0);
    for (auto p = begin; p < last; ++p) {
      EXPECT_NEAR(cell.arc[p + 1] - cell.arc[p], (cell.x[p + 1] - cell.x[p]).norm(), 1e-12) << "node " << p;
      EXPECT_GT(cell.arc[p + 1], cell.arc[p]);
    }
  }
  // A period of the binder, from one place to its image.
  const auto last = cell.offset[1] - 1;
  EXPECT_NEAR((cell.x[last] - cell.x[0] - Vec3(cell.cell_length, 0, 0)).norm(), 0, 1e-12);
  EXPECT_NEAR(cell.arc[last], (2 * 2.0 + 2 * 0.8) * mm, 0.02 * mm);
  EXPECT_NEAR(cell.arc[cell.offset[2] - 1], 1.6 * mm, 1e-12);
}

TEST(CutCell, WarpsGoOnBeyondIt) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  const Snapshot cell = cut_cell(c, loom_with_steep_legs(-0.42), 2);
  const Continuation& beyond = cell.beyond;
  EXPECT_NEAR(beyond.length, 0.8 * mm, 1e-12);
  ASSERT_EQ(beyond.offset.size(), cell.fibers() + 1);
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    const auto begin = beyond.offset[f], end = beyond.offset[f + 1];
    if (cell.weft[f]) {
      EXPECT_EQ(begin, end);
      continue;
    }
    EXPECT_NEAR((beyond.x[begin] - cell.x[cell.offset[f + 1] - 1]).norm(), 0, 1e-12);
    EXPECT_EQ(beyond.arc[begin], 0);
    EXPECT_NEAR(beyond.x[end - 1].x(), cell.x_max + beyond.length, 1e-12);
    for (auto p = begin; p + 1 < end; ++p) EXPECT_NEAR(beyond.arc[p + 1] - beyond.arc[p], (beyond.x[p + 1] - beyond.x[p]).norm(), 1e-12);
  }
  const Snapshot axes = on_axis(cell);
  EXPECT_EQ(axes.beyond.x[axes.beyond.offset[0]], beyond.x[beyond.offset[0]]);
  EXPECT_GT(axes.beyond.x.size(), beyond.x.size());
}

TEST(CutCell, IsDrawnToItsLengthFromThatOnTheLoom) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  Snapshot loom = loom_with_steep_legs(-0.42);
  const Snapshot cell = cut_cell(c, loom, 2);
  EXPECT_NEAR(cell.length_on_loom, cell.cell_length, 1e-12);
  for (Vec3& x : loom.x) x.x() *= 1.05;
  const Snapshot longer = cut_cell(c, loom, 2);
  EXPECT_NEAR(longer.length_on_loom, 1.05 * cell.cell_length, 1e-12);
  ASSERT_EQ(longer.x.size(), cell.x.size());
  const Vec3 shift(longer.x_max - cell.x_max, 0, 0);
  for (std::size_t p = 0; p < cell.x.size(); ++p) EXPECT_NEAR((longer.x[p] - cell.x[p] - shift).norm(), 0, 1e-12);
  // As stretched as before: the straight warp's rest length is drawn as its path is.
  EXPECT_NEAR(longer.arc[longer.offset[2] - 1], cell.arc[cell.offset[2] - 1] / 1.05, 1e-12);
  // On the loom they are not the same.
  EXPECT_NEAR(steadiness(cell, cell).mean, 0, 1e-9);
  EXPECT_GT(steadiness(cell, longer).mean, 0.05);
}

TEST(CutCell, BeginsAtTheHeldEndsAtTheEarliest) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  Snapshot loom = loom_with_steep_legs(-0.42);
  for (const std::size_t f : {0, 1}) {  // both warps held half a pitch behind the third weft column from the fell
    for (auto p = loom.offset[f]; loom.x[p].x() < -1.62 * mm; ++p) loom.x[p].x() = -1.62 * mm + 1e-12 * mm * static_cast<double>(p);
  }
  const Snapshot cell = cut_cell(c, loom, 2);
  EXPECT_NEAR(cell.x_min, -1.62 * mm, 1e-12);
  EXPECT_NEAR(cell.x_max, -0.02 * mm, 1e-12);
  for (const std::size_t f : {0, 1}) EXPECT_NEAR((cell.x[cell.offset[f + 1] - 1] - cell.x[cell.offset[f]]).x(), cell.cell_length, 1e-12);
}

TEST(CutCell, OfPicksNoLongerOnTheLoomIsRefused) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  EXPECT_THROW(cut_cell(c, loom_with_steep_legs(-0.42), 4), std::runtime_error);
}

TEST(CutCell, SteepLegsNearAFaceMakeNoDifference) {
  const Case c = parse_case(scenes::small_case_text(), "small.toml");
  // The faces move over the legs, by a twentieth of a diameter; the cells are the same cloth.
  const Snapshot before = cut_cell(c, loom_with_steep_legs(-0.805), 2), after = cut_cell(c, loom_with_steep_legs(-0.795), 2);
  EXPECT_GT((after.x[0] - before.x[0]).norm(), 5 * 0.2 * mm);
  EXPECT_LT(steadiness(before, after).mean, 0.2);
}

}  // namespace
}  // namespace weave
