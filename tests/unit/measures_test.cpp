#include "weave/measures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace {

/// Two straight fibers of one warp yarn and two of a weft, side by side.
weave::Snapshot small_cell() {
  weave::Snapshot s;
  s.cell_width = s.cell_length = 1e-3;
  s.x_max = 1e-3;
  s.offset = {0};
  for (int f = 0; f < 4; ++f) {
    const bool weft = f >= 2;
    const double beside = (f % 2) * 2e-4;
    s.yarn.push_back(weft ? 1 : 0);
    s.fiber.push_back(f % 2);
    s.weft.push_back(weft);
    s.radius.push_back(1e-4);
    s.area.push_back(std::numbers::pi * 1e-8);
    for (int k = 0; k <= 10; ++k) {
      const double along = k * 1e-4;
      s.x.emplace_back(weft ? beside : along, weft ? along : beside, weft ? 1e-4 : -1e-4);
      s.tension.push_back(2);
      s.arc.push_back(along);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
  }
  return s;
}

TEST(measures, straight_cell_has_its_volume_thickness_and_no_crimp) {
  const weave::CellMeasures m = weave::measure_cell(small_cell());
  EXPECT_NEAR(m.thickness, 4e-4, 1e-15);
  EXPECT_NEAR(m.fiber_volume, 4 * std::numbers::pi * 1e-8 * 1e-3, 1e-20);
  EXPECT_NEAR(m.fiber_volume_fraction, m.fiber_volume / (1e-6 * m.thickness), 1e-12);
  EXPECT_NEAR(m.crimp_warp, 0, 1e-12);
  EXPECT_NEAR(m.crimp_weft, 0, 1e-12);
  EXPECT_NEAR(m.stress_max, 2 / (std::numbers::pi * 1e-8), 1e-3);
}

TEST(measures, mean_envelopes_are_nearer_than_the_extremes) {
  const weave::CellMeasures m = weave::measure_cell(small_cell());
  EXPECT_LT(m.thickness_mean, m.thickness);
  EXPECT_GT(m.thickness_mean, 1.5e-4);  // a single fiber is pi/4 of 2e-4 thick in the mean
}

TEST(measures, axis_of_nodes_on_a_parabola_is_that_parabola_farther_in) {
  weave::Snapshot cell = small_cell();
  const double bend = 100, h = 1e-4;  // z = bend x^2, whose axis by B-splines over nodes h apart is z = bend (x^2 + h^2/4)
  for (int k = 0; k <= 10; ++k) cell.x[k].z() = bend * cell.x[k].x() * cell.x[k].x();
  const weave::Snapshot axis = weave::on_axis(cell);
  ASSERT_EQ(axis.offset, (std::vector<std::int64_t>{0, 21, 42, 63, 84}));
  for (int k = 1; k < 20; ++k) {
    EXPECT_NEAR(axis.x[k].x(), 0.5 * k * h, 1e-15);
    EXPECT_NEAR(axis.arc[k], 0.5 * k * h, 1e-15);
    EXPECT_NEAR(axis.x[k].z(), bend * (axis.x[k].x() * axis.x[k].x() + 0.25 * h * h), 1e-15);
  }
  EXPECT_EQ(axis.x[0], cell.x[0]);
  EXPECT_EQ(axis.x[20], cell.x[10]);
  EXPECT_EQ(weave::on_axis(axis).x, axis.x);
}

TEST(measures, axis_of_a_weft_goes_on_over_its_seam) {
  weave::Snapshot cell = small_cell();
  cell.x[22].z() += 8e-6;  // the first node of a weft, and its image
  cell.x[32].z() += 8e-6;
  const weave::Snapshot axis = weave::on_axis(cell);
  EXPECT_NEAR(axis.x[42].z(), 1e-4 + 6e-6, 1e-18);
  EXPECT_NEAR(axis.x[62].z(), 1e-4 + 6e-6, 1e-18);
  EXPECT_NEAR(axis.x[44].z(), 1e-4 + 1e-6, 1e-18);
  EXPECT_NEAR(axis.x[60].z(), 1e-4 + 1e-6, 1e-18);
  EXPECT_NEAR((axis.x[62] - axis.x[42]).y(), cell.cell_width, 1e-18);
}

TEST(measures, same_cell_is_steady) {
  const weave::Steadiness s = weave::steadiness(small_cell(), small_cell());
  EXPECT_EQ(s.mean, 0);
  EXPECT_EQ(s.largest, 0);
}

TEST(measures, translation_of_a_cell_is_no_difference) {
  weave::Snapshot moved = small_cell();
  for (weave::Vec3& x : moved.x) x += weave::Vec3(5e-3, 0, 3e-4);
  moved.x_min += 5e-3;
  moved.x_max += 5e-3;
  const weave::Steadiness s = weave::steadiness(small_cell(), moved);
  EXPECT_NEAR(s.mean, 0, 1e-12);
  EXPECT_NEAR(s.shift.z(), 3e-4, 1e-15);
}

TEST(measures, weft_that_starts_elsewhere_is_no_difference) {
  weave::Snapshot cell = small_cell();
  for (int k = 0; k <= 10; ++k) {  // a crimped weft, the same in both cells but with its first node 0.3 of the width farther on
    const auto z = [](double y) { return 1e-4 + 5e-5 * std::sin(2 * std::numbers::pi * y / 1e-3); };
    for (const int f : {22, 33}) cell.x[f + k].z() = z(cell.x[f + k].y());
  }
  weave::Snapshot other = cell;
  for (const int f : {22, 33}) {
    for (int k = 0; k <= 10; ++k) {
      other.x[f + k] = cell.x[f + (k + 3) % 10];
      if (k + 3 >= 10) other.x[f + k].y() += 1e-3;
    }
  }
  const weave::Steadiness s = weave::steadiness(cell, other);
  EXPECT_NEAR(s.mean, 0, 1e-12);
}

TEST(measures, exchanged_fibers_of_a_yarn_are_no_difference) {
  weave::Snapshot other = small_cell();
  for (int k = 0; k <= 10; ++k) std::swap(other.x[22 + k], other.x[33 + k]);
  const weave::Steadiness s = weave::steadiness(small_cell(), other);
  EXPECT_NEAR(s.mean, 0, 1e-12);
  EXPECT_NEAR(s.mean_by_label, 0.5, 1e-12);  // half of the fibers are a diameter away from their number
}

TEST(measures, displaced_fiber_counts_by_its_share) {
  weave::Snapshot other = small_cell();
  for (int k = 0; k <= 10; ++k) other.x[k].z() -= 4e-5;  // 0.2 diameters down; the mean of all follows by a quarter
  const weave::Steadiness s = weave::steadiness(small_cell(), other);
  EXPECT_NEAR(s.shift.z(), -1e-5, 1e-15);
  EXPECT_NEAR(s.mean, (0.15 + 3 * 0.05) / 4, 1e-12);
  EXPECT_NEAR(s.largest, 0.15, 1e-12);
}

TEST(measures, cells_of_different_fibers_are_refused) {
  weave::Snapshot other = small_cell();
  other.yarn[3] = 5;
  EXPECT_THROW(weave::steadiness(small_cell(), other), std::invalid_argument);
}

}  // namespace
