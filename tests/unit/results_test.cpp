#include "weave/results.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hdf5_file.hpp"
#include "scenes/own_folder.hpp"
#include "unit/synthetic_cloth.hpp"
#include "weave/checkpoint.hpp"

namespace weave {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class ResultsTest : public OwnFolder {};

void expect_equal(const Snapshot& a, const Snapshot& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.pick, b.pick);
  EXPECT_EQ(a.cell_width, b.cell_width);
  EXPECT_EQ(a.cell_length, b.cell_length);
  EXPECT_EQ(a.x_min, b.x_min);
  EXPECT_EQ(a.x_max, b.x_max);
  EXPECT_EQ(a.along_axis, b.along_axis);
  EXPECT_EQ(a.offset, b.offset);
  EXPECT_EQ(a.yarn, b.yarn);
  EXPECT_EQ(a.fiber, b.fiber);
  EXPECT_EQ(a.weft, b.weft);
  EXPECT_EQ(a.radius, b.radius);
  EXPECT_EQ(a.area, b.area);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.tension, b.tension);
  EXPECT_EQ(a.arc, b.arc);
  EXPECT_EQ(a.beyond.length, b.beyond.length);
  EXPECT_EQ(a.beyond.offset, b.beyond.offset);
  EXPECT_EQ(a.beyond.x, b.beyond.x);
  EXPECT_EQ(a.beyond.tension, b.beyond.tension);
  EXPECT_EQ(a.beyond.arc, b.beyond.arc);
}

TEST_F(ResultsTest, SnapshotAndHistorySurviveARoundTrip) {
  ResultsFile written;
  // Long enough for the compressed layout.
  written.snapshot = make_synthetic_cloth({.warps = 8, .columns = 8, .cells = 6, .elements_per_pitch = 30});
  ASSERT_GT(written.snapshot.x.size(), 32768U);
  written.snapshot.tension[5] = std::numeric_limits<double>::denorm_min();
  written.snapshot.along_axis = true;
  written.snapshot.beyond = {0.5e-3, std::vector<std::int64_t>(written.snapshot.fibers() + 1, 2), {{1, 2, 3}, {4, 5, 6}}, {7, 8}, {0, 9}};
  written.snapshot.beyond.offset.front() = 0;
  written.history = make_synthetic_history(3);
  written.case_toml = "name = \"synthetic\"\n";
  written.version = "0.1.0 (µ)";
  write_results(folder / "weave.vtkhdf", written);
  EXPECT_FALSE(std::filesystem::exists(folder / "weave.vtkhdf.part"));

  const ResultsFile read = read_results(folder / "weave.vtkhdf");
  expect_equal(read.snapshot, written.snapshot);
  EXPECT_EQ(read.case_toml, written.case_toml);
  EXPECT_EQ(read.version, written.version);
  const History &a = read.history, &b = written.history;
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.pick, b.pick);
  EXPECT_EQ(a.action, b.action);
  EXPECT_EQ(a.reed_x_m, b.reed_x_m);
  EXPECT_EQ(a.reed_load_N, b.reed_load_N);
  EXPECT_EQ(a.warp_tension_N, b.warp_tension_N);
  EXPECT_EQ(a.overlap, b.overlap);
  EXPECT_EQ(a.time_step_s, b.time_step_s);
  EXPECT_EQ(a.kinetic_J, b.kinetic_J);
  EXPECT_EQ(a.bars_J, b.bars_J);
  EXPECT_EQ(a.contact_J, b.contact_J);
  EXPECT_EQ(a.friction_store_J, b.friction_store_J);
  EXPECT_EQ(a.heddle_J, b.heddle_J);
  EXPECT_EQ(a.slip_J, b.slip_J);
  EXPECT_EQ(a.damping_J, b.damping_J);
  EXPECT_EQ(a.work_tension_J, b.work_tension_J);
  EXPECT_EQ(a.work_reed_J, b.work_reed_J);
  EXPECT_EQ(a.work_heddle_J, b.work_heddle_J);
  EXPECT_EQ(a.work_take_up_J, b.work_take_up_J);
  EXPECT_EQ(a.work_insertion_J, b.work_insertion_J);
  EXPECT_EQ(a.residual_J, b.residual_J);
  EXPECT_EQ(a.reed_load_per_beat_N, b.reed_load_per_beat_N);
  EXPECT_EQ(a.beat_time_s, b.beat_time_s);
}

