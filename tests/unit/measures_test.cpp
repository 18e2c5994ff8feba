#include "weave/measures.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "unit/synthetic_cloth.hpp"

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

TEST(measures, mean_thickness_is_the_same_wherever_the_cell_is_cut) {
  // Warps side by side all over the cell, and a weft over them: in the middle of the cell, or on both its faces, half of it on either.
  const auto thickness = [](double weft_x) {
    weave::Snapshot s;
    s.cell_width = s.cell_length = s.x_max = 1e-3;
    s.offset = {0};
    for (int f = 0; f < 6; ++f) {
      const bool weft = f == 5;
      s.yarn.push_back(f);
      s.fiber.push_back(0);
      s.weft.push_back(weft);
      s.radius.push_back(1e-4);
      s.area.push_back(std::numbers::pi * 1e-8);
      for (int k = 0; k <= 10; ++k) {
        const double along = k * 1e-4, warp_y = 1e-4 + f * 2e-4;
        s.x.emplace_back(weft ? weft_x : along, weft ? along : warp_y, weft ? 1e-4 : -1e-4);
        s.tension.push_back(2);
        s.arc.push_back(along);
      }
      s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
    }
    return weave::measure_cell(s).thickness_mean;
  };
  EXPECT_NEAR(thickness(0) / thickness(0.5e-3), 1, 1e-3);  // of the grid
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

TEST(measures, yarns_have_the_width_and_height_of_their_fibers) {
  const weave::CellMeasures m = weave::measure_cell(small_cell());  // two fibers of 2e-4, side by side, in each yarn
  EXPECT_NEAR(m.yarn_width_warp, 4e-4, 1e-15);
  EXPECT_NEAR(m.yarn_height_warp, 2e-4, 1e-15);
  EXPECT_NEAR(m.yarn_width_weft, 4e-4, 1e-15);
  EXPECT_NEAR(m.yarn_height_weft, 2e-4, 1e-15);
}

TEST(measures, families_have_their_own_yarn_sizes) {
  const weave::SyntheticCloth cloth;
  const double r = cloth.radius;
  weave::Snapshot s = weave::make_synthetic_cloth(cloth);
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    if (s.weft[f]) s.radius[f] = 0.5 * r;  // the places stay: centers up to 2 r beside the middle, and sqrt(3) r above it
  }
  const weave::CellMeasures m = weave::measure_cell(s);
  EXPECT_NEAR(m.yarn_width_warp, 6 * r, 0.01 * r);
  EXPECT_NEAR(m.yarn_width_weft, 5 * r, 0.01 * r);
  EXPECT_NEAR(m.yarn_height_warp - m.yarn_height_weft, r, 0.1 * r);  // sections are long where a yarn slopes
  EXPECT_GT(m.yarn_height_weft, (2 * std::sqrt(3.0) + 1) * r);
}

TEST(measures, yarns_that_are_not_there_have_no_size) {
  weave::Snapshot warps = small_cell();
  warps.offset.resize(3);
  for (auto* list : {&warps.yarn, &warps.fiber}) list->resize(2);
  warps.weft.resize(2);
  const weave::CellMeasures m = weave::measure_cell(warps);
  EXPECT_NEAR(m.yarn_width_warp, 4e-4, 1e-15);
  EXPECT_TRUE(std::isnan(m.yarn_width_weft));
  EXPECT_TRUE(std::isnan(m.yarn_height_weft));

  weave::Snapshot bundle = small_cell();
  bundle.cell_length = 0;  // of no unit cell
  EXPECT_TRUE(std::isnan(weave::measure_cell(bundle).yarn_width_warp));
}

