#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "scenes/small_case.hpp"
#include "scenes/temporary.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"
#include "weave/weaving_run.hpp"

namespace {

using weave::Case;
using weave::RunOptions;
using weave::RunStatus;
using weave::Snapshot;
using weave::Vec3;

/// First node of the first fiber of a yarn.
std::int64_t first_node(const Snapshot& s, int yarn) {
  return s.offset[static_cast<std::size_t>(std::find(s.yarn.begin(), s.yarn.end(), yarn) - s.yarn.begin())];
}

class CutClothTest : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove_all(options_.output); }

  // Three unit cells of two picks, of which one stays behind the one at the fell: the first is cut off before the fifth pick, and the third
  // weft is the first one after the cut.
  Case case_ = weave::parse_case(scenes::small_case_text(), "small.toml", {"fabric.cells=3", "fabric.kept_cells=1"});
  RunOptions options_ = [] {
    RunOptions options;
    options.output = scenes::temporary("cut_cloth");
    return options;
  }();
};

TEST_F(CutClothTest, FirstWeftColumnIsHeldWithTheWarpsEnds) {
  const weave::WeaveResult result = weave_cloth(case_, options_);
  ASSERT_EQ(result.status, RunStatus::completed) << result.message;
  EXPECT_LT(result.summary.energy_residual, 0.02);
  const int held = 2 + 2, next = held + 1;  // yarns: two warps before the wefts
  const auto first_weft =
      static_cast<std::size_t>(std::find(result.loom.weft.begin(), result.loom.weft.end(), 1) - result.loom.weft.begin());
  EXPECT_EQ(result.loom.yarn[first_weft], held);

  const Snapshot before = weave::read_results(options_.output / "picks/pick_0005.vtkhdf").snapshot;
  const Snapshot after = weave::read_results(options_.output / "picks/pick_0006.vtkhdf").snapshot;
  const Vec3 drawn = after.x[first_node(after, 0)] - before.x[first_node(before, 0)];
  EXPECT_NEAR(drawn.x(), -case_.take_up.length, 1e-12);
  double held_apart = 0, next_apart = 0;
  for (std::size_t f = 0; f < before.fibers(); ++f) {
    if (before.yarn[f] != held && before.yarn[f] != next) continue;
    const auto same = [&](std::size_t g) { return after.yarn[g] == before.yarn[f] && after.fiber[g] == before.fiber[f]; };
    std::size_t g = 0;
    while (!same(g)) ++g;
    double& apart = before.yarn[f] == held ? held_apart : next_apart;
    for (std::int64_t k = 0; k < before.offset[f + 1] - before.offset[f]; ++k)
      apart = std::max(apart, (after.x[after.offset[g] + k] - before.x[before.offset[f] + k] - drawn).norm());
  }
  EXPECT_LT(held_apart, 1e-12);
  EXPECT_GT(next_apart, 1e-6);  // which moves in the cloth
}

TEST_F(CutClothTest, CellsFarBehindTheFellAreComparedOnceTheyAreWhole) {
  // One and a half cells behind the fell the second cell begins with the first pick, as the first does, and the third with the second one.
  const Case c =
      weave::parse_case(scenes::small_case_text(), "small.toml", {"fabric.cells=4", "fabric.kept_cells=3", "fabric.columns_behind_fell=3"});
  const weave::WeaveResult result = weave_cloth(c, {});
  ASSERT_EQ(result.status, RunStatus::completed) << result.message;
  EXPECT_EQ(result.summary.steadiness.size(), 1u);
}

TEST_F(CutClothTest, IsResumedToTheSameBits) {
  const weave::WeaveResult straight = weave_cloth(case_, {});
  options_.stop_at_step = straight.summary.steps - 1000;  // in the last pick
  EXPECT_EQ(weave_cloth(case_, options_).status, RunStatus::interrupted);
  options_.stop_at_step = -1;
  options_.resume = true;
  const weave::WeaveResult resumed = weave_cloth(case_, options_);
  EXPECT_EQ(resumed.status, RunStatus::completed) << resumed.message;
  EXPECT_EQ(resumed.loom.x, straight.loom.x);
  EXPECT_EQ(resumed.loom.tension, straight.loom.tension);
}

}  // namespace
