#include "heddle/study.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>

#include "heddle/study_command.hpp"
#include "scenes/own_folder.hpp"

namespace heddle {
namespace {

using std::filesystem::path;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;

const path kevlar = path(HEDDLE_CASES_DIR) / "kevlar_km2_706";

class StudyTest : public OwnFolder {
 protected:
  /// A study of the Kevlar weave; the text starts at line 5.
  path write(const std::string& text, const std::string& collect = "\"weave.reed_load_max_N\"") const {
    std::ofstream(folder / "study.toml") << "name = \"s\"\nquestion = \"Why?\"\ncase = \"" << kevlar.string() << "\"\ncollect = ["
                                         << collect << "]\n"
                                         << text;
    return folder / "study.toml";
  }

  std::string error_of(const std::string& text, const std::string& collect = "\"weave.reed_load_max_N\"") const {
    try {
      read_study(write(text, collect));
    } catch (const weave::CaseError& error) {
      return error.what();
    }
    return "no error";
  }
};

std::vector<std::string> names(const Study& study) {
  std::vector<std::string> names;
  for (const StudyRun& run : study.runs) names.push_back(run.name);
  return names;
}

TEST_F(StudyTest, GridTakesAllCombinations) {
  const Study study =
      read_study(write("[set]\nfabric.cells = 2\n[vary]\nloom.tension = [\"3 N\", \"10 N\"]\nfabric.friction = [0.2, 0.3]\n"));
  EXPECT_THAT(names(study),
              ElementsAre("tension_3N_friction_0.2", "tension_3N_friction_0.3", "tension_10N_friction_0.2", "tension_10N_friction_0.3"));
  EXPECT_THAT(study.parameters, ElementsAre("loom.tension", "fabric.friction"));
  EXPECT_THAT(study.runs[1].parameters, ElementsAre("3 N", "0.3"));
  EXPECT_EQ(study.runs[2].spec.loom.tension, 10);
  EXPECT_EQ(study.runs[2].spec.friction, 0.2);
  EXPECT_EQ(study.runs[2].spec.cells, 2);
  EXPECT_EQ(study.until, "weave");
  EXPECT_EQ(study.title, "s");
}

TEST_F(StudyTest, ListedRunsStandBesideTheGrid) {
  const Study study = read_study(write(
      "[vary]\nloom.tension = [\"4 N\"]\n[[run]]\nname = \"base\"\n[[run]]\nset = { fabric.friction = 0.4, take_up.time = \"2 ms\" }\n"));
  EXPECT_THAT(names(study), ElementsAre("tension_4N", "base", "friction_0.4_time_2ms"));
  EXPECT_THAT(study.runs[1].parameters, ElementsAre("", "", ""));
  EXPECT_EQ(study.runs[1].spec.loom.tension, 3);
  EXPECT_EQ(study.runs[2].spec.friction, 0.4);
}

TEST_F(StudyTest, SecondDiscretizationRepeatsEachRun) {
  const Study study =
      read_study(write("[vary]\nloom.tension = [1, 2]\n[error]\nset = { numerics.element_length = 1, \"yarns.*.fibers\" = 19 }\n"));
  EXPECT_THAT(names(study), ElementsAre("tension_1", "tension_1_second", "tension_2", "tension_2_second"));
  EXPECT_EQ(study.runs[1].second_of, "tension_1");
  EXPECT_EQ(study.runs[1].spec.numerics.element_length, 1);
  EXPECT_EQ(study.runs[1].spec.yarns.at("km2_600").fibers, 19);
  EXPECT_EQ(study.runs[0].spec.yarns.at("km2_600").fibers, 7);
}

TEST_F(StudyTest, SecondDiscretizationMayRepeatSomeRuns) {
  const std::string text = "[vary]\nloom.tension = [1, 2]\n[error]\nset = { numerics.element_length = 1 }\nruns = ";
  EXPECT_THAT(names(read_study(write(text + "[\"tension_2\"]\n"))), ElementsAre("tension_1", "tension_2", "tension_2_second"));
  EXPECT_THAT(error_of(text + "[\"tension_3\"]\n"),
              HasSubstr("error.runs = [ 'tension_3' ]: has \"tension_3\"; must be names of the study's runs: tension_1, tension_2"));
}

TEST_F(StudyTest, CasesMayVaryAndUntilFollowsTheFigures) {
  const std::string glass = (path(HEDDLE_CASES_DIR) / "eglass_7628").string();
  const Study study = read_study(
      write("[vary]\ncase = [\"" + glass + "\", \"" + kevlar.string() +
                "/case.toml\"]\nrelax.fibers = [19, 37]\n[set]\nrelax.unconverged = true\nrelax.pressure = 20000\nrelax.load_x = 1.5\n",
            "\"relax.thickness_m\""));
  EXPECT_THAT(names(study),
              ElementsAre("eglass_7628_fibers_19", "eglass_7628_fibers_37", "kevlar_km2_706_fibers_19", "kevlar_km2_706_fibers_37"));
  EXPECT_EQ(study.until, "relax");
  EXPECT_EQ(study.runs[0].spec.name, "eglass_7628");
  const std::vector<std::string> arguments = run_arguments(study, study.runs[1], "out");
  EXPECT_THAT(arguments, ElementsAre("run", glass, "--output", "out", "--until", "relax", "--quiet", "--unconverged", "--pressure", "20000",
                                     "--load-x", "1.5", "--fibers", "37"));
}

TEST_F(StudyTest, ArgumentsSetTheCaseAsTheStudyReadIt) {
  const Study study =
      read_study(write("[[run]]\nset = { loom.tension = \"3.5 N\", section.0.matrix = [\"-\", \"+\"], section.1.matrix = [\"+\", \"-\"], "
                       "fabric.friction = 0.1 }\n"));
  const std::vector<std::string> arguments = run_arguments(study, study.runs[0], "out");
  std::vector<std::string> overrides;
  for (std::size_t i = 1; i < arguments.size(); ++i) {
    if (arguments[i - 1] == "--set") overrides.push_back(arguments[i]);
  }
  EXPECT_EQ(weave::to_toml(weave::load_case(arguments[1], overrides)), weave::to_toml(study.runs[0].spec));
  EXPECT_THAT(overrides, Contains("fabric.friction=0.1"));
}

TEST_F(StudyTest, MistakesAreNamedWithFileLineKeyValueAndBound) {
  const std::string vary = "[vary]\nloom.tension = [1, 2]\n";
  const auto expect = [&](const std::string& text, const std::string& message) {
    const std::string error = error_of(text);
    EXPECT_THAT(error, HasSubstr("study.toml:" + message)) << text;
    EXPECT_EQ(std::count(error.begin(), error.end(), '\n'), 0) << error;
  };
  expect("unitl = \"weave\"\n" + vary, "5: unitl = \"weave\": unknown key; the nearest known one is until");
  expect("until = \"spin\"\n" + vary, "5: until = \"spin\": must be one of");
  expect("", "1: vary = (missing): missing; give it, or one or more [[run]]");
  expect("[vary]\n", "5: vary = {}: is empty");
  expect("[vary]\nloom.tension = []\n", "6: vary.loom.tension = []: is empty");
  expect("[vary]\nloom.tension = 3\n", "6: vary.loom.tension = 3: expected a list of values");
  expect(vary + "[set]\nloom.tension = 3\n", "6: vary.loom.tension = 1: clashes with set.loom.tension (line 8)");
  expect("[set]\nfabric.cells = 2\n[[run]]\nset = { fabric.cells = 3 }\n",
         "8: run.0.set.fabric.cells = 3: clashes with set.fabric.cells (line 6)");
  expect(vary + "[error]\nset = { loom.tension = 3 }\n", "8: error.set.loom.tension = 3: clashes with vary.loom.tension (line 6)");
  expect(vary + "[error]\n", "7: error.set = (missing): is missing or empty");
  expect("[vary]\nloom.tension = [1, \"1 N\"]\n", "6: vary.loom.tension = \"1 N\": run tension_1N has the same values as run tension_1");
  expect("[[run]]\nname = \"a\"\n[[run]]\nname = \"a\"\nset = { loom.tension = 1 }\n", "7: run.1 = {table}: two runs are named a");
  expect("[[run]]\nname = \"../a\"\n", "6: run.0.name = \"../a\": must be of letters");
  expect("[[run]]\n", "5: run.0 = {table}: is empty");
  expect("[vary]\nloom.tensoin = [1]\n",
         "6: vary.loom.tensoin = 1: run tensoin_1: " + kevlar.string() + "/case.toml:(override): loom.tensoin = 1: unknown key");
  expect("[vary]\nloom.tension = [\"3 kg\"]\n", "6: vary.loom.tension = \"3 kg\": run tension_3kg: ");
  expect("[vary]\ncase = [\"nowhere\"]\n",
         "6: vary.case = \"nowhere\": run nowhere: " + (folder / "nowhere").string() + ": can not be read");
  expect("[set]\nrelax.fibers = 19\n" + vary, "6: set.relax.fibers = 19: is a key of the stage relax, but until = \"weave\"");
  expect("until = \"relax\"\n[set]\nrelax.fibres = 19\n" + vary, "7: set.relax.fibres = 19: unknown key");
  expect("until = \"relax\"\n[set]\nrelax.fibers = 0\n" + vary, "7: set.relax.fibers = 0: must be an integer >= 1 and <= 1000");
  expect("until = \"relax\"\n[set]\nrelax.load_y = -1\n" + vary, "7: set.relax.load_y = -1: must be a number >= 0 [N]");
  expect(vary + "[[reference]]\nkey = \"weave.thickness_m\"\nvalue = 1\nsource = \"x\"\n",
         "8: reference.0.key = \"weave.thickness_m\": must be one of the collected");
}

TEST_F(StudyTest, FiguresNeedTheirStage) {
  const std::string vary = "[vary]\nloom.tension = [1, 2]\n";
  EXPECT_THAT(
      error_of("until = \"weave\"\n" + vary, "\"relax.thickness_m\""),
      HasSubstr("study.toml:4: collect = [ 'relax.thickness_m' ]: \"relax.thickness_m\" needs the stage relax, but until = \"weave\""));
  EXPECT_THAT(error_of(vary, "\"thickness_m\""), HasSubstr("\"thickness_m\" must read STAGE.KEY"));
  EXPECT_THAT(error_of(vary, "\"weave.picks\", \"weave.picks\""), HasSubstr("\"weave.picks\" is there twice"));
  EXPECT_THAT(error_of(vary, ""), HasSubstr("study.toml:4: collect = []: expected a list of strings"));
}

TEST_F(StudyTest, MisspelledFiguresAreToldBeforeAnyRun) {
  const std::string vary = "[vary]\nloom.tension = [1, 2]\n";
  const auto expect = [&](const std::string& figure, const std::string& message) {
    EXPECT_THAT(error_of(vary, '"' + figure + '"'),
                HasSubstr("study.toml:4: collect = [ '" + figure + "' ]: \"" + figure + "\": " + message));
  };
  expect("weave.thicknes_m", "the summary has no \"thicknes_m\" in weave; the nearest keys are thickness_m, ");
  expect("relax.energy_J.bar", "the summary has no \"bar\" in relax.energy_J; the nearest keys are bars, ");
  expect("relax.energy_J",
         "relax.energy_J is a table: give one of its keys bars, bending, contact, tension, platens, loads, sum after a dot");
  expect("weave.reed_load_per_beat_N", "weave.reed_load_per_beat_N is a list: give an entry's number, or last, after a dot");
  expect("weave.reed_load_per_beat_N.lst", "weave.reed_load_per_beat_N is a list: its entries are 0, 1, ... or last, not \"lst\"");
  expect("weave.thickness_m.last", "weave.thickness_m is a figure by itself, without \".last\"");
  expect("envelope.by_yarn.0.volume_m", "the summary has no \"volume_m\" in envelope.by_yarn.0; the nearest keys are volume_m3, ");
  expect("homogenize.ex_GPa", "the summary has no \"ex_GPa\" in homogenize; the nearest keys are ex_Pa, ");
  for (const std::string right :
       {"weave.reed_load_per_beat_N.last", "weave.energy_J.bars", "weave.void_share_per_section.0", "relax.thickness_m", "relax.converged",
        "relax.lean", "relax.yarn_width_weft_m", "envelope.volume_ratio", "envelope.by_yarn.0.volume_m3", "homogenize.ex_Pa",
        "homogenize.stiffness_Pa.0.1", "homogenize.mesh_error", "homogenize.fiber.e1_Pa"})
    EXPECT_THAT(error_of(vary, '"' + right + '"'), "no error") << right;
}

TEST_F(StudyTest, EveryMistakeGetsALine) {
  const std::string error = error_of("unitl = 1\n[vary]\nloom.tension = []\n");
  EXPECT_THAT(error, HasSubstr("unitl"));
  EXPECT_THAT(error, HasSubstr("vary.loom.tension"));
}

std::string text_of(const path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(ShippedStudies, AreReadAndTellTheirQuestion) {
  const std::string index = text_of(path(HEDDLE_CASES_DIR) / "studies/README.md");
  std::set<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(path(HEDDLE_CASES_DIR) / "studies")) {
    if (!entry.is_directory()) continue;
    const Study study = read_study(entry.path());
    found.insert(study.name);
    EXPECT_EQ(study.name, entry.path().filename().string());
    EXPECT_GE(study.runs.size(), 4u) << study.name;
    EXPECT_EQ(study.question.back(), '?') << study.name;
    EXPECT_FALSE(study.second.empty()) << study.name << " has no error bars";
    const std::string text = text_of(entry.path() / "README.md");
    EXPECT_THAT(text, HasSubstr(study.question));
    EXPECT_THAT(index, HasSubstr("| [" + study.name + "](" + study.name + ") |"));
    EXPECT_THAT(index, HasSubstr(study.question));
    EXPECT_THAT(text, HasSubstr("heddle study cases/studies/" + study.name));
  }
  EXPECT_THAT(found, testing::IsSupersetOf({"reed_load_fibers", "reed_load_take_up", "reed_load_flags", "reed_load_loom_length",
                                            "reed_load_speed", "geometry_tension", "geometry_friction", "geometry_beat_up",
                                            "stress_tension", "stress_friction", "stress_speed", "minima", "plain_weaves"}));
}

TEST_F(StudyTest, ExampleOfTheIndexIsReadable) {
  const std::string index = text_of(path(HEDDLE_CASES_DIR) / "studies/README.md"), fence = "```toml\n";
  const auto from = index.find(fence) + fence.size();
  std::string text = index.substr(from, index.find("```", from) - from);
  const std::string shipped = "../../kevlar_km2_706";
  text.replace(text.find(shipped), shipped.size(), kevlar.string());
  std::ofstream(folder / "study.toml") << text;
  const Study study = read_study(folder);
  EXPECT_EQ(study.runs.size(), 6u);
  EXPECT_EQ(study.runs.back().name, "slow_second");
  EXPECT_EQ(study.references.size(), 1u);
}

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, '|');) {
    const auto first = cell.find_first_not_of(" `"), last = cell.find_last_not_of(" `");
    cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
  }
  return cells;
}

