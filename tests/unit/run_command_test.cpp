#include "heddle/run_command.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "heddle/results_folder.hpp"
#include "scenes/own_folder.hpp"
#include "scenes/small_case.hpp"
#include "weave/results.hpp"

namespace {

using ::testing::HasSubstr;

class RunCommand : public OwnFolder {
 protected:
  std::string read(const std::filesystem::path& file) const {
    std::ifstream in(folder / "out" / file);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
  }
};

TEST_F(RunCommand, WritesEveryFormatAndTheTimeOfEachStage) {
  weave::write_text_file(folder / "case.toml", scenes::small_case_text());
  heddle::PipelineOptions options;
  options.case_file = folder / "case.toml";
  options.output = folder / "out";
  options.overrides = {"yarns.glass.fibers=1", "fabric.cells=3", "numerics.element_length=1.5"};
  options.until = "mesh";
  options.minima = true;
  options.elements = 200;
  options.unconverged = true;  // loose fibers have no strict minimum
  options.quiet = true;
  ASSERT_EQ(heddle::run_command(options), 0);
  for (const std::string format : {"stl", "obj", "ply", "off", "vtp", "tg3"})
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / "envelope" / ("yarns." + format))) << format;
  for (const char* file : {"mesh.msh", "mesh.vtu", "abaqus.inp", "calculix.inp", "summary.json"})
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / "mesh" / file)) << file;
  EXPECT_FALSE(std::filesystem::exists(folder / "out" / "homogenize"));

  const std::string first = read("summary.json");
  const nlohmann::json summary = nlohmann::json::parse(first);
  double sum = 0;
  for (const char* stage : {"weave", "relax", "minima", "envelope", "mesh"}) {
    EXPECT_GT(summary.at("stage_wall_s").at(stage), 0) << stage;
    sum += summary.at("stage_wall_s").at(stage).get<double>();
  }
  EXPECT_EQ(summary.at("stage_wall_s").size(), 5U);
  EXPECT_DOUBLE_EQ(summary.at("wall_s"), sum);
  for (const char* title :
       {"<h3>Wall time</h3>", "<h2>Mesh</h2>", "<h3>Minima, and the woven cell</h3>", "<th>from_topology</th>",
        "<h3>By how much they differ</h3>", "Sections by yarn", "curve_convergence", "sections_warps", "sections_wefts"})
    EXPECT_THAT(read("report.html"), HasSubstr(title));

  const nlohmann::json minima = nlohmann::json::parse(read("minima/summary.json"));
  EXPECT_EQ(minima.at("states").size(), 3U);  // from the loom, from topology, woven
  EXPECT_EQ(minima.at("pairs").size(), 3U);

  EXPECT_EQ(heddle::stage_folder(folder / "out", "relax"), folder / "out" / "relax");
  EXPECT_EQ(heddle::stage_folder(folder / "out" / "relax", "relax"), folder / "out" / "relax");

  ASSERT_EQ(heddle::run_command(options), 0);  // nothing has changed: all stages are kept, with their times
  EXPECT_EQ(read("summary.json"), first);
}

TEST_F(RunCommand, WhatLaterStagesCanNotTakeIsToldBeforeTheWeaving) {
  weave::write_text_file(folder / "case.toml", scenes::small_case_text());
  heddle::PipelineOptions options;
  options.case_file = folder / "case.toml";
  options.output = folder / "out";
  const auto expect = [&](const heddle::PipelineOptions& o, const std::string& text) {
    EXPECT_THAT([&] { heddle::run_command(o); }, ::testing::ThrowsMessage<std::invalid_argument>(HasSubstr(text)));
  };
  heddle::PipelineOptions wrong = options;
  wrong.fibers = 1;
  expect(wrong, "--fibers 1: must be >= 3, the fibers of yarn glass");
  for (const char* length : {"50", "0", "0 um", "1 nm"}) {
    wrong = options;
    wrong.edge_length = length;
    expect(wrong, "edge");
  }
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

TEST_F(RunCommand, PicturesThatCanNotBeDrawnLeaveTheWeaveComplete) {
  weave::write_text_file(folder / "case.toml", scenes::small_case_text());
  heddle::PipelineOptions options;
  options.case_file = folder / "case.toml";
  options.output = folder / "out";
  options.overrides = {"yarns.glass.fibers=1"};
  options.until = "weave";
  options.quiet = true;
  std::filesystem::create_directories(options.output / "weave");
  weave::write_text_file(options.output / "weave" / "pictures", "in the way of the folder");
  EXPECT_EQ(heddle::run_command(options), 0);
  const std::string woven = read("weave/summary.json");
  std::filesystem::remove(options.output / "weave" / "pictures");
  EXPECT_EQ(heddle::run_command(options), 0);  // what is missing is drawn, and nothing is woven
  EXPECT_EQ(read("weave/summary.json"), woven);
  EXPECT_TRUE(std::filesystem::exists(options.output / "weave" / "pictures" / "side.png"));
}

TEST_F(RunCommand, MinimaNeedARelaxedCell) {
  weave::write_text_file(folder / "case.toml", scenes::small_case_text());
  heddle::PipelineOptions options;
  options.case_file = folder / "case.toml";
  options.until = "weave";
  options.minima = true;
  EXPECT_THAT([&] { heddle::run_command(options); }, ::testing::ThrowsMessage<std::invalid_argument>(HasSubstr("--minima")));
}

}  // namespace
