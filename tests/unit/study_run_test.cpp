#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <thread>

#include "heddle/base64.hpp"
#include "heddle/study.hpp"
#include "heddle/study_command.hpp"
#include "heddle/study_local.hpp"
#include "heddle/study_record.hpp"
#include "heddle/study_report.hpp"
#include "heddle/study_slurm.hpp"
#include "scenes/own_folder.hpp"
#include "unit/synthetic_cloth.hpp"
#include "weave/results.hpp"
#include "weave/version.hpp"

namespace heddle {
namespace {

using nlohmann::json;
using std::filesystem::path;
using testing::ElementsAre;
using testing::HasSubstr;

// Stands for `heddle run`: its reed load is ten times the tension, one more with elements of half the length. Each start leaves a line in
// calls.
const std::string fake_program = R"(#!/bin/sh
while [ $# -gt 0 ]; do
  case "$1" in
    --output) out=$2 ;;
    loom.tension=*) tension=${1#loom.tension=} ;;
    numerics.element_length=*) finer=1 ;;
  esac
  shift
done
here=$(dirname "$0")
echo "$out" >> "$here/calls"
if [ -e "$out/weave/stage.json" ]; then echo "$out" >> "$here/kept"; fi
if [ -e "$here/slow" ]; then
  trap 'touch "$out/checkpoint"; exit 130' TERM
  touch "$here/started"
  while [ ! -e "$out/checkpoint" ]; do sleep 0.05; done
fi
if [ "$tension" = 13 ]; then echo "first line"; echo "the warp broke" >&2; exit 2; fi
mkdir -p "$out/weave"
echo "{\"reed_load_max_N\": $((10 * tension + 0$finer)), \"reed_load_per_beat_N\": [1, $OMP_NUM_THREADS], \"energy_J\": {\"bars\": 0.5}}" > "$out/weave/summary.json"
echo '{"finished": true}' > "$out/weave/stage.json"
)";

class StudyRunTest : public OwnFolder {
 protected:
  void SetUp() override {
    OwnFolder::SetUp();
    write_program("program", fake_program);
    options.study_file = folder / "study.toml";
    options.output = folder / "out";
    options.program = folder / "program";
    options.quiet = true;
    options.threads = 1;
    options.jobs = 2;
  }

  void write_program(const std::string& name, const std::string& text) const {
    std::ofstream(folder / name) << text;
    std::filesystem::permissions(folder / name, std::filesystem::perms::owner_all);
  }

  void write_study(const std::string& text, const std::string& collect = "\"weave.reed_load_max_N\"") const {
    std::ofstream(folder / "study.toml") << "name = \"s\"\nquestion = \"Why?\"\ncase = \"" << HEDDLE_CASES_DIR
                                         << "/kevlar_km2_706\"\ncollect = [" << collect << "]\n"
                                         << text;
  }

