#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "weave/case.hpp"

namespace heddle {

/// A value that a study gives to a key: of the case ("loom.tension"), or of a later stage of `heddle run` ("relax.fibers",
/// "relax.pressure", "relax.load_x", "relax.load_y", "relax.unconverged", "homogenize.elements").
struct Assignment {
  std::string key;
  std::string value;  ///< as TOML: "\"3 N\"", "7", "[1, 2]"
};

/// One process of a study.
struct StudyRun {
  std::string name;  ///< also of its folder
  std::filesystem::path case_file;
  std::vector<Assignment> changes;
  std::vector<std::string> parameters;  ///< what it has for each of Study::parameters, to show; empty where the case's own value stands
  std::string second_of;                ///< the run that this one repeats with the second discretization; empty: it stands for itself
  weave::Case spec;                     ///< the case with the changes
};

/// A measured or published value to show beside a collected figure.
struct Reference {
  std::string key;       ///< of Study::collect
  double value = 0;      ///< in the figure's unit
  double tolerance = 0;  ///< of the measurement, same unit; 0: not known
  std::string source;
  std::vector<Assignment> where;  ///< parameters of the runs it belongs to; empty: all
};

/// What a study file asks for, expanded into its runs.
struct Study {
  std::filesystem::path file;
  std::string name, title, question;
  std::string until;                    ///< last stage: "weave", "relax", "envelope" or "homogenize"
  std::vector<std::string> collect;     ///< figures, "stage.key" of the stage's summary.json
  std::vector<std::string> parameters;  ///< keys that differ from run to run, in the order of the file; "case" among them where it does
  std::vector<Assignment> settings;     ///< same for all runs
  std::vector<Assignment> second;       ///< changes of the second discretization; empty: no error bars
  std::vector<Reference> references;
  std::vector<StudyRun> runs;  ///< grid, then listed ones, each followed by its repetition
};

/// The stages of `heddle run`, in their order.
const std::vector<std::string>& stage_names();

/// Reads a study (TOML) and expands it:
///
///     name = "reed_load_speed"                # letters, digits and _ - . +
///     title = "..."                           # default: the name
///     question = "..."
///     case = "../../example_1"                # relative to this file; or vary.case, or run.case
///     until = "weave"                         # default: the last stage that a collected figure needs
///     collect = ["weave.reed_load_max_N"]     # stage.key of its summary.json; deeper, and list entries by number or "last", by more dots
///
///     [set]                                   # for all runs; keys of the case or of a later stage
///     "yarns.*.fibers" = 7                    # of all yarns of the case
///     fabric.cells = 4
///
///     [vary]                                  # grid of all combinations
///     beat_up.top_speed = ["3 m/s", "4.5 m/s"]
///
///     [[run]]                                 # a single combination, instead of the grid or beside it
///     name = "slow"                           # default: from its values
///     set = { beat_up.top_speed = "1 m/s" }
///
///     [error]                                 # runs are repeated with this; the difference is the figures' error
///     set = { numerics.element_length = 1 }
///     runs = ["slow"]                         # which, by name; default: all
///
///     [[reference]]                           # a measured value to show beside a figure
///     key = "weave.thickness_m"
///     value = 1.8e-4
///     where = { case = "../../example_1" }
///
/// A folder stands for the study.toml in it. Throws weave::CaseError with all mistakes found, one a line, "FILE:LINE: KEY = VALUE: what is
/// wrong and the bound": unknown keys, empty grids, a key given twice, two runs alike, a figure of a stage after `until` or that no summary
/// has, a case that does not exist or is wrong with the changes.
Study read_study(const std::filesystem::path& file);

/// What `heddle run` is called with for a run of the study, after the program: "run", the case, options. Output folder as given.
std::vector<std::string> run_arguments(const Study& study, const StudyRun& run, const std::filesystem::path& output);

/// A TOML value to read in a table: strings without quotes.
std::string plain_value(const std::string& toml_value);

}  // namespace heddle
