#include "relax/topology_start.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "scenes/cells.hpp"

namespace relax {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

weave::Case three_layers(weave::InsertionOrder order) {
  weave::Case c = scenes::plain_weave({.fibers = 3});
  weave::PositionMatrix straight(2, 2), binder(1, 2);
  straight << 2, 2, 1, 1;
  binder << 3, 0;
  c.layers = 3;
  c.insertion_order = order;
  c.weft.yarn_of_layer.assign(3, c.sections[0].yarn);
  c.sections.resize(2);
  c.sections[0].matrix = weave::weaving_matrix_from_positions(straight, 3, order);
  c.sections[1].matrix = weave::weaving_matrix_from_positions(binder, 3, order);
  c.sections[1].tension = 0.25 * c.sections[0].tension;
  return c;
}

double tension_of(const Cell& cell, int yarn) {
  double sum = 0;
  for (std::size_t f = 0; f < cell.fibers(); ++f) sum += cell.yarn[f] == yarn ? cell.tension[f] : 0;
  return sum;
}

/// Mean height of a yarn's nodes where they are within a tenth of the cell of x.
double height_at(const Cell& cell, const std::vector<Vec3>& positions, int yarn, double x) {
  double sum = 0;
  int count = 0;
  for (std::size_t node = 0; node < cell.nodes(); ++node)
    if (cell.yarn[cell.fiber_of[node]] == yarn && std::abs(positions[node].x() - x) < 0.1 * cell.length_x) {
      sum += positions[node].z();
      ++count;
    }
  return sum / count;
}

TEST(TopologyStart, TensionsAreTheSectionsAndTheLooms) {
  const weave::Case c = three_layers(weave::InsertionOrder::top_first);
  const auto [cell, x] = cell_from_topology(c, {});
  EXPECT_DOUBLE_EQ(tension_of(cell, 0), c.sections[0].tension);
  EXPECT_DOUBLE_EQ(tension_of(cell, 2), 0.25 * c.sections[0].tension);
  EXPECT_DOUBLE_EQ(tension_of(cell, 3), c.loom.tension);
  const auto [given, y] = cell_from_topology(c, {.warp_tension = 5, .weft_tension = 7});
  EXPECT_DOUBLE_EQ(tension_of(given, 2), 5);
  EXPECT_DOUBLE_EQ(tension_of(given, 3), 7);
}

TEST(TopologyStart, WeftsLieInTheLayersThatTheirOrderOfInsertionGives) {
  for (const auto order : {weave::InsertionOrder::top_first, weave::InsertionOrder::alternating}) {
    const weave::Case c = three_layers(order);
    const auto [cell, x] = cell_from_topology(c, {});
    for (int column = 0; column < 2; ++column) {
      const double at = (column + 0.5) / 2 * cell.length_x;
      std::vector<double> by_layer(3);
      for (int k = 0; k < 3; ++k)
        by_layer[static_cast<std::size_t>(c.layer_of_pick(3 * column + k))] = height_at(cell, x, 3 + 3 * column + k, at);
      EXPECT_TRUE(std::is_sorted(by_layer.rbegin(), by_layer.rend())) << "column " << column;
      // The first straight warp lies between the upper two layers, the binder above all of them or below.
      EXPECT_GT(by_layer[0], height_at(cell, x, 0, at));
      EXPECT_LT(by_layer[1], height_at(cell, x, 0, at));
      const double binder = height_at(cell, x, 2, at);
      EXPECT_TRUE(column == 0 ? binder > by_layer[0] : binder < by_layer[2]);
    }
  }
}

TEST(TopologyStart, BadInputIsNamed) {
  weave::Case c = three_layers(weave::InsertionOrder::top_first);
  EXPECT_THAT([&] { cell_from_topology(c, {.warp_tension = -1}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("tensions >= 0")));
  c.sections[0].matrix.col(0).head(3) << 1, -1, 1;
  EXPECT_THAT([&] { cell_from_topology(c, {}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("warp positions")));
}

}  // namespace
}  // namespace relax
