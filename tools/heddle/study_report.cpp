#include "heddle/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "weave/version.hpp"

namespace heddle {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

std::optional<double> number(const json& value) {
  return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
}

/// A field of a CSV file (RFC 4180).
std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + "\"";
}

std::string value_text(const json& value) {
  if (value.is_null()) return "";
  if (value.is_string()) return value.get<std::string>();
  return value.dump();  // the shortest decimals that read back as the same number
}

ordered_json assignments(const std::vector<Assignment>& list) {
  ordered_json object = ordered_json::object();
  for (const Assignment& a : list) object[a.key] = plain_value(a.value);
  return object;
}

ordered_json record_json(const RunTask& task) {
  const RunRecord& r = task.record;
  return {{"name", task.run->name}, {"state", name_of(r.state)}, {"message", r.message}, {"wall_s", r.wall},
          {"attempts", r.attempts}, {"threads", r.threads},      {"version", r.version}};
}

}  // namespace

std::vector<StudyRow> study_rows(const Study& study, const std::vector<RunTask>& tasks, const std::filesystem::path& output) {
  std::vector<StudyRow> rows;
  for (const RunTask& task : tasks) {
    if (!task.run->second_of.empty()) continue;
    StudyRow row{&task, nullptr, {}};
    for (const RunTask& other : tasks) {
      if (other.run->second_of == task.run->name) row.second = &other;
    }
    for (const std::string& key : study.collect) {
      Figure figure;
      if (task.record.state == RunState::finished) figure.value = figure_of(*task.run, output, key);
      if (row.second && row.second->record.state == RunState::finished) {
        const auto a = number(figure.value), b = number(figure_of(*row.second->run, output, key));
        if (a && b) figure.error = std::abs(*a - *b);
      }
      row.figures.push_back(std::move(figure));
    }
    rows.push_back(std::move(row));
  }
  // In the order of the study, whatever order they run in.
  std::stable_sort(rows.begin(), rows.end(), [&](const StudyRow& a, const StudyRow& b) { return a.task->run < b.task->run; });
  return rows;
}

std::optional<Spread> spread_of(const std::vector<StudyRow>& rows, std::size_t figure) {
  Spread spread{INFINITY, -INFINITY, {}};
  int count = 0;
  for (const StudyRow& row : rows) {
    const Figure& f = row.figures[figure];
    const auto value = number(f.value);
    if (!value) continue;
    ++count;
    spread.lowest = std::min(spread.lowest, *value);
    spread.highest = std::max(spread.highest, *value);
    if (f.error) spread.error = std::max(spread.error.value_or(0), *f.error);
  }
  return count > 1 ? std::optional(spread) : std::nullopt;
}

std::string study_csv(const Study& study, const std::vector<StudyRow>& rows) {
  std::string text = "run";
  for (const std::string& key : study.parameters) text += "," + csv_field(key);
  for (const std::string& key : study.collect) text += "," + csv_field(key) + (study.second.empty() ? "" : "," + csv_field(key + ".error"));
  text += ",state,wall_s\n";
  for (const StudyRow& row : rows) {
    text += csv_field(row.task->run->name);
    for (const std::string& value : row.task->run->parameters) text += "," + csv_field(value);
    for (const Figure& f : row.figures) {
      text += "," + csv_field(value_text(f.value));
      if (!study.second.empty()) text += "," + (f.error ? json(*f.error).dump() : "");
    }
    text += fmt::format(",{},{:.1f}\n", name_of(row.task->record.state), row.task->record.wall);
  }
  return text;
}

std::string study_json(const Study& study, const std::vector<StudyRow>& rows) {
  ordered_json j;
  j["tool"] = "study";
  j["study"] = study.name;
  j["title"] = study.title;
  j["question"] = study.question;
  j["version"] = weave::version();
  j["until"] = study.until;
  j["set"] = assignments(study.settings);
  j["error_set"] = assignments(study.second);
  j["parameters"] = study.parameters;
  ordered_json figures = ordered_json::array();
  for (std::size_t i = 0; i < study.collect.size(); ++i) {
    ordered_json figure = {{"key", study.collect[i]}};
    if (const auto spread = spread_of(rows, i)) {
      figure["lowest"] = spread->lowest;
      figure["highest"] = spread->highest;
      if (spread->error) {
        figure["error_max"] = *spread->error;
        figure["differs_by_more_than_errors"] = spread->is_trend();
      }
    }
    figures.push_back(std::move(figure));
  }
  j["figures"] = figures;
  ordered_json runs = ordered_json::array();
  double wall = 0;
  for (const StudyRow& row : rows) {
    ordered_json run = record_json(*row.task);
    wall += row.task->record.wall;
    run["parameters"] = ordered_json::object();
    for (std::size_t i = 0; i < study.parameters.size(); ++i) run["parameters"][study.parameters[i]] = row.task->run->parameters[i];
    run["figures"] = ordered_json::object();
    run["errors"] = ordered_json::object();
    for (std::size_t i = 0; i < study.collect.size(); ++i) {
      run["figures"][study.collect[i]] = row.figures[i].value;
      if (row.figures[i].error) run["errors"][study.collect[i]] = *row.figures[i].error;
    }
    if (row.second) {
      run["second"] = record_json(*row.second);
      wall += row.second->record.wall;
    }
    runs.push_back(std::move(run));
  }
  j["runs"] = runs;
  if (!study.references.empty()) {
    j["references"] = ordered_json::array();
    for (const Reference& r : study.references)
      j["references"].push_back(
          {{"key", r.key}, {"value", r.value}, {"tolerance", r.tolerance}, {"source", r.source}, {"where", assignments(r.where)}});
  }
  j["wall_s"] = wall;
  return j.dump(2) + "\n";
}

std::string figure_text(const Figure& figure) {
  if (figure.value.is_null()) return "-";
  if (!figure.value.is_number()) return value_text(figure.value);
  const std::string text = figure.value.is_number_float() ? fmt::format("{:.5g}", figure.value.get<double>()) : figure.value.dump();
  return figure.error ? fmt::format("{} \u00b1 {:.2g}", text, *figure.error) : text;
}

}  // namespace heddle
