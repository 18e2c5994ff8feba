#include "heddle/relax_command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "relax/compare.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "relax/topology_start.hpp"
#include "scenes/cells.hpp"
#include "scenes/own_folder.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using testing::AllOf;
using testing::HasSubstr;

nlohmann::json json_in(const std::filesystem::path& file) {
  std::ifstream in(file);
  return nlohmann::json::parse(in);
}

/// Relaxes a plain weave of single fibers from topology.
class RelaxFolder : public OwnFolder {
 protected:
  void SetUp() override {
    OwnFolder::SetUp();
    weave::write_text_file(folder / "case.toml", weave::to_toml(scenes::plain_weave({.fibers = 1, .pitch = 4e-4})));
    options.input = folder / "case.toml";
    options.output = folder / "out";
    options.warp_tension = 0.2;
    options.element_length = 1;
    options.quiet = true;
  }
  RelaxOptions options;
};

TEST_F(RelaxFolder, PressuresAreOneAfterTheOther) {
  options.pressures = {0, 1000, 20000};
  EXPECT_EQ(relax_command(options), 0);
  const nlohmann::json rows = json_in(options.output / "summary.json").at("pressures");
  ASSERT_EQ(rows.size(), 3U);
  double thickness = 1;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].at("pressure_Pa"), options.pressures[i]);
    EXPECT_EQ(rows[i].at("converged"), true);
    EXPECT_LT(rows[i].at("thickness_m"), thickness);
    thickness = rows[i].at("thickness_m");
  }
  // The last one is the minimum under that pressure, and on the way there from the one before.
  options.pressures.clear();
  options.pressure = 20000;
  options.output = folder / "alone";
  EXPECT_EQ(relax_command(options), 0);
  const nlohmann::json alone = json_in(options.output / "summary.json"), last = json_in(folder / "out" / "pressure_20000" / "summary.json");
  EXPECT_NEAR(last.at("energy_J").at("sum").get<double>() / alone.at("energy_J").at("sum").get<double>(), 1, 1e-9);
  EXPECT_LT(last.at("iterations"), alone.at("iterations"));
  EXPECT_EQ(last.at("pressure_Pa"), 20000);
}

TEST_F(RelaxFolder, ResumedSeriesKeepsWhatIsFinishedAndGoesOnFromACheckpoint) {
  options.series = {1, 7};
  EXPECT_EQ(relax_command(options), 0);
  const std::filesystem::path one = options.output / "fibers_1", seven = options.output / "fibers_7";
  const nlohmann::json series = json_in(options.output / "series.json");
  const relax::RelaxedFile finished = relax::read_relaxed(one / "relax.vtkhdf");
  const auto written = std::filesystem::last_write_time(seven / "relax.vtkhdf");

  auto [cell, x] = relax::cell_from_topology(scenes::plain_weave({.fibers = 1, .pitch = 4e-4}), {0.2, 0.2, 1});
  relax::MinimizeOptions interrupted;
  interrupted.stop_at_iteration = 5;
  const Eigen::VectorXd q = relax::unknowns_at(cell, x);
  const relax::MinimizeResult stopped = relax::minimize(cell, q, interrupted);
  ASSERT_TRUE(stopped.interrupted);
  relax::write_checkpoint(one / "checkpoint.h5", {finished.case_toml, finished.options, q, false, cell, q, stopped.state, 100, {}});

  options.resume = true;
  EXPECT_EQ(relax_command(options), 0);
  EXPECT_FALSE(std::filesystem::exists(one / "checkpoint.h5"));
  EXPECT_GT(json_in(one / "summary.json").at("wall_s"), 100);  // it did go on from there
  EXPECT_EQ(relax::read_relaxed(one / "relax.vtkhdf").q, finished.q);
  EXPECT_EQ(std::filesystem::last_write_time(seven / "relax.vtkhdf"), written);
  const nlohmann::json again = json_in(options.output / "series.json");
  ASSERT_EQ(again.at("series").size(), 2U);
  EXPECT_EQ(again["series"][1], series["series"][1]);
  EXPECT_EQ(again["series"][0].at("energy_J"), series["series"][0].at("energy_J"));

  options.warp_tension = 0.3;
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::runtime_error>(HasSubstr("was made with --warp-tension = 0.2, not --warp-tension = 0.3")));
  options.warp_tension = 0.2;
  options.method = "newton";
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::runtime_error>(HasSubstr("was made with no further option, not --method = newton")));
}

TEST_F(RelaxFolder, ResultsOfAnotherStartAreNotTakenForThoseOfThis) {
  options.series = {1};
  EXPECT_EQ(relax_command(options), 0);
  const std::filesystem::path file = options.output / "fibers_1" / "relax.vtkhdf";
  relax::RelaxedFile other = relax::read_relaxed(file);
  ASSERT_GT(other.start.size(), 0);
  other.start[4] += 1e-9;
  relax::write_relaxed(file, other);
  options.resume = true;
  EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::runtime_error>(HasSubstr("relax.vtkhdf: is of another start")));
}

TEST_F(RelaxFolder, NothingBeginsAnewOverWhatWasInterrupted) {
  std::filesystem::create_directories(options.output);
  weave::write_text_file(options.output / "checkpoint.h5", "of hours of work");
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("checkpoint.h5: is of work that was interrupted"), HasSubstr("--resume"))));
  EXPECT_TRUE(std::filesystem::exists(options.output / "checkpoint.h5"));
}

