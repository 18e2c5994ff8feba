#include <gtest/gtest.h>

#include <cmath>

#include "scenes/belt.hpp"

namespace {

using namespace scenes;

TEST(capstan, each_rod_keeps_the_discrete_law_and_the_drum_converges_to_the_exponential) {
  BeltSpec spec;
  const double truth = std::exp(spec.friction * spec.wrap);
  double error[3];
  for (int i = 0; i < 3; ++i) {
    spec.rods = 4 << i;
    spec.rod_over_bar = 0.02 / (1 << i);  // so that the rods' thickness, a first-order error, vanishes too
    const DrawnBelt result = draw_belt(belt_on_drum(spec), spec);
    // The samples of a crossing push along the fiber by up to 0.01 of the normal force, as measured in friction_path_test.
    EXPECT_LT(result.law_error, 0.01 * spec.wrap / spec.rods) << spec.rods;
    error[i] = std::abs(result.ratio / truth - 1);
  }
  EXPECT_NEAR(std::log2(error[0] / error[1]), 2, 0.3);
  EXPECT_NEAR(std::log2(error[1] / error[2]), 2, 0.3);
  EXPECT_LT(error[2], 2e-3);
}

}  // namespace
