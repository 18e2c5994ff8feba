#pragma once
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "heddle/plot.hpp"
#include "heddle/study.hpp"
#include "heddle/study_progress.hpp"

namespace heddle {

/// A collected figure of one run.
struct Figure {
  nlohmann::json value;         ///< number, boolean or text; null: the run has none
  std::optional<double> error;  ///< distance to the second discretization's value
};

/// A run with what was collected of it.
struct StudyRow {
  const RunTask* task = nullptr;
  const RunTask* second = nullptr;  ///< its repetition; null: the study has none
  std::vector<Figure> figures;      ///< in the order of Study::collect
};

/// How far a figure differs from run to run, beside how well it is known.
struct Spread {
  double lowest = 0, highest = 0;
  std::optional<double> error;  ///< largest of the runs; none where the study has no second discretization
  /// The difference is larger than the errors of both runs together: only then it is a trend. False where no error is known.
  [[nodiscard]] bool is_trend() const { return error && highest - lowest > 2 * *error; }
};

/// The runs that stand for themselves, in the order of the study, with their figures from the summaries that are there.
std::vector<StudyRow> study_rows(const Study& study, const std::vector<RunTask>& tasks, const std::filesystem::path& output);

/// None where fewer than two runs have the figure as a number.
std::optional<Spread> spread_of(const std::vector<StudyRow>& rows, std::size_t figure);

/// study.csv: a row for each of the rows, with its parameters, its figures and their errors. study.json: the same with what the study is
/// and how its runs ended. Figures in SI units, the unit at the end of their names.
std::string study_csv(const Study& study, const std::vector<StudyRow>& rows);
std::string study_json(const Study& study, const std::vector<StudyRow>& rows);

/// A figure against a parameter: a curve for each set of the other parameters, with the runs' error bars; where others were repeated, a run
/// that was not gets the largest error of those that were. None for a parameter that is no number of one unit, does not differ from run to
/// run, or changes together with an earlier one.
std::optional<Plot> study_curve(const Study& study, const std::vector<StudyRow>& rows, std::size_t figure, std::size_t parameter);

/// Draws into the folder: each figure against each parameter that is a number, with error bars, else run by run; and the same sections of
/// all unit cells, and these from above, side by side. Returns the files.
std::vector<std::filesystem::path> draw_study(const Study& study, const std::vector<StudyRow>& rows, const std::filesystem::path& output,
                                              const std::filesystem::path& folder);

/// The study as one HTML page that needs no other file. Throws std::runtime_error naming a picture that it can not read.
std::string study_page(const Study& study, const std::vector<StudyRow>& rows, const std::vector<std::filesystem::path>& pictures);

/// A figure to read: "0.36318 ± 0.0021"; "-" where there is none.
std::string figure_text(const Figure& figure);

}  // namespace heddle