TEST_F(RelaxFolder, OnlyAWovenCellOrACaseIsAStart) {
  EXPECT_EQ(relax_command(options), 0);
  const relax::RelaxedFile relaxed = relax::read_relaxed(options.output / "relax.vtkhdf");
  options.input = options.output / "relax.vtkhdf";
  EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::invalid_argument>(HasSubstr("relax.vtkhdf: is a relaxed cell")));
  // As if it had been woven, but of more fibers.
  options.input = folder / "cell.vtkhdf";
  weave::write_results(options.input, {relax::snapshot_of(relaxed.cell, relaxed.q), {}, relaxed.case_toml, "test"});
  const weave::Case c = weave::parse_case(relaxed.case_toml, "case.toml");
  options.overrides = {"yarns." + c.yarns.begin()->first + ".fibers=7"};
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("cell.vtkhdf: warp yarn 0 was woven of fibers 100 um thick"),
                                                         HasSubstr("a woven cell keeps its number of fibers a yarn"))));
}

TEST_F(RelaxFolder, NothingToResumeIsAnErrorForASingleRelaxation) {
  options.resume = true;
  EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::runtime_error>(HasSubstr("no checkpoint to resume from")));
}

TEST_F(RelaxFolder, EitherMethodAloneReachesTheSameMinimum) {
  double energy[2];
  for (const bool newton : {false, true}) {
    options.method = newton ? "newton" : "dynamic";
    options.output = folder / options.method;
    EXPECT_EQ(relax_command(options), 0);
    const nlohmann::json j = json_in(options.output / "summary.json");
    EXPECT_EQ(j.at("converged"), true);
    energy[newton] = j.at("energy_J").at("sum");
  }
  EXPECT_NEAR(energy[0] / energy[1], 1, 1e-9);
  options.tolerance = 1e-3;
  EXPECT_EQ(relax_command(options), 1);  // not as near as a certificate wants
}

TEST_F(RelaxFolder, RefinedCellsTellHowWellTheyStandForTheCoarseOnes) {
  options.fibers = 7;
  EXPECT_EQ(relax_command(options), 0);
  const nlohmann::json j = json_in(options.output / "summary.json");
  EXPECT_NEAR(j.at("refine_area_ratio"), 1, 0.01);
  EXPECT_EQ(j.at("refine_order_violations"), 0);
  EXPECT_GT(j.at("refine_overlap_before_newton"), 0);
  options.fibers = 0;
  EXPECT_EQ(relax_command(options), 0);
  EXPECT_FALSE(json_in(options.output / "summary.json").contains("refine_area_ratio"));
}

TEST_F(RelaxFolder, SeveralStartsAreCompared) {
  options.starts = 3;
  EXPECT_EQ(relax_command(options), 0);
  const nlohmann::json j = json_in(options.output / "comparison" / "summary.json");
  ASSERT_EQ(j.at("states").size(), 3U);
  EXPECT_EQ(j["states"][2].at("name"), "start_2");
  ASSERT_EQ(j.at("pairs").size(), 3U);
  for (const auto& state : j["states"]) EXPECT_EQ(state.at("certificate").at("converged"), true);
  for (const auto& pair : j["pairs"]) EXPECT_TRUE(pair.at("different_minima").is_boolean());
  EXPECT_NE(relax::read_relaxed(options.output / "start_0" / "relax.vtkhdf").history.front().energy,
            relax::read_relaxed(options.output / "start_1" / "relax.vtkhdf").history.front().energy);
}

TEST(RelaxCommand, OptionsThatExcludeOneAnotherAreRefused) {
  const auto refused = [](auto&& set, const std::string& text) {
    RelaxOptions options;
    options.input = std::filesystem::path(HEDDLE_CASES_DIR) / "kevlar_km2_706";
    set(options);
    EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
  };
  refused([](RelaxOptions& o) { o.pressures = {0, 1}, o.pressure = 1; }, "--pressures: gives them in place");
  refused([](RelaxOptions& o) { o.pressures = {0, 1, 0}; }, "stands there twice");
  refused([](RelaxOptions& o) { o.pressures = {0}, o.series = {7}; }, "not with --series");
  refused([](RelaxOptions& o) { o.starts = 2, o.series = {7}; }, "not with --series or --pressures");
  refused([](RelaxOptions& o) { o.method = "dynamic", o.load_x = 1; }, "moves no free length");
  refused([](RelaxOptions& o) { o.pressures = {100000.1, 100000.2}; }, "to six digits");
  refused([](RelaxOptions& o) { o.start_fibers = 7, o.fibers = 3; }, "--fibers 3: must be >= 7, the fibers that yarn 0 starts with");
  refused([](RelaxOptions& o) { o.start_fibers = 7, o.series = {19, 3}; }, "--series 3: must be >= 7");
}

TEST(RelaxCommand, LoadsThatLeaveTheSizeOfTheCellOpenAreRefused) {
  RelaxOptions options;
  options.input = std::filesystem::path(HEDDLE_CASES_DIR) / "kevlar_km2_706";  // from topology: two warps and two wefts of 3 N
  options.quiet = true;
  options.load_x = 6;
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("--load-x = 6: must be < 6 N, the prescribed tension of all warps")));
  options.load_x = 5.5;
  options.load_y = 5.5;
  EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::invalid_argument>(HasSubstr("leave the size of the cell open")));
}

}  // namespace
}  // namespace heddle