  std::string read(const path& file) const {
    std::ifstream in(folder / file);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  std::size_t calls() const {
    const std::string text = read("calls");
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  json results() const { return json::parse(read("out/study.json")); }

  StudyOptions options;
};

TEST_F(StudyRunTest, CollectsFiguresWithErrors) {
  write_study("[vary]\nloom.tension = [1, 2, 4]\n[error]\nset = { numerics.element_length = 1 }\n",
              "\"weave.reed_load_max_N\", \"weave.reed_load_per_beat_N.last\", \"weave.energy_J.bars\"");
  EXPECT_EQ(study_command(options), 0);
  // Wall times, the last column, are not compared.
  EXPECT_EQ(
      std::regex_replace(read("out/study.csv"), std::regex(",[0-9.]+\n"), "\n"),
      "run,loom.tension,weave.reed_load_max_N,weave.reed_load_max_N.error,weave.reed_load_per_beat_N.last,weave.reed_load_per_beat_N.last."
      "error,weave.energy_J."
      "bars,"
      "weave.energy_J.bars.error,state,wall_s\n"
      "tension_1,1,10,1.0,1,0.0,0.5,0.0,finished\ntension_2,2,20,1.0,1,0.0,0.5,0.0,finished\ntension_4,4,40,1.0,1,0.0,0.5,0.0,finished\n");
  const json j = results();
  EXPECT_EQ(j["figures"][0]["lowest"], 10);
  EXPECT_EQ(j["figures"][0]["highest"], 40);
  EXPECT_EQ(j["figures"][0]["differs_by_more_than_errors"], true);
  EXPECT_EQ(j["figures"][1]["differs_by_more_than_errors"], false);
  EXPECT_EQ(j["runs"][2]["figures"]["weave.reed_load_max_N"], 40);
  EXPECT_EQ(j["runs"][2]["second"]["state"], "finished");
  EXPECT_TRUE(std::filesystem::exists(folder / "out/pictures/weave_reed_load_max_N_by_loom_tension.png"));
  const std::string page = read("out/study.html");
  EXPECT_THAT(page, HasSubstr("<td>40 \u00b1 1</td>"));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw0KGgo"));  // a PNG file's first bytes
}

TEST_F(StudyRunTest, RunsWithoutRepetitionShowTheLargestError) {
  write_study("[vary]\nloom.tension = [1, 2, 4]\n[error]\nset = { numerics.element_length = 1 }\nruns = [\"tension_2\"]\n");
  const Study study = read_study(options.study_file);
  std::vector<RunTask> tasks;
  for (const StudyRun& run : study.runs) tasks.push_back({.run = &run, .record = {}});
  ASSERT_EQ(tasks.size(), 4u);
  const std::vector<StudyRow> rows = {
      {&tasks[0], nullptr, {{0.01, {}}}}, {&tasks[1], &tasks[2], {{0.02, 0.003}}}, {&tasks[3], nullptr, {{0.04, {}}}}};
  const auto plot = study_curve(study, rows, 0, 0);
  ASSERT_TRUE(plot);
  ASSERT_EQ(plot->series.size(), 3u);
  const Series &others = plot->series[0], &points = plot->series[2];
  EXPECT_EQ(others.label, "largest error of the repeated runs");
  EXPECT_THAT(others.u, ElementsAre(1, 4));
  EXPECT_THAT(others.v, ElementsAre(10, 40));  // mN
  EXPECT_THAT(others.error, ElementsAre(testing::DoubleEq(3), testing::DoubleEq(3)));
  EXPECT_THAT(points.u, ElementsAre(1, 2, 4));
  EXPECT_THAT(points.error, ElementsAre(testing::IsNan(), testing::DoubleEq(3), testing::IsNan()));
}

TEST_F(StudyRunTest, ParametersThatChangeTogetherMakeOneCurve) {
  write_study(
      "[[run]]\nset = { loom.tension = \"1 N\", section.0.tension = \"2 N\" }\n[[run]]\nset = { loom.tension = \"3 N\", section.0.tension "
      "= "
      "\"4 N\" }\n");
  const Study study = read_study(options.study_file);
  std::vector<RunTask> tasks;
  for (const StudyRun& run : study.runs) tasks.push_back({.run = &run, .record = {}});
  const std::vector<StudyRow> rows = {{&tasks[0], nullptr, {{1, {}}}}, {&tasks[1], nullptr, {{2, {}}}}};
  const auto plot = study_curve(study, rows, 0, 0);
  ASSERT_TRUE(plot);
  ASSERT_EQ(plot->series.size(), 2u);  // a line and its points
  EXPECT_THAT(plot->series[0].u, ElementsAre(1, 3));
  EXPECT_EQ(plot->series[0].label, "");
  EXPECT_FALSE(study_curve(study, rows, 0, 1));
}

TEST_F(StudyRunTest, FinishedRunsAreKeptUnlessTheirCaseChanges) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 2u);
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 2u);
  write_study("[vary]\nloom.tension = [1, 2, 3]\n");
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 3u);
  write_study("[set]\nfabric.cells = 2\n[vary]\nloom.tension = [1, 2, 3]\n");
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 6u);
  EXPECT_EQ(results()["runs"].size(), 3u);
}

TEST_F(StudyRunTest, FailedRunStopsNoOther) {
  write_study("[vary]\nloom.tension = [13, 2]\n");
  EXPECT_EQ(study_command(options), 1);
  const json failed = results()["runs"][0], finished = results()["runs"][1];
  EXPECT_EQ(failed["state"], "failed");
  EXPECT_EQ(failed["message"], "first line\nthe warp broke\n(exit status 2)");
  EXPECT_TRUE(failed["figures"]["weave.reed_load_max_N"].is_null());
  EXPECT_EQ(finished["figures"]["weave.reed_load_max_N"], 20);
  EXPECT_THAT(read("out/study.html"), HasSubstr("the warp broke"));
  EXPECT_EQ(study_command(options), 1);
  EXPECT_EQ(calls(), 2u);
  options.retry = true;
  EXPECT_EQ(study_command(options), 1);
  EXPECT_EQ(calls(), 3u);
}

