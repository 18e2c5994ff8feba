#include <fmt/format.h>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include "heddle/base64.hpp"
#include "heddle/escaped.hpp"
#include "heddle/study_report.hpp"
#include "weave/version.hpp"

namespace heddle {
namespace {

constexpr const char* page_style = R"css(
body { font: 15px/1.45 "DejaVu Sans", Helvetica, Arial, sans-serif; color: #222; max-width: 1180px; margin: 2em auto; padding: 0 1em; }
h1 { margin-bottom: 0; } h2 { margin-top: 2em; border-bottom: 1px solid #ccc; } .question { font-size: 18px; } .note, figcaption { color: #666; }
figure { margin: 1.6em 0; } figure img { max-width: 100%; } .wide { overflow-x: auto; } table { border-collapse: collapse; }
td, th { padding: 0.2em 1em 0.2em 0; text-align: left; vertical-align: top; font-variant-numeric: tabular-nums; white-space: nowrap; }
th { border-bottom: 1px solid #999; font-weight: normal; color: #555; } tr.failed td { color: #a33; } pre { background: #f5f6f7; padding: 1em; overflow: auto; }
)css";

std::string row_of(const std::string& cell, const std::vector<std::string>& texts, const std::string& kind = "") {
  std::string html = kind.empty() ? "<tr>" : fmt::format("<tr class=\"{}\">", kind);
  for (const std::string& text : texts) html += fmt::format("<{0}>{1}</{0}>", cell, escaped(text));
  return html + "</tr>\n";
}

std::string picture(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream bytes;
  bytes << in.rdbuf();
  if (!in) throw std::runtime_error(file.string() + ": can not be read");
  return fmt::format("<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
                     escaped(file.stem().string()), base64(bytes.str()));
}

std::string runs_table(const Study& study, const std::vector<StudyRow>& rows) {
  std::vector<std::string> heading = {"run"};
  heading.insert(heading.end(), study.parameters.begin(), study.parameters.end());
  heading.insert(heading.end(), study.collect.begin(), study.collect.end());
  heading.insert(heading.end(), {"state", "wall time"});
  std::string html = "<div class=\"wide\"><table>\n" + row_of("th", heading);
  for (const StudyRow& row : rows) {
    const RunTask& task = *row.task;
    std::vector<std::string> cells = {task.run->name};
    cells.insert(cells.end(), task.run->parameters.begin(), task.run->parameters.end());
    for (const Figure& figure : row.figures) cells.push_back(figure_text(figure));
    cells.insert(cells.end(), {name_of(task.record.state), duration_text(task.record.wall)});
    html += row_of("td", cells, task.record.state == RunState::failed ? "failed" : "");
  }
  return html + "</table></div>\n";
}

std::string spreads(const Study& study, const std::vector<StudyRow>& rows) {
  std::string html;
  for (std::size_t i = 0; i < study.collect.size(); ++i) {
    const auto spread = spread_of(rows, i);
    if (!spread) continue;
    const std::string verdict = !spread->error       ? "no error is known"
                                : spread->is_trend() ? "more than the errors"
                                                     : "NOT more than the errors: no trend";
    html += row_of("td", {study.collect[i], fmt::format("{:.5g}", spread->lowest), fmt::format("{:.5g}", spread->highest),
                          spread->error ? fmt::format("{:.2g}", *spread->error) : "-", verdict});
  }
  if (html.empty()) return "";
  return "<h2>Differences and errors</h2>\n<table>\n" + row_of("th", {"figure", "lowest", "highest", "largest error", "they differ by"}) +
         html + "</table>\n";
}

std::string references(const Study& study) {
  if (study.references.empty()) return "";
  std::string html = "<h2>Measured</h2>\n<table>\n" + row_of("th", {"figure", "where", "value", "source"});
  for (const Reference& r : study.references) {
    std::string where;
    for (const Assignment& a : r.where) where += (where.empty() ? "" : ", ") + a.key + " = " + a.value;
    html += row_of(
        "td", {r.key, where, r.tolerance > 0 ? fmt::format("{:.5g} \u00b1 {:.2g}", r.value, r.tolerance) : fmt::format("{:.5g}", r.value),
               r.source});
  }
  return html + "</table>\n";
}

std::string failures(const std::vector<StudyRow>& rows) {
  std::string html;
  for (const StudyRow& row : rows) {
    for (const RunTask* task : {row.task, row.second}) {
      if (task && !task->record.message.empty())
        html += fmt::format("<p>{}</p>\n<pre>{}</pre>\n", escaped(task->run->name), escaped(task->record.message));
    }
  }
  return html.empty() ? "" : "<h2>Runs that did not finish</h2>\n" + html;
}

std::string assignments(const std::string& title, const std::vector<Assignment>& list) {
  std::string html;
  for (const Assignment& a : list) html += row_of("td", {a.key, plain_value(a.value)});
  return html.empty() ? "" : fmt::format("<h2>{}</h2>\n<table>\n{}</table>\n", title, html);
}

}  // namespace

std::string study_page(const Study& study, const std::vector<StudyRow>& rows, const std::vector<std::filesystem::path>& pictures) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n"
      "<p class=\"question\">{2}</p>\n",
      escaped(study.title), page_style, escaped(study.question));
  html += "<h2>Runs</h2>\n" + runs_table(study, rows);
  if (!study.second.empty()) html += "<p class=\"note\">\u00b1: distance to the same run with the second discretization.</p>\n";
  html += spreads(study, rows) + references(study) + failures(rows);
  if (!pictures.empty()) html += "<h2>Pictures</h2>\n";
  for (const auto& file : pictures) html += picture(file);
  html += assignments("Same for all runs", study.settings) + assignments("Second discretization", study.second);
  return html + fmt::format("<p class=\"note\">heddle {}</p>\n</body></html>\n", escaped(weave::version()));
}

}  // namespace heddle