/// Warps of radius 1e-4 in a square packing, 5 across and `layers` high, and one weft over them at x.
weave::Snapshot stacked_cell(int layers, double weft_x) {
  weave::Snapshot s;
  s.cell_width = s.cell_length = 1e-3;
  s.x_min = 2e-3;
  s.x_max = 3e-3;
  s.offset = {0};
  const auto add = [&](bool weft, const weave::Vec3& from, const weave::Vec3& to) {
    s.yarn.push_back(weft ? 1 : 0);
    s.fiber.push_back(0);
    s.weft.push_back(weft);
    s.radius.push_back(1e-4);
    s.area.push_back(1e-8);
    for (int k = 0; k <= 10; ++k) {
      s.x.emplace_back(from + 0.1 * k * (to - from));
      s.tension.push_back(1);
      s.arc.push_back(1e-4 * k);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
  };
  for (int i = 0; i < 5; ++i) {
    for (int layer = 0; layer < layers; ++layer) {
      const double y = (2 * i + 1) * 1e-4, z = 2e-4 * layer;
      add(false, {s.x_min, y, z}, {s.x_max, y, z});
    }
  }
  const double top = 2e-4 * layers;
  add(true, {weft_x, 0.3e-3, top}, {weft_x, 1.3e-3, top});
  return s;
}

TEST(measures, voids_of_a_square_packing_are_known) {
  using std::numbers::pi;
  // Over a fiber's width 2 r the envelopes of n layers bound 4 r^2 (n - 1) + pi r^2, of which n pi r^2 are fibers.
  const double warps_alone = 1 - 2 * pi / (4 + pi);
  // A weft cut along its axis adds 4 r^2 of fiber, and closes the hollows of the upper side: 2 r (5 r) + pi r^2 / 2 are bounded.
  const double with_weft = 1 - (2 * pi + 4) / (10 + pi / 2);
  for (const double weft_x : {2.5e-3, 3.5e-3}) {  // in the cell, and one cell farther on
    const std::vector<double> shares = weave::void_shares(stacked_cell(2, weft_x), 5);
    ASSERT_EQ(shares.size(), 5u);
    for (const int k : {0, 1, 3, 4}) EXPECT_NEAR(shares[k], warps_alone, 1e-3);
    EXPECT_NEAR(shares[2], with_weft, 1e-3);
  }
}

TEST(measures, places_without_fibers_are_no_voids) {
  weave::Snapshot cell = stacked_cell(1, 2.5e-3);
  cell.cell_width = 2e-3;  // half of the width is empty
  EXPECT_NEAR(weave::void_shares(cell, 5)[0], 0, 1e-3);
  cell.cell_length = 0;
  EXPECT_THROW(weave::void_shares(cell), std::invalid_argument);
}

TEST(measures, stress_of_middle_and_edge_is_told_apart) {
  weave::Snapshot s = weave::make_synthetic_cloth({});
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    for (auto p = s.offset[f]; p < s.offset[f + 1]; ++p) s.tension[p] = s.weft[f] ? 100 : s.fiber[f] == 0 ? 3 : 1 + s.fiber[f];
  }
  const weave::StressByPlace stress = weave::warp_stress_by_place(s);
  EXPECT_NEAR(stress.middle * s.area[0], 3, 1e-12);
  EXPECT_NEAR(stress.edge * s.area[0], 4.5, 1e-12);  // places 1 to 6

  const weave::StressByPlace alike = weave::warp_stress_by_place(small_cell());  // yarns of two fibers
  EXPECT_TRUE(std::isnan(alike.middle));
  EXPECT_TRUE(std::isnan(alike.edge));
}

TEST(measures, stress_is_told_by_distance_from_the_fell) {
  weave::Snapshot loom = weave::make_synthetic_cloth({.cells = 4});
  const double length = loom.cell_width;  // as long as wide
  for (std::size_t f = 0; f < loom.fibers(); ++f) {
    for (auto p = loom.offset[f]; p < loom.offset[f + 1]; ++p) loom.tension[p] = loom.weft[f] ? 100 : std::floor(-loom.x[p].x() / length);
  }
  const std::vector<double> stress = weave::warp_stress_behind_fell(loom, length, 3);
  ASSERT_EQ(stress.size(), 3u);
  for (const int k : {0, 1, 2}) EXPECT_NEAR(stress[k] * loom.area[0], k, 1e-12);
  EXPECT_EQ(weave::warp_stress_behind_fell(loom, length, 9).size(), 4u);
  EXPECT_TRUE(weave::warp_stress_behind_fell(loom, 10 * length, 9).empty());
}

}  // namespace
