#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "scenes/own_folder.hpp"
#include "scenes/small_case.hpp"
#include "weave/case.hpp"
#include "weave/checkpoint.hpp"
#include "weave/weaving_run.hpp"

namespace {

using ::testing::HasSubstr;
using weave::Case;
using weave::Checkpoint;
using weave::RunOptions;
using weave::RunStatus;
using weave::WeaveResult;

class WeavingGuard : public OwnFolder {
 protected:
  [[nodiscard]] RunOptions into_folder() const {
    RunOptions options;
    options.output = folder;
    return options;
  }
  [[nodiscard]] std::filesystem::path checkpoint() const { return folder / "checkpoint.h5"; }
};

TEST_F(WeavingGuard, weft_on_the_wrong_side_stops_the_run_and_the_last_checkpoint_stays) {
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml", {"yarns.glass.fibers=1"});
  RunOptions options = into_folder();
  options.stop_after_pick = 1;
  ASSERT_EQ(weave_cloth(c, options).status, RunStatus::interrupted);
  // The woven weft is taken out over both warps, as if it had passed through one.
  Checkpoint taken_out = weave::read_checkpoint(checkpoint());
  const weave::Model& m = taken_out.model;
  for (std::size_t p = 0; p < m.nodes(); ++p) {
    if (m.role[m.fiber_of[p]] == weave::Role::weft) taken_out.state.x[p].z() += c.loom.height;
  }
  taken_out.state.x_pick.clear();  // all that is near is to be looked for again
  weave::write_checkpoint(checkpoint(), taken_out);

  options.stop_after_pick = -1;
  options.resume = true;
  const WeaveResult result = weave_cloth(c, options);
  EXPECT_EQ(result.status, RunStatus::failed);
  EXPECT_THAT(result.message, HasSubstr("lies under weft 1"));
  EXPECT_THAT(result.message, HasSubstr("pick 2"));
  EXPECT_GT(result.summary.order_violations, 0);
  EXPECT_EQ(weave::read_checkpoint(checkpoint()).state.step, taken_out.state.step);
}

TEST_F(WeavingGuard, run_that_fails_leaves_the_start_of_its_pick) {
  // Warps so taut that the wefts are pushed through them.
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml", {"loom.tension=\"1000 N\""});
  const WeaveResult failed = weave_cloth(c, into_folder());
  ASSERT_EQ(failed.status, RunStatus::failed);
  EXPECT_THAT(failed.message, HasSubstr("is being pushed through"));
  ASSERT_TRUE(std::filesystem::exists(checkpoint()));
  EXPECT_LT(weave::read_checkpoint(checkpoint()).state.step, failed.summary.steps);
  RunOptions again = into_folder();
  again.resume = true;
  EXPECT_EQ(weave_cloth(c, again).message, failed.message);
}

TEST_F(WeavingGuard, what_another_weave_left_in_the_folder_is_gone) {
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml", {"yarns.glass.fibers=1"});
  ASSERT_EQ(weave_cloth(c, into_folder()).status, RunStatus::completed);
  ASSERT_TRUE(std::filesystem::exists(folder / "cell.vtkhdf"));
  ASSERT_TRUE(std::filesystem::exists(folder / "picks/pick_0002.vtkhdf"));
  std::ofstream(folder / "notes.txt") << "mine";
  RunOptions options = into_folder();
  options.stop_after_pick = 1;
  ASSERT_EQ(weave_cloth(c, options).status, RunStatus::interrupted);
  EXPECT_FALSE(std::filesystem::exists(folder / "cell.vtkhdf"));
  EXPECT_FALSE(std::filesystem::exists(folder / "picks/pick_0002.vtkhdf"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "cells"));
  EXPECT_TRUE(std::filesystem::exists(folder / "notes.txt"));
}

TEST_F(WeavingGuard, beat_up_may_be_left_out) {
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml", {"beat_up.enabled=false"});
  const WeaveResult result = weave_cloth(c, into_folder());
  EXPECT_EQ(result.status, RunStatus::completed) << result.message;
  EXPECT_EQ(result.summary.order_violations, 0);
  EXPECT_LT(result.summary.energy_residual, 0.01);
  for (const double load : result.history.reed_load_N) EXPECT_EQ(load, 0);
  // What the reed has not pressed together lies farther apart.
  const WeaveResult beaten = weave_cloth(weave::parse_case(scenes::small_case_text(), "small.toml"), {});
  const auto farthest_weft = [&](const WeaveResult& woven) {
    double x = -1;
    for (std::size_t f = 0; f < woven.loom.fibers(); ++f) {
      if (woven.loom.weft[f]) x = std::max(x, woven.loom.x[static_cast<std::size_t>(woven.loom.offset[f])].x());
    }
    return x;
  };
  EXPECT_GT(farthest_weft(result), farthest_weft(beaten) + 0.1 * c.take_up.length);
}

// That law has action and reaction differ where fibers cross, so its ledger does not close: it weaves, but the line contact is the default.
TEST_F(WeavingGuard, node_to_node_contact_weaves_and_the_ledger_shows_what_it_makes_of_nothing) {
  const Case c = weave::parse_case(scenes::small_case_text(), "small.toml",
                                   {"numerics.contact=\"node\"", "numerics.element_length=1", "yarns.glass.fibers=1"});
  const WeaveResult result = weave_cloth(c, into_folder());
  EXPECT_EQ(result.status, RunStatus::completed) << result.message;
  EXPECT_EQ(result.summary.order_violations, 0);
  EXPECT_GT(result.summary.energy_residual, 0.1);
}

}  // namespace
