#include "weave/weaving_matrix.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

namespace weave {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

PositionMatrix six_layer_positions() {
  PositionMatrix positions(5, 2);
  positions << 6, 4, 5, 3, 4, 2, 3, 1, 2, 0;
  return positions;
}

PositionMatrix six_layer_mirror() {
  return six_layer_positions().rowwise().reverse();
}

// The table of Yang 2015, section 3.3, for positions [6 4; 5 3; 4 2; 3 1; 2 0].
const std::vector<std::string> six_layer_rows = {"+ - - - -", "+ + - - -", "+ + + - -", "+ + + + -", "+ + + + +", "+ + + + +",  //
                                                 "- - - - -", "- - - - -", "+ - - - -", "+ + - - -", "+ + + - -", "+ + + + -"};

// In the mirror the two weft columns change places.
const std::vector<std::string> six_layer_mirror_rows = {"- - - - -", "- - - - -", "+ - - - -", "+ + - - -", "+ + + - -", "+ + + + -",  //
                                                        "+ - - - -", "+ + - - -", "+ + + - -", "+ + + + -", "+ + + + +", "+ + + + +"};

TEST(WeavingMatrix, SixLayerSectionGivesThePublishedTable) {
  EXPECT_EQ(rows_of(weaving_matrix_from_positions(six_layer_positions(), 6)), six_layer_rows);
}

TEST(WeavingMatrix, SixLayerMirrorSectionGivesTheColumnsExchanged) {
  EXPECT_EQ(rows_of(weaving_matrix_from_positions(six_layer_mirror(), 6)), six_layer_mirror_rows);
}

TEST(WeavingMatrix, InverseReturnsThePositions) {
  EXPECT_EQ(positions_from_weaving_matrix(weaving_matrix_from_rows(six_layer_rows), 6), six_layer_positions());
  EXPECT_EQ(positions_from_weaving_matrix(weaving_matrix_from_rows(six_layer_mirror_rows), 6), six_layer_mirror());
}

TEST(WeavingMatrix, EveryPositionOfAColumnRoundTrips) {
  for (int layers = 1; layers <= 9; ++layers) {
    PositionMatrix positions(layers + 1, 2);
    for (int p = 0; p <= layers; ++p) positions.row(p) << p, layers - p;
    EXPECT_EQ(positions_from_weaving_matrix(weaving_matrix_from_positions(positions, layers), layers), positions);
  }
}

TEST(WeavingMatrix, AlternatingOrderTakesEverySecondColumnFromTheBottomUp) {
  std::vector<std::string> expected = six_layer_rows;
  std::reverse(expected.begin() + 6, expected.end());
  const WeavingMatrix matrix = weaving_matrix_from_positions(six_layer_positions(), 6, InsertionOrder::alternating);
  EXPECT_EQ(rows_of(matrix), expected);
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 6, InsertionOrder::alternating), six_layer_positions());
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 6), std::nullopt);
  std::vector<int> layer;
  for (int pick = 0; pick < 9; ++pick) layer.push_back(layer_of_pick(pick, 3, InsertionOrder::alternating));
  EXPECT_THAT(layer, testing::ElementsAre(0, 1, 2, 2, 1, 0, 0, 1, 2));
}

TEST(WeavingMatrix, StraightWarpsChangeTheShedOneByOneInAlternatingOrder) {
  PositionMatrix straight(3, 2);
  straight << 3, 3, 2, 2, 1, 1;
  const auto changes = [&](InsertionOrder order) {
    const WeavingMatrix matrix = weaving_matrix_from_positions(straight, 4, order);
    int most = 0;
    for (int pick = 0; pick < matrix.rows(); ++pick) {
      most = std::max(most, static_cast<int>((matrix.row(pick).array() != matrix.row((pick + 1) % matrix.rows()).array()).count()));
    }
    return most;
  };
  EXPECT_EQ(changes(InsertionOrder::top_first), 3);
  EXPECT_EQ(changes(InsertionOrder::alternating), 1);
}

TEST(WeavingMatrix, ThreeWarpExample) {
  WeavingMatrix expected(4, 3);
  expected << 1, -1, -1, 1, 1, -1, -1, -1, 1, -1, 1, 1;
  const std::vector<std::string> rows = {"+ - -", "+ + -", "- - +", "- + +"};
  EXPECT_EQ(weaving_matrix_from_rows(rows), expected);
  EXPECT_EQ(weaving_matrix_from_rows({"+--", "+ +-", "\t--+ ", "-++"}), expected);
  EXPECT_EQ(rows_of(expected), rows);
}

TEST(WeavingMatrix, UpsThenDownsHasNoInverse) {
  // Its first warp goes up, up, down, down: with four layers a column no position describes it, with one layer any matrix has one.
  const WeavingMatrix matrix = weaving_matrix_from_rows({"+--", "++-", "--+", "-++"});
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 4), std::nullopt);
  PositionMatrix single_layer(3, 4);
  single_layer << 1, 1, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1;
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 1), single_layer);
}

TEST(WeavingMatrix, NoInverseWherePicksDoNotFillColumnsOrEntriesAreNotSigns) {
  const WeavingMatrix matrix = weaving_matrix_from_rows({"-", "+", "-", "+"});
  EXPECT_NE(positions_from_weaving_matrix(matrix, 2), std::nullopt);
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 3), std::nullopt);
  EXPECT_EQ(positions_from_weaving_matrix(matrix, 0), std::nullopt);
  WeavingMatrix zeros = matrix;
  zeros(0, 0) = 0;
  EXPECT_EQ(positions_from_weaving_matrix(zeros, 2), std::nullopt);
}

TEST(WeavingMatrix, PositionOutsideTheLayersIsNamed) {
  PositionMatrix positions = six_layer_positions();
  positions(3, 1) = 7;
  EXPECT_THAT([&] { weaving_matrix_from_positions(positions, 6); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("positions[3][1] = 7: must be from 0 to 6")));
  positions(3, 1) = -1;
  EXPECT_THAT([&] { weaving_matrix_from_positions(positions, 6); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("positions[3][1] = -1: must be from 0 to 6")));
  EXPECT_THROW(weaving_matrix_from_positions(six_layer_positions(), 0), std::invalid_argument);
}

TEST(WeavingMatrix, BadRowsAreNamed) {
  EXPECT_THAT([] { weaving_matrix_from_rows({"+-", "+0"}); }, ThrowsMessage<std::invalid_argument>(HasSubstr("matrix[1] = \"+0\"")));
  EXPECT_THAT(
      [] {
        weaving_matrix_from_rows({"+-", "+"});
      },
      ThrowsMessage<std::invalid_argument>(HasSubstr("has 1 entries, the first row has 2")));
  EXPECT_THROW(weaving_matrix_from_rows({}), std::invalid_argument);
  EXPECT_THROW(weaving_matrix_from_rows({" "}), std::invalid_argument);
}

TEST(WeavingMatrix, AssemblyIsSideBySide) {
  const WeavingMatrix fabric =
      assemble({weaving_matrix_from_positions(six_layer_positions(), 6), weaving_matrix_from_positions(six_layer_mirror(), 6)});
  const std::vector<std::string> rows = rows_of(fabric);
  ASSERT_EQ(rows.size(), 12u);
  for (std::size_t i = 0; i < rows.size(); ++i) EXPECT_EQ(rows[i], six_layer_rows[i] + " " + six_layer_mirror_rows[i]);
  EXPECT_THROW(assemble({weaving_matrix_from_rows({"+"}), weaving_matrix_from_rows({"+", "-"})}), std::invalid_argument);
}

}  // namespace
}  // namespace weave
