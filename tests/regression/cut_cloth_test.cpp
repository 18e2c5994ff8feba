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

struct FolderRemoved {
  std::filesystem::path path;
  ~FolderRemoved() { std::filesystem::remove_all(path); }
};

/// First node of the first fiber of a yarn.
std::int64_t first_node(const Snapshot& s, int yarn) {
  return s.offset[static_cast<std::size_t>(std::find(s.yarn.begin(), s.yarn.end(), yarn) - s.yarn.begin())];
}

// Unit cells of two picks, of which two stay behind the one at the fell: the first is cut off before the seventh pick, and the third weft
// is the first one after the cut. One and a half cells behind the fell the first two cells begin with the first pick, the third with the
// second one: it holds other wefts than the one before and is not compared, the fourth is.
TEST(cut_cloth, first_weft_column_is_held_with_the_warps_ends) {
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml",
                                   {"fabric.cells=4", "fabric.kept_cells=2", "fabric.columns_behind_fell=3", "yarns.glass.fibers=1"});
  RunOptions options;
  options.output = scenes::temporary("cut_cloth");
  const FolderRemoved at_end{options.output};
  const weave::WeaveResult result = weave_cloth(c, options);
  ASSERT_EQ(result.status, RunStatus::completed) << result.message;
  EXPECT_LT(result.summary.energy_residual, 0.02);
  EXPECT_EQ(result.summary.steadiness.size(), 1u);

  const int held = 2 + 2, next = held + 1;  // yarns: two warps before the wefts
  const Snapshot before = weave::read_results(options.output / "picks/pick_0007.vtkhdf").snapshot;
  const Snapshot after = weave::read_results(options.output / "picks/pick_0008.vtkhdf").snapshot;
  EXPECT_EQ(after.yarn[static_cast<std::size_t>(std::find(after.weft.begin(), after.weft.end(), 1) - after.weft.begin())], held);
  const Vec3 drawn = after.x[first_node(after, 0)] - before.x[first_node(before, 0)];
  EXPECT_NEAR(drawn.x(), -c.take_up.length, 1e-12);
  const auto apart = [&](int yarn) {
    const std::int64_t a = first_node(before, yarn), b = first_node(after, yarn), nodes = first_node(before, yarn + 1) - a;
    double largest = 0;
    for (std::int64_t k = 0; k < nodes; ++k) largest = std::max(largest, (after.x[b + k] - before.x[a + k] - drawn).norm());
    return largest;
  };
  EXPECT_LT(apart(held), 1e-12);
  EXPECT_GT(apart(next), 1e-6);  // which moves in the cloth

  const weave::RunEstimate estimate = weave::estimate_run(c);
  EXPECT_NEAR(static_cast<double>(estimate.nodes_end) / static_cast<double>(result.summary.nodes_max), 1, 0.2);

  options.stop_at_step = result.summary.steps - 1000;  // in the last pick, past the cut
  EXPECT_EQ(weave_cloth(c, options).status, RunStatus::interrupted);
  options.stop_at_step = -1;
  options.resume = true;
  const weave::WeaveResult resumed = weave_cloth(c, options);
  EXPECT_EQ(resumed.status, RunStatus::completed) << resumed.message;
  EXPECT_EQ(resumed.loom.x, result.loom.x);
  EXPECT_EQ(resumed.loom.tension, result.loom.tension);
}

}  // namespace