TEST_F(StudyRunTest, EndOfARunSaysHowFarTheStudyIs) {
  write_study("[vary]\nloom.tension = [13, 1, 2]\n");
  options.quiet = false;
  options.jobs = 1;
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_EQ(study_command(options), 1);
  testing::internal::GetCapturedStdout();
  const std::string told = testing::internal::GetCapturedStderr();  // no terminal
  EXPECT_THAT(told, testing::ContainsRegex("tension_13 failed after 0:0[0-9]; 1 of 3 done, about 0:0[0-9] left:\nfirst line\n"));
  EXPECT_THAT(told, testing::ContainsRegex("tension_1 finished after 0:0[0-9]; 2 of 3 done, about 0:0[0-9] left\n"));
  EXPECT_THAT(told, testing::ContainsRegex("tension_2 finished after 0:0[0-9]; 3 of 3 done\n"));
  EXPECT_THAT(told, HasSubstr("--retry repeats the runs that failed\n"));
}

TEST_F(StudyRunTest, RunThatFindsTheDiskFullIsRepeatedByRetry) {
  std::string program = fake_program;
  const std::string before_results = "mkdir -p \"$out/weave\"\n";
  // The limit lets a write fail in one run, and ends the other by its signal.
  program.insert(program.find(before_results), R"(if [ -e "$here/full" ]; then
  ulimit -f 16
  mkdir -p "$out/weave"
  [ "$tension" = 2 ] || trap '' XFSZ
  exec dd if=/dev/zero of="$out/weave/results" bs=65536 count=1
fi
)");
  write_program("program", program);
  write_study("[vary]\nloom.tension = [1, 2]\n");
  std::ofstream(folder / "full") << "";
  EXPECT_EQ(study_command(options), 1);
  const json full = results();
  for (const json& run : full["runs"]) {
    EXPECT_EQ(run["state"], "failed");
    EXPECT_THAT(run["message"].get<std::string>(), HasSubstr("is full: make room, and --retry repeats the run."));
  }
  std::filesystem::remove(folder / "full");
  options.retry = true;
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 4u);
}

TEST_F(StudyRunTest, SignalStopsRunsWhichGoOnLater) {
  write_study("[vary]\nloom.tension = [1, 2, 3]\n");
  std::ofstream(folder / "slow") << "";
  std::thread stopper([&] {
    // Two processes run; the signal comes when both had time to set their traps.
    while (calls() < 2 || !std::filesystem::exists(folder / "started")) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    std::raise(SIGTERM);
  });
  EXPECT_EQ(study_command(options), 130);
  stopper.join();
  EXPECT_EQ(calls(), 2u);
  json runs = results()["runs"];
  EXPECT_EQ(runs[0]["state"], "interrupted");
  EXPECT_EQ(runs[1]["state"], "interrupted");
  EXPECT_EQ(runs[2]["state"], "waiting");
  EXPECT_TRUE(std::filesystem::exists(folder / "out/runs/tension_1/checkpoint"));

  std::filesystem::remove(folder / "slow");
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 5u);
  runs = results()["runs"];
  EXPECT_EQ(runs[0]["attempts"], 2);
  EXPECT_EQ(runs[2]["attempts"], 1);
}

TEST_F(StudyRunTest, RunLeftByAKilledStudyIsRunAgain) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  const Study study = read_study(options.study_file);
  write_record(study, study.runs[0], options.output, {.state = RunState::running, .attempts = 1});
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(results()["runs"][0]["attempts"], 2);
}

TEST_F(StudyRunTest, OnlyRunsOneAndWritesNoTables) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  options.only = "tension_2";
  EXPECT_EQ(study_command(options), 0);
  EXPECT_THAT(read("calls"), HasSubstr("out/runs/tension_2\n"));
  EXPECT_EQ(calls(), 1u);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/study.json"));
  options.only = "tension_3";
  EXPECT_THROW(study_command(options), std::invalid_argument);
}