/// Words of a resolved case, numbers to four digits.
std::vector<std::string> words_of(const weave::Case& c) {
  std::vector<std::string> words;
  std::istringstream in(weave::to_toml(c));
  for (std::string word; in >> word;) {
    double number = 0;
    const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), number);
    words.push_back(status == std::errc() && end == word.data() + word.size() ? fmt::format("{:.4g}", number) : word);
  }
  return words;
}

TEST(ShippedStudies, IndexTellsTheInputsOfTheCases) {
  std::istringstream index(text_of(path(HEDDLE_CASES_DIR) / "studies/README.md"));
  std::vector<std::string> heading;
  int values = 0;
  for (std::string line; std::getline(index, line);) {
    const std::vector<std::string> cells = cells_of(line);
    if (cells.size() > 2 && cells[1] == "input") heading = cells;
    if (heading.empty() || cells.size() != heading.size() || cells[2].find('.') == std::string::npos) continue;
    for (std::size_t i = 3; i + 1 < cells.size(); ++i) {
      if (cells[i] == "-") continue;
      const path file = path(HEDDLE_CASES_DIR) / heading[i];
      const weave::Case spec = weave::load_case(file);
      std::vector<std::string> keys;
      if (cells[2].starts_with("yarns.*.")) {
        for (const auto& [name, yarn] : spec.yarns) keys.push_back("yarns." + name + cells[2].substr(7));
      } else {
        keys.push_back(cells[2]);
      }
      for (const std::string& key : keys) {
        const bool is_number = cells[i].find(' ') == std::string::npos;
        const std::string value = is_number ? cells[i] : '"' + cells[i] + '"';
        EXPECT_EQ(words_of(weave::load_case(file, {key + "=" + value})), words_of(spec)) << heading[i] << ": " << key << " = " << value;
        ++values;
      }
    }
  }
  EXPECT_GT(values, 30);
}

TEST(ShareMachine, ProcessesComeFirstAndFitIntoMemory) {
  const std::vector<double> memory = {4e9, 3e9, 2e9, 1e9};
  const auto shares = [&](int jobs, int threads, int cores, double available) {
    const Shares s = share_machine(jobs, threads, cores, memory, available);
    return std::pair(s.jobs, s.threads);
  };
  EXPECT_EQ(shares(0, 0, 2, 1e12), std::pair(2, 1));
  EXPECT_EQ(shares(0, 0, 16, 1e12), std::pair(4, 4));   // no more jobs than runs
  EXPECT_EQ(shares(0, 0, 16, 7.5e9), std::pair(2, 8));  // the two largest together
  EXPECT_EQ(shares(0, 0, 16, 1e9), std::pair(1, 16));
  EXPECT_EQ(shares(0, 8, 16, 1e12), std::pair(2, 8));
  EXPECT_EQ(shares(3, 0, 16, 1e9), std::pair(3, 5));  // as asked
}

}  // namespace
}  // namespace heddle