TEST_F(ResultsTest, FileWithoutFibersOrHistory) {
  ResultsFile written;
  written.snapshot.offset = {0};
  write_results(folder / "empty.vtkhdf", written);
  const ResultsFile read = read_results(folder / "empty.vtkhdf");
  EXPECT_EQ(read.snapshot.fibers(), 0U);
  EXPECT_TRUE(read.history.time_s.empty());
  EXPECT_EQ(read.case_toml, "");
}

TEST_F(ResultsTest, FailedWriteLeavesTheOldFile) {
  ResultsFile results;
  results.snapshot = make_synthetic_cloth({});
  write_results(folder / "weave.vtkhdf", results);
  ResultsFile broken = results;
  broken.snapshot.arc.pop_back();
  EXPECT_THAT([&] { write_results(folder / "weave.vtkhdf", broken); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("weave.vtkhdf"), HasSubstr("arc has"))));
  expect_equal(read_results(folder / "weave.vtkhdf").snapshot, results.snapshot);
}

TEST_F(ResultsTest, ErrorsNameFileAndCause) {
  EXPECT_THAT([&] { read_results(folder / "missing.vtkhdf"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("missing.vtkhdf"), HasSubstr("no such file"))));
  write_text_file(folder / "text.vtkhdf", "no HDF5\n");
  EXPECT_THAT([&] { read_results(folder / "text.vtkhdf"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("text.vtkhdf"), HasSubstr("cannot open as an HDF5 file"))));
  Hdf5File other = Hdf5File::create(folder / "other.vtkhdf");
  other.commit();
  EXPECT_THAT([&] { read_results(folder / "other.vtkhdf"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("other.vtkhdf"), HasSubstr("not a results file"))));
  ResultsFile results;
  results.snapshot.offset = {0};
  EXPECT_THAT([&] { write_results(folder / "none" / "weave.vtkhdf", results); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("weave.vtkhdf"), HasSubstr("cannot create"))));
}

TEST_F(ResultsTest, FullDiskIsTheCauseTold) {
  // In a process of its own, which the limit ends with; it goes through all that is done at exit.
  const auto write_within_limit = [&](auto&& write) {
    const rlimit limit = {4096, 4096};
    setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);
    try {
      write();
    } catch (const std::runtime_error& error) {
      std::fputs(error.what(), stderr);
      std::exit(3);
    }
    std::exit(0);
  };
  const weave::Snapshot cloth = weave::make_synthetic_cloth({});
  EXPECT_EXIT(write_within_limit([&] {
                weave::write_results(folder / "a.vtkhdf", {cloth, {}, "", ""});
              }),
              testing::ExitedWithCode(3), "a.vtkhdf: .*File too large");
  EXPECT_EXIT(write_within_limit([&] { write_text_file(folder / "a.json", std::string(100000, 'x')); }), testing::ExitedWithCode(3),
              "a.json: cannot write .*File too large");
}

TEST_F(ResultsTest, SeriesIsWhatParaViewReads) {
  write_series(folder / "picks.vtkhdf.series", {"picks/pick_0001.vtkhdf", "picks/pick_0002.vtkhdf"}, {0.1, 0.25});
  std::ifstream in(folder / "picks.vtkhdf.series");
  const nlohmann::json series = nlohmann::json::parse(in);
  EXPECT_EQ(series.at("file-series-version"), "1.0");
  EXPECT_EQ(series.at("files").size(), 2U);
  EXPECT_EQ(series.at("files")[1].at("name"), "picks/pick_0002.vtkhdf");
  EXPECT_EQ(series.at("files")[1].at("time"), 0.25);
  EXPECT_THROW(write_series(folder / "picks.vtkhdf.series", {"a"}, {}), std::runtime_error);
}