TEST_F(StudyRunTest, SameClothIsWovenOnce) {
  write_study("until = \"relax\"\n[vary]\nrelax.fibers = [7, 19, 37]\n");
  options.jobs = 3;
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(calls(), 3u);
  // The others, which run at the same time, find the cloth of the first in their folders.
  std::istringstream kept(read("kept"));
  EXPECT_THAT(std::vector<std::string>(std::istream_iterator<std::string>(kept), {}),
              testing::UnorderedElementsAre((options.output / "runs/fibers_19").string(), (options.output / "runs/fibers_37").string()));
}

TEST_F(StudyRunTest, ClothOfAnotherStudyIsTakenOver) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  const Study study = read_study(options.study_file);
  const path other = folder / "other/runs";
  const auto weave_in = [&](const std::string& run, const StudyRun& woven, const std::string& version, bool finished) {
    std::filesystem::create_directories(other / run / "weave");
    std::ofstream(other / run / "weave/stage.json")
        << json{{"inputs", {{"version", version}, {"case", weave::to_toml(woven.spec)}}}, {"finished", finished}};
  };
  weave_in("of_another_version", study.runs[0], "0.0.1", true);
  weave_in("not_finished", study.runs[0], weave::version(), false);
  weave_in("same", study.runs[1], weave::version(), true);
  options.reuse = {folder / "other"};
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(read("kept"), (options.output / "runs/tension_2").string() + "\n");

  options.reuse = {folder / "none"};
  EXPECT_THROW(study_command(options), std::invalid_argument);
}

TEST_F(StudyRunTest, AnotherStudysFolderIsRefused) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  std::filesystem::create_directories(options.output);
  std::ofstream(options.output / "study.json") << "{\"study\": \"other\"}";
  EXPECT_THAT([&] { study_command(options); }, testing::ThrowsMessage<std::runtime_error>(HasSubstr("holds the study other")));
  EXPECT_EQ(calls(), 0u);
}

TEST_F(StudyRunTest, CellInWhichAWarpBeginsIsDrawnToo) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  EXPECT_EQ(study_command(options), 0);
  weave::Snapshot cell = weave::make_synthetic_cloth({});
  cell.cell_length *= 2;
  cell.x_min *= 2;
  weave::write_results(options.output / "runs/tension_1/weave/cell.vtkhdf",
                       {.snapshot = cell, .history = {}, .case_toml = "", .version = ""});
  EXPECT_EQ(study_command(options), 0);
  EXPECT_TRUE(std::filesystem::exists(options.output / "pictures/weave_top.png"));
}

TEST_F(StudyRunTest, CellsAreDrawnSideBySide) {
  write_study("[vary]\nloom.tension = [1, 2]\n");
  EXPECT_EQ(study_command(options), 0);
  for (const auto& [run, pitch] : {std::pair("tension_1", 0.75e-3), std::pair("tension_2", 0.6e-3)})
    weave::write_results(options.output / "runs" / run / "weave/cell.vtkhdf",
                         {.snapshot = weave::make_synthetic_cloth({.pitch = pitch}), .history = {}, .case_toml = "", .version = ""});
  EXPECT_EQ(study_command(options), 0);
  EXPECT_TRUE(std::filesystem::exists(options.output / "pictures/weave_section_x.png"));
  EXPECT_TRUE(std::filesystem::exists(options.output / "pictures/weave_section_y.png"));
  EXPECT_TRUE(std::filesystem::exists(options.output / "pictures/weave_top.png"));
}

TEST(StudyLog, LastLinesAreOfTheLastAttempt) {
  const path log = scenes::temporary("study_log");
  std::ofstream(log) << attempt_heading(1, "program run") << "old\n" << attempt_heading(2, "program run") << "a\n\nb\nprogress\rc\n";
  EXPECT_EQ(last_lines(log, 2), "b\nc");
  EXPECT_EQ(last_lines(log, 9), "a\nb\nc");
  std::filesystem::remove(log);
}

TEST(StudyStatus, SignalsInterruptAndCrashesFail) {
  EXPECT_EQ(state_of_status(0), RunState::finished);
  EXPECT_EQ(state_of_status(130), RunState::interrupted);
  EXPECT_EQ(state_of_status(128 + SIGKILL), RunState::interrupted);
  EXPECT_EQ(state_of_status(128 + SIGSEGV), RunState::failed);
  EXPECT_EQ(state_of_status(1), RunState::failed);
}

TEST(Base64, FollowsRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
}

// ------------------------------------------------------------------------------------------------------------------------ Slurm, imitated

