#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "scenes/small_case.hpp"
#include "scenes/temporary.hpp"
#include "weave/case.hpp"
#include "weave/weaving_run.hpp"

namespace {

using weave::Case;
using weave::RunOptions;
using weave::RunStatus;
using weave::WeaveResult;

/// The case of three warps made as small as it goes: one fiber a yarn, one unit cell of four picks, a short loom.
Case small_case() {
  const std::string file = std::string(HEDDLE_CASES_DIR) + "/three_warp/case.toml";
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  return weave::parse_case(text.str(), file,
                           {"fabric.cells=1", "yarns.s2_1250.fibers=1", "numerics.element_length=2.0", "loom.length=\"5 mm\"",
                            "shedding.time=\"0.6 ms\"", "insertion.time=\"0.2 ms\"", "settle.time=\"0.1 ms\"", "take_up.time=\"0.3 ms\""});
}

class FreshFolder {
 public:
  explicit FreshFolder(const std::string& name) : path_(scenes::temporary(name)) { std::filesystem::remove_all(path_); }
  ~FreshFolder() { std::filesystem::remove_all(path_); }
  FreshFolder(const FreshFolder&) = delete;
  FreshFolder& operator=(const FreshFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void expect_same_bits(const WeaveResult& a, const WeaveResult& b) {
  EXPECT_EQ(a.status, b.status) << a.message << b.message;
  ASSERT_EQ(a.loom.x.size(), b.loom.x.size());
  EXPECT_EQ(a.loom.x, b.loom.x);
  EXPECT_EQ(a.loom.tension, b.loom.tension);
  EXPECT_EQ(a.cell.x, b.cell.x);
  EXPECT_EQ(a.cell.offset, b.cell.offset);
  const weave::History &h = a.history, &k = b.history;
  EXPECT_EQ(h.time_s, k.time_s);
  EXPECT_EQ(h.action, k.action);
  EXPECT_EQ(h.reed_load_N, k.reed_load_N);
  EXPECT_EQ(h.warp_tension_N, k.warp_tension_N);
  EXPECT_EQ(h.overlap, k.overlap);
  EXPECT_EQ(h.kinetic_J, k.kinetic_J);
  EXPECT_EQ(h.slip_J, k.slip_J);
  EXPECT_EQ(h.work_heddle_J, k.work_heddle_J);
  EXPECT_EQ(h.residual_J, k.residual_J);
  EXPECT_EQ(h.reed_load_per_beat_N, k.reed_load_per_beat_N);
  EXPECT_EQ(a.summary.steps, b.summary.steps);
  EXPECT_EQ(a.summary.searches, b.summary.searches);
}

/// The small case woven without a break.
const WeaveResult& straight() {
  static const WeaveResult result = [] {
    omp_set_num_threads(1);
    return weave_cloth(small_case(), {});
  }();
  return result;
}

TEST(weaving_restart, small_case_is_woven) {
  EXPECT_EQ(straight().status, RunStatus::completed) << straight().message;
  EXPECT_EQ(straight().summary.picks, 4);
  EXPECT_EQ(straight().summary.order_violations, 0);
  EXPECT_EQ(straight().summary.late_searches, 0);
  const std::vector<double>& loads = straight().history.reed_load_per_beat_N;  // one cell: all of them
  ASSERT_EQ(loads.size(), 4U);
  EXPECT_DOUBLE_EQ(straight().summary.reed_load_mean, (loads[0] + loads[1] + loads[2] + loads[3]) / 4);
  EXPECT_EQ(straight().summary.reed_load_max, *std::ranges::max_element(loads));
}

TEST(weaving_restart, reed_loads_are_those_of_the_last_cell) {
  const WeaveResult two = weave_cloth(weave::parse_case(scenes::small_case_text(), "small.toml", {"fabric.cells=2"}), {});
  const std::vector<double>& loads = two.history.reed_load_per_beat_N;
  ASSERT_EQ(loads.size(), 4U);
  EXPECT_EQ(two.summary.reed_load_max, std::max(loads[2], loads[3]));
  EXPECT_DOUBLE_EQ(two.summary.reed_load_mean, 0.5 * (loads[2] + loads[3]));
}

TEST(weaving_restart, stopped_and_resumed_gives_the_same_bits) {
  const Case c = small_case();
  const FreshFolder folder("restart");
  const std::int64_t steps = straight().summary.steps;
  for (const std::int64_t stop : {std::int64_t{1}, steps / 7, steps / 2 + 1, steps - 3, steps}) {
    std::filesystem::remove_all(folder.path());
    RunOptions options;
    options.output = folder.path();
    options.stop_at_step = stop;
    EXPECT_EQ(weave_cloth(c, options).status, RunStatus::interrupted);
    options.resume = true;
    if (stop < steps) {
      options.stop_at_step = stop + (steps - stop) / 2;  // and once more
      EXPECT_EQ(weave_cloth(c, options).status, RunStatus::interrupted);
    }
    options.stop_at_step = -1;
    SCOPED_TRACE(testing::Message() << "stopped at step " << stop);
    expect_same_bits(straight(), weave_cloth(c, options));
  }
}

TEST(weaving_restart, stops_after_a_pick_and_goes_on_to_the_same_bits) {
  const FreshFolder folder("after_pick");
  RunOptions options;
  options.output = folder.path();
  options.stop_after_pick = 3;
  const WeaveResult stopped = weave_cloth(small_case(), options);
  EXPECT_EQ(stopped.status, RunStatus::interrupted);
  EXPECT_EQ(stopped.summary.picks, 3);
  EXPECT_EQ(stopped.history.reed_load_per_beat_N.size(), 3U);
  options.resume = true;
  EXPECT_EQ(weave_cloth(small_case(), options).summary.steps, stopped.summary.steps);  // they are done
  options.stop_after_pick = -1;
  expect_same_bits(straight(), weave_cloth(small_case(), options));
}

TEST(weaving_restart, two_threads_give_the_same_bits) {
  omp_set_num_threads(2);
  RunOptions options;
  options.stop_at_step = 2000;
  const WeaveResult two = weave_cloth(small_case(), options);
  omp_set_num_threads(1);
  expect_same_bits(weave_cloth(small_case(), options), two);
}

}  // namespace
