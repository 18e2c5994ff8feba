#include "weave/cloth_order.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "unit/synthetic_cloth.hpp"

namespace {

/// Wefts along y at (x, z), in the order of their insertion, each of two fibers beside one another.
weave::Snapshot cell_of(const std::vector<std::pair<double, double>>& places) {
  weave::Snapshot s;
  s.cell_width = s.cell_length = 1;
  s.x_min = -1;
  s.offset = {0};
  for (std::size_t weft = 0; weft < places.size(); ++weft) {
    for (int fiber = 0; fiber < 2; ++fiber) {
      for (int k = 0; k <= 10; ++k) s.x.emplace_back(places[weft].first + 0.02 * fiber - 0.01, 0.1 * k, places[weft].second);
      s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
      s.yarn.push_back(static_cast<int>(weft));
      s.fiber.push_back(fiber);
      s.weft.push_back(1);
      s.radius.push_back(0.01);
    }
  }
  return s;
}

TEST(cloth_order, columns_of_a_loom_from_the_fell_backwards) {
  const weave::Snapshot loom = cell_of({{-0.75, 0.2}, {-0.71, 0.1}, {-0.25, 0.2}, {-0.27, 0.1}, {-0.01, 0.2}, {0.01, 0.1}, {0.5, 0.2}});
  const std::vector<double> distances = weave::column_distances_behind_fell(loom, 0, 2);
  ASSERT_EQ(distances.size(), 3u);
  EXPECT_NEAR(distances[0], 0.5, 1e-12);
  EXPECT_NEAR(distances[1], 0.26, 1e-12);
  EXPECT_NEAR(distances[2], 0.47, 1e-12);
}

TEST(cloth_order, columns_and_layers_as_they_were_inserted) {
  const weave::ClothOrder order = weave::cloth_order(cell_of({{-0.75, 0.2}, {-0.72, 0.1}, {-0.25, 0.2}, {-0.26, 0.1}}), 2);
  EXPECT_NEAR(order.column_spread, 0.03, 1e-12);
  ASSERT_EQ(order.column_distances.size(), 2u);
  EXPECT_NEAR(order.column_distances[0], 0.48, 1e-12);
  EXPECT_NEAR(order.column_distances[1], 0.52, 1e-12);
  EXPECT_EQ(order.wefts_out_of_layer, 0);
  EXPECT_NEAR(order.fiber_slack, 0, 1e-12);
  EXPECT_NEAR(order.sharpest_turn, 0, 1e-7);
}

TEST(cloth_order, weft_over_the_one_before_it_is_out_of_layer) {
  EXPECT_EQ(weave::cloth_order(cell_of({{-0.75, 0.2}, {-0.75, 0.3}, {-0.25, 0.2}, {-0.25, 0.1}}), 2).wefts_out_of_layer, 1);
}

TEST(cloth_order, layers_of_alternating_columns_rise_and_fall) {
  const auto cell = cell_of({{-0.75, 0.2}, {-0.75, 0.1}, {-0.25, 0.1}, {-0.25, 0.2}});
  EXPECT_EQ(weave::cloth_order(cell, 2, weave::InsertionOrder::alternating).wefts_out_of_layer, 0);
  EXPECT_EQ(weave::cloth_order(cell, 2, weave::InsertionOrder::top_first).wefts_out_of_layer, 1);
}

TEST(cloth_order, loop_of_a_fiber_is_slack_and_turns) {
  weave::Snapshot s = cell_of({{-0.75, 0}, {-0.25, 0}});
  s.x[5].z() = 0.1;  // of the first fiber: two bars of 0.1 become two of 0.1 sqrt(2), at right angles
  const weave::ClothOrder order = weave::cloth_order(s, 1);
  const double longer = 1 + 0.2 * (std::numbers::sqrt2 - 1);
  EXPECT_NEAR(order.fiber_slack, longer / (0.5 * (longer + 1)) - 1, 1e-12);
  EXPECT_NEAR(order.sharpest_turn, 0.5 * std::numbers::pi, 1e-12);
}

TEST(cloth_order, plain_weave_is_in_order) {
  const weave::SyntheticCloth cloth;
  const weave::ClothOrder order = weave::cloth_order(make_synthetic_cloth(cloth), 1);
  EXPECT_NEAR(order.column_spread, 0, 1e-12);
  for (const double d : order.column_distances) EXPECT_NEAR(d, cloth.pitch, 1e-9);
  EXPECT_LT(order.fiber_slack, 0.01);
  EXPECT_LT(order.sharpest_turn, 0.2);
}

TEST(cloth_order, broken_columns_are_refused) {
  EXPECT_THROW(weave::cloth_order(cell_of({{-0.75, 0}, {-0.5, 0}, {-0.25, 0}}), 2), std::invalid_argument);
  weave::Snapshot cloth = cell_of({{-0.75, 0}});
  cloth.cell_length = 0;
  EXPECT_THROW(weave::cloth_order(cloth, 1), std::invalid_argument);
}

}  // namespace