TEST_F(ResultsTest, TextFile) {
  write_text_file(folder / "a.txt", "first\n");
  write_text_file(folder / "a.txt", "second\n");
  std::ifstream in(folder / "a.txt");
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), "second\n");
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST_F(ResultsTest, TextThatCanNotTakeItsPlaceLeavesNothing) {
  std::filesystem::create_directory(folder / "a.txt");
  EXPECT_THROW(write_text_file(folder / "a.txt", "text\n"), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.txt.part"));
}

TEST_F(ResultsTest, Hdf5ArraysOfEveryType) {
  {
    Hdf5File out = Hdf5File::create(folder / "arrays.h5");
    const std::vector<double> table = {1, 2, 3, 4, 5, 6};
    out.write_rows("/deep/er/table", std::span<const double>(table), 3);
    out.write<std::int32_t>("/deep/i32", {-1, 2});
    out.write<std::int64_t>("/deep/i64", {-(std::int64_t{1} << 40)});
    out.write<std::uint8_t>("/deep/u8", {255});
    out.write<std::uint32_t>("/deep/u32", {4000000000U});
    out.write_text("/text", "länge\nlines");
    out.write_attribute("/deep", "Type", "fixed");
    out.commit();
  }
  const Hdf5File in = Hdf5File::open(folder / "arrays.h5");
  const Hdf5Array<double> table = in.read_rows<double>("/deep/er/table");
  EXPECT_EQ(table.rows, 2U);
  EXPECT_EQ(table.columns, 3U);
  EXPECT_EQ(table.values, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(in.read<std::int32_t>("/deep/i32"), (std::vector<std::int32_t>{-1, 2}));
  EXPECT_EQ(in.read<std::int64_t>("/deep/i64").front(), -(std::int64_t{1} << 40));
  EXPECT_EQ(in.read<std::uint8_t>("/deep/u8").front(), 255);
  EXPECT_EQ(in.read<std::uint32_t>("/deep/u32").front(), 4000000000U);
  EXPECT_EQ(in.read_text("/text"), "länge\nlines");
  EXPECT_EQ(in.read_text_attribute("/deep", "Type"), "fixed");
  EXPECT_TRUE(in.has("/deep/er/table"));
  EXPECT_FALSE(in.has("/deep/none/table"));
  EXPECT_FALSE(in.has_attribute("/deep", "type"));
  EXPECT_THAT([&] { (void)in.read<double>("/deep/i32"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("arrays.h5: /deep/i32"), HasSubstr("is not of type double"))));
  EXPECT_THAT([&] { (void)in.read<double>("/deep/er/table"); }, ThrowsMessage<std::runtime_error>(HasSubstr("has 3 columns")));
  EXPECT_THAT([&] { (void)in.read<double>("/none"); }, ThrowsMessage<std::runtime_error>(HasSubstr("/none: no such data set")));
}

TEST_F(ResultsTest, CheckpointOfAnotherVersionIsRefused) {
  Hdf5File out = Hdf5File::create(folder / "checkpoint.h5");
  out.write_text("/case", "name = \"old\"\n");
  out.commit();
  EXPECT_THAT([&] { (void)read_checkpoint(folder / "checkpoint.h5"); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("checkpoint.h5"), HasSubstr("format 1"), HasSubstr("reads format 5"))));
}

TEST_F(ResultsTest, UncommittedFileLeavesNothing) {
  {
    Hdf5File out = Hdf5File::create(folder / "a.h5");
    out.write<double>("/a", {1});
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

}  // namespace
}  // namespace weave
