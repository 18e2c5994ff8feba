#include "weave/loom.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace weave {
namespace {

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

}  // namespace
}  // namespace weave
