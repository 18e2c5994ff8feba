#include "heddle/envelope_command.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"
#include "scenes/own_folder.hpp"
#include "weave/results.hpp"

namespace {

using namespace scenes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class EnvelopeCommand : public OwnFolder {
 protected:
  /// The cell as it starts, as if relaxation had left it there with this certificate.
  void write_relaxed(const std::optional<std::string>& blocked_by) const {
    relax::write_relaxed(folder / "relax.vtkhdf",
                         {start.cell, start.unknowns(), {}, weave::to_toml(plain_weave(weave)), "", "test", blocked_by});
  }

  int run(bool unconverged) const {
    heddle::EnvelopeCommandOptions options;
    options.input = folder;
    options.formats = {"off"};
    options.unconverged = unconverged;
    return heddle::envelope_command(options);
  }

  nlohmann::json summary() const {
    std::ifstream in(folder / "envelope" / "summary.json");
    return nlohmann::json::parse(in);
  }

  void expect_refused(const std::string& because) const {
    EXPECT_THAT([&] { run(false); }, ThrowsMessage<std::runtime_error>(AllOf(HasSubstr((folder / "relax.vtkhdf").string()),
                                                                             HasSubstr(because), HasSubstr("--unconverged"))));
    EXPECT_FALSE(std::filesystem::exists(folder / "envelope"));
  }

  PlainWeave weave{.fibers = 1, .pitch = 4e-4};  // fibers that do not touch at the start
  PosedCell start = plain_weave_cell(weave, 0.2, 1);
};

TEST_F(EnvelopeCommand, takes_a_certified_minimum) {
  write_relaxed("");
  EXPECT_EQ(run(false), 0);
  EXPECT_EQ(summary()["cell_blocked_by"], "");
  for (const char* picture : {"section_x.png", "section_y.png", "sections_warps.png", "sections_wefts.png"})
    EXPECT_GT(std::filesystem::file_size(folder / "envelope" / picture), 1000U) << picture;
  constexpr double diameter = 1e-4;  // [m]
  const nlohmann::json written = summary();
  for (const nlohmann::json& yarn : written["by_yarn"]) {
    // Of a single fiber: its circle, as a polygon of eight or more points, down to a share of cos(pi / 8) as wide.
    const nlohmann::json& width = yarn["sections"]["width_m"];
    EXPECT_LE(width["min"], width["mean"]);
    EXPECT_LE(width["mean"], width["max"]);
    EXPECT_NEAR(width["mean"], diameter, 0.08 * diameter);
  }
}

TEST_F(EnvelopeCommand, refuses_what_has_not_converged_before_any_work) {
  write_relaxed("the gradient is 0.1 of the reference tension");
  expect_refused("the gradient is 0.1 of the reference tension");
  EXPECT_EQ(run(true), 0);
  EXPECT_EQ(summary()["cell_blocked_by"], "the gradient is 0.1 of the reference tension");
}

TEST_F(EnvelopeCommand, certifies_a_state_whose_file_does_not_say) {
  write_relaxed({});
  expect_refused("gradient of ");
}

TEST_F(EnvelopeCommand, leaves_no_old_summary_beside_new_files) {
  write_relaxed("");
  ASSERT_EQ(run(false), 0);
  std::filesystem::remove(folder / "envelope" / "sections.h5");
  std::filesystem::create_directory(folder / "envelope" / "sections.h5");
  EXPECT_THROW(run(false), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder / "envelope" / "summary.json"));
  for (const auto& entry : std::filesystem::directory_iterator(folder / "envelope")) EXPECT_NE(entry.path().extension(), ".part");
}

TEST_F(EnvelopeCommand, leaves_no_files_of_another_cell) {
  const std::filesystem::path output = folder / "envelope";
  std::filesystem::create_directory(output);
  for (const char* file : {"warp_77_sections.csv", "warp_77.off", "weft_78.stl", "yarns.tg3", "warp_77.txt", "notes.csv"})
    std::ofstream(output / file) << "old";
  write_relaxed("");
  ASSERT_EQ(run(false), 0);
  for (const char* gone : {"warp_77_sections.csv", "warp_77.off", "weft_78.stl", "yarns.tg3"})
    EXPECT_FALSE(std::filesystem::exists(output / gone)) << gone;
  for (const char* kept : {"warp_77.txt", "notes.csv", "warp_0.off", "yarns.off"})
    EXPECT_TRUE(std::filesystem::exists(output / kept)) << kept;
}

TEST_F(EnvelopeCommand, takes_a_woven_cell) {
  weave::write_results(folder / "cell.vtkhdf",
                       {relax::snapshot_of(start.cell, start.unknowns()), {}, weave::to_toml(plain_weave(weave)), "test"});
  EXPECT_EQ(run(false), 0);
  EXPECT_EQ(summary()["cell_blocked_by"], "");
}

}  // namespace