/// sbatch loses the first array's last task; each other task gets the record that lies ready for it.
class StudySlurmTest : public StudyRunTest {
 protected:
  void SetUp() override {
    StudyRunTest::SetUp();
    write_program("sbatch", R"(#!/bin/bash
here=$(dirname "$0")
echo "$2" >> "$here/submitted"
n=$(wc -l < "$here/submitted")
sed -n 's/^runs=(\(.*\))$/\1/p' "$2" | tr -d "'" | tr ' ' '\n' > "$here/names"
[ "$n" -gt 1 ] || sed -i '$d' "$here/names"
while read -r name; do
  mkdir -p "$here/out/runs/$name"
  cp "$here/ready/$name.json" "$here/out/runs/$name/run.json"
done < "$here/names"
echo "sbatch: info: this site speaks 1 word too many" >&2
echo "$((40 + n));cluster"
)");
    write_program("squeue", "#!/bin/sh\necho 'slurm_load_jobs error: Invalid job id specified' >&2\nexit 1\n");
    search_path = std::getenv("PATH");
    setenv("PATH", (folder.string() + ":/usr/bin:/bin").c_str(), 1);
    write_study("[vary]\nloom.tension = [1, 2, 3]\n");
    study = read_study(options.study_file);
    options.engine = "slurm";
    options.poll = 0.01;
    options.jobs = 2;
    options.sbatch = {"--partition=long"};
    std::filesystem::create_directories(folder / "ready");
    for (const StudyRun& run : study.runs) {
      write_record(study, run, folder / "made", {.state = RunState::finished, .wall = 60, .attempts = 1});
      std::filesystem::copy(folder / "made/runs" / run.name / "run.json", folder / "ready" / (run.name + ".json"));
    }
  }
  void TearDown() override {
    setenv("PATH", search_path.c_str(), 1);
    StudyRunTest::TearDown();
  }

  std::string search_path;
  Study study;
};

TEST_F(StudySlurmTest, LostTasksAreSubmittedAgain) {
  EXPECT_EQ(study_command(options), 0);
  EXPECT_EQ(results()["runs"][0]["state"], "finished");
  const json jobs = json::parse(read("out/slurm/jobs.json"));
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0]["job"], "41");
  EXPECT_EQ(jobs[0]["runs"].size(), 3u);
  EXPECT_THAT(jobs[1]["runs"], ElementsAre(jobs[0]["runs"][2]));
  const std::string script = read("out/slurm/array_0.sh");
  for (const std::string line :
       {"#SBATCH --array=0-2%2\n", "#SBATCH --requeue\n", "#SBATCH --signal=B:TERM@120\n", "#SBATCH --partition=long\n",
        "runs=('tension_1' 'tension_2' 'tension_3')\n", "--only \"${runs[$SLURM_ARRAY_TASK_ID]}\" --jobs 1 --threads 1 --quiet"})
    EXPECT_THAT(script, HasSubstr(line));
}

/// What runs the task reads its record from the disk, and runs nothing that has failed there.
TEST_F(StudySlurmTest, RetriedRunsWaitOnTheDiskToo) {
  const StudyRun& first = study.runs.front();
  write_record(study, first, options.output, {.state = RunState::failed, .message = "the shed is too low", .wall = 5, .attempts = 1});
  write_program("sbatch", "#!/bin/sh\ncp \"$(dirname \"$0\")/out/runs/tension_1/run.json\" \"$(dirname \"$0\")/as_submitted\"\nexit 1\n");
  options.retry = true;
  EXPECT_THROW(study_command(options), std::runtime_error);
  EXPECT_THAT(read("as_submitted"), HasSubstr("waiting"));
}

TEST_F(StudySlurmTest, RefusalIsReported) {
  write_program("sbatch", "#!/bin/sh\necho 'sbatch: error: invalid partition specified: long' >&2\nexit 1\n");
  EXPECT_THAT([&] { study_command(options); }, testing::ThrowsMessage<std::runtime_error>(HasSubstr("invalid partition specified")));
}

TEST_F(StudySlurmTest, MissingSlurmIsToldBeforeAnythingStarts) {
  std::filesystem::remove(folder / "squeue");
  setenv("PATH", folder.c_str(), 1);
  EXPECT_THAT([&] { study_command(options); }, testing::ThrowsMessage<std::runtime_error>(HasSubstr("there is no squeue on this machine")));
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

}  // namespace
}  // namespace heddle
