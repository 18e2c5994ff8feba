#include "heddle/view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "heddle/draft.hpp"
#include "heddle/plot.hpp"
#include "relax/relaxed_file.hpp"
#include "scenes/cells.hpp"
#include "scenes/own_folder.hpp"
#include "unit/synthetic_cloth.hpp"
#include "weave/results.hpp"

// The leak sanitizer's hook: fontconfig keeps a few fonts' patterns until the end.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libfontconfig";
}

namespace heddle {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class ViewTest : public OwnFolder {
 protected:
  /// A results folder with a woven cloth, its history and a unit cell.
  std::filesystem::path write_folder() const {
    weave::ResultsFile results;
    results.snapshot = weave::make_synthetic_cloth({.cells = 3});
    results.history = weave::make_synthetic_history(4);
    weave::write_results(folder / "weave.vtkhdf", results);
    weave::ResultsFile cell;
    cell.snapshot = weave::make_synthetic_cloth({});
    weave::write_results(folder / "cell.vtkhdf", cell);
    return folder;
  }
};

std::vector<std::string> names(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  for (const std::filesystem::path& file : files) names.push_back(file.filename().string());
  return names;
}

std::string first_bytes(const std::filesystem::path& file, std::size_t count) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes(count, '\0');
  in.read(bytes.data(), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

/// Width and height from a PNG file's header; throws where it is none.
std::array<int, 2> png_size(const std::filesystem::path& file) {
  const std::string bytes = first_bytes(file, 24);
  if (bytes.size() < 24 || bytes.substr(1, 3) != "PNG") throw std::runtime_error(file.string() + ": no PNG");
  const auto number = [&](std::size_t at) {
    int value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value * 256 + static_cast<unsigned char>(bytes[at + i]);
    return value;
  };
  return {number(16), number(20)};
}

TEST_F(ViewTest, FolderWithCellGivesEveryPicture) {
  const std::vector<std::filesystem::path> files = view({.results = write_folder(), .output = folder / "pictures", .width_px = 640});
  EXPECT_THAT(names(files), ElementsAre("loom_side.png", "side.png", "top.png", "section_x_-0.375mm.png", "section_x_-0.750mm.png",
                                        "section_y_0.375mm.png", "section_y_1.125mm.png", "curve_reed_load.png", "curve_warp_tension.png",
                                        "curve_energy.png", "curve_overlap.png"));
  for (const std::filesystem::path& file : files) {
    const auto [width, height] = png_size(file);
    EXPECT_EQ(width, 640) << file;
    EXPECT_GT(height, 60) << file;
    EXPECT_LT(height, 640) << file;
    EXPECT_GT(std::filesystem::file_size(file), 1000U) << file;
  }
  EXPECT_EQ(png_size(folder / "pictures" / "curve_reed_load.png")[1], 304);
}

TEST_F(ViewTest, RelaxedCellShowsHowItConverged) {
  const scenes::PlainWeave weave{.fibers = 1, .pitch = 4e-4};
  const scenes::PosedCell start = scenes::plain_weave_cell(weave, 0.2, 1);
  std::vector<relax::MinimizeProgress> history(30);
  for (std::size_t i = 0; i < history.size(); ++i) {
    history[i].energy = 1e-5 + (i + 1 < history.size() ? std::pow(0.3, i) * 1e-6 : 0);
    history[i].gradient_max = std::pow(0.4, i);
    history[i].first_order = i < 20;
  }
  relax::write_relaxed(folder / "relax.vtkhdf",
                       {start.cell, start.unknowns(), history, weave::to_toml(scenes::plain_weave(weave)), "", "test", ""});
  const std::vector<std::filesystem::path> files = view({.results = folder, .output = folder / "pictures", .width_px = 800});
  ASSERT_THAT(names(files), Contains("curve_convergence.png"));
  EXPECT_EQ(png_size(folder / "pictures" / "curve_convergence.png")[1], 560);
  EXPECT_THAT(names(view({.results = write_folder() / "weave.vtkhdf", .output = folder / "woven", .width_px = 800})),
              ::testing::Not(Contains("curve_convergence.png")));
}

TEST_F(ViewTest, VectorFormatsAndStress) {
  write_folder();
  for (const std::string format : {"svg", "pdf"}) {
    const std::vector<std::filesystem::path> files =
        view({.results = folder / "weave.vtkhdf", .output = folder / format, .format = format, .color = "stress", .width_px = 640});
    EXPECT_THAT(names(files), Contains("side." + format));
    EXPECT_THAT(names(files), Contains("curve_energy." + format));
    for (const std::filesystem::path& file : files)
      EXPECT_THAT(first_bytes(file, 5), format == "svg" ? HasSubstr("<?xml") : HasSubstr("%PDF")) << file;
  }
}

TEST_F(ViewTest, AskedSectionsReplaceTheDefaultOnes) {
  write_folder();
  const std::vector<std::filesystem::path> files =
      view({.results = folder / "cell.vtkhdf", .output = folder, .sections_x = {-1e-4}, .sections_y = {1e-3}, .width_px = 480});
  EXPECT_THAT(names(files), ElementsAre("side.png", "top.png", "section_x_-0.100mm.png", "section_y_1.000mm.png"));
}

TEST_F(ViewTest, WrongOptionsAreNamed) {
  const auto message = [&](const ViewOptions& options, const std::string& text) {
    EXPECT_THAT([&] { view(options); }, ThrowsMessage<std::runtime_error>(HasSubstr(text)));
  };
  message({.results = folder, .output = folder, .format = "bmp"}, "format = bmp: must be");
  message({.results = folder, .output = folder, .color = "red"}, "color = red: must be");
  message({.results = folder, .output = folder, .width_px = 10}, "width = 10: must be");
  message({.results = folder, .output = folder}, "weave.vtkhdf: no such file");
}

weave::Case six_layers() {
  weave::Case spec;
  spec.name = "six_layers";
  spec.layers = 6;
  spec.columns = 2;
  weave::PositionMatrix a(5, 2), b(5, 2);
  a << 6, 4, 5, 3, 4, 2, 3, 1, 2, 0;
  b << 4, 6, 3, 5, 2, 4, 1, 3, 0, 2;
  spec.sections = {{"glass_125", 0, 3, weave::weaving_matrix_from_positions(a, 6)},
                   {"glass_125", 1, 3, weave::weaving_matrix_from_positions(b, 6)}};
  return spec;
}

TEST_F(ViewTest, DraftOfSixLayers) {
  for (const std::string format : {"png", "svg", "pdf"}) {
    draw_draft(six_layers(), folder / ("draft." + format));
    EXPECT_GT(std::filesystem::file_size(folder / ("draft." + format)), 1000U);
  }
  EXPECT_GT(png_size(folder / "draft.png")[1], 800);
}

TEST_F(ViewTest, DraftOfAMatrixWithoutPositions) {
  weave::Case spec = six_layers();
  spec.sections[1].matrix(0, 0) = 1;
  spec.sections[1].matrix(1, 0) = -1;
  EXPECT_NO_THROW(draw_draft(spec, folder / "draft.png"));
}

TEST(Plot, TicksAreRoundNumbers) {
  EXPECT_THAT(ticks(0, 1, 5), ElementsAre(0, ::testing::DoubleEq(0.2), ::testing::DoubleEq(0.4), ::testing::DoubleNear(0.6, 1e-15),
                                          ::testing::DoubleEq(0.8), ::testing::DoubleEq(1)));
  EXPECT_THAT(ticks(-3, 7, 3), ElementsAre(0, 5));
  EXPECT_TRUE(ticks(1, 1 + 1e-15, 5).empty());
  EXPECT_EQ(tick_label(-0.25, 0.05), "\u22120.25");
  EXPECT_EQ(tick_label(1200, 200), "1200");
}

TEST(Plot, UnitsReadWell) {
  EXPECT_EQ(readable_unit(0.02, "J").name, "mJ");
  EXPECT_EQ(readable_unit(0.02, "J").factor, 1e3);
  EXPECT_EQ(readable_unit(40, "N").name, "N");
  EXPECT_EQ(readable_unit(0, "s").name, "s");
  EXPECT_EQ(readable_unit(1.4e8, "Pa").name, "MPa");
  EXPECT_EQ(readable_unit(2e9, "Pa").factor, 1e-9);
}

}  // namespace
}  // namespace heddle
