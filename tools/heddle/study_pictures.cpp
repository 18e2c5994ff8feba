#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "heddle/outside_views.hpp"
#include "heddle/picture.hpp"
#include "heddle/plot.hpp"
#include "heddle/section_views.hpp"
#include "heddle/study_report.hpp"

namespace heddle {
namespace {

using std::filesystem::path;

constexpr int width_px = 1600;

std::string with_spaces(std::string text) {
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

std::string last_part(const std::string& key) {
  return key.substr(key.rfind('.') + 1);
}

std::string file_part(std::string key) {
  std::replace(key.begin(), key.end(), '.', '_');
  std::replace(key.begin(), key.end(), '*', 'a');
  return key;
}

/// A figure's key with its unit taken off the end.
struct FigureName {
  std::string text, unit;
};

FigureName figure_name(const std::string& key) {
  std::string name = key;
  std::replace(name.begin(), name.end(), '.', ' ');
  // The unit stands at the end of the summary's own key, which more parts may follow: energy_J.contact.
  for (const std::string unit : {"m", "N", "J", "Pa", "s"}) {
    for (std::size_t at = name.find("_" + unit); at != std::string::npos; at = name.find("_" + unit, at + 1)) {
      const std::size_t end = at + 1 + unit.size();
      if (end != name.size() && name[end] != ' ') continue;
      name.erase(at, end - at);
      return {with_spaces(name), unit};
    }
  }
  return {with_spaces(name), ""};
}

/// Figures of one key in the unit that suits them.
struct Scaled {
  std::string label;
  double factor = 1;
};

Scaled scaled(const Study& study, const std::vector<StudyRow>& rows, std::size_t figure) {
  double largest = 0;
  for (const StudyRow& row : rows) {
    if (row.figures[figure].value.is_number()) largest = std::max(largest, std::abs(row.figures[figure].value.get<double>()));
  }
  const FigureName name = figure_name(study.collect[figure]);
  if (name.unit.empty()) return {name.text, 1};
  const Unit unit = readable_unit(largest, name.unit);
  return {fmt::format("{} [{}]", name.text, unit.name), unit.factor};
}

struct Quantity {
  double value = 0;
  std::string unit;
};

std::optional<Quantity> quantity_of(const std::string& text) {
  Quantity q;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), q.value);
  if (status != std::errc()) return {};
  q.unit = std::string(end, text.data() + text.size());
  q.unit.erase(0, q.unit.find_first_not_of(' '));
  return q;
}

/// The parameter's values, one for each row, and their unit; none unless all are numbers of one unit, two of them different.
std::optional<std::pair<std::vector<double>, std::string>> axis_of(const std::vector<StudyRow>& rows, std::size_t parameter) {
  std::vector<double> values;
  std::string unit;
  for (const StudyRow& row : rows) {
    const auto q = quantity_of(row.task->run->parameters[parameter]);
    if (!q || (!values.empty() && q->unit != unit)) return {};
    unit = q->unit;
    values.push_back(q->value);
  }
  if (std::set<double>(values.begin(), values.end()).size() < 2) return {};
  return std::pair(values, unit);
}

/// Whether two parameters are axes that change together: each value of the one comes with one value of the other.
bool change_together(const std::vector<StudyRow>& rows, std::size_t a, std::size_t b) {
  std::map<std::string, std::string> of_a, of_b;
  return axis_of(rows, a) && axis_of(rows, b) && std::all_of(rows.begin(), rows.end(), [&](const StudyRow& row) {
           const std::string &value_a = row.task->run->parameters[a], &value_b = row.task->run->parameters[b];
           return of_a.emplace(value_a, value_b).first->second == value_b && of_b.emplace(value_b, value_a).first->second == value_a;
         });
}

/// What a row has beside one parameter and those that change with it: the name of the curve it belongs to.
std::string rest_of(const Study& study, const std::vector<StudyRow>& rows, const StudyRow& row, std::size_t parameter) {
  std::string text;
  for (std::size_t i = 0; i < study.parameters.size(); ++i) {
    if (row.task->run->parameters[i].empty() || change_together(rows, i, parameter)) continue;
    const std::string value = row.task->run->parameters[i];
    text +=
        (text.empty() ? "" : ", ") + (study.parameters[i] == "case" ? value : with_spaces(last_part(study.parameters[i])) + " " + value);
  }
  return text;
}

bool applies(const Study& study, const Reference& reference, const StudyRow& row) {
  return std::all_of(reference.where.begin(), reference.where.end(), [&](const Assignment& a) {
    const auto at = std::find(study.parameters.begin(), study.parameters.end(), a.key) - study.parameters.begin();
    return row.task->run->parameters[static_cast<std::size_t>(at)] == a.value;
  });
}

constexpr const char* largest_error = "largest error of the repeated runs";

bool has_number(const StudyRow& row, std::size_t figure) {
  return row.figures[figure].value.is_number();
}

Plot curve(const Study& study, const std::vector<StudyRow>& rows, std::size_t figure, std::size_t parameter, const std::vector<double>& u,
           const std::string& unit) {
  const Scaled scale = scaled(study, rows, figure);
  std::map<std::string, std::vector<std::size_t>> groups;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!has_number(rows[i], figure)) continue;
    const std::string rest = rest_of(study, rows, rows[i], parameter);
    if (!groups.contains(rest)) order.push_back(rest);
    groups[rest].push_back(i);
  }
  Plot plot;
  const std::string name = with_spaces(last_part(study.parameters[parameter]));
  plot.title = study.title;
  plot.u_label = unit.empty() ? name : fmt::format("{} [{}]", name, unit);
  plot.v_label = scale.label;
  const auto spread = spread_of(rows, figure);
  Series others{.label = largest_error, .color = faint_ink, .u = {}, .v = {}, .style = Series::Style::bars};
  for (std::size_t g = 0; g < order.size(); ++g) {
    std::vector<std::size_t>& members = groups[order[g]];
    std::sort(members.begin(), members.end(), [&](std::size_t a, std::size_t b) { return u[a] < u[b]; });
    Series line{.label = order[g], .color = yarn_color(static_cast<int>(g), g % 2 == 0), .u = {}, .v = {}};
    Series points = line;
    points.label.clear();
    points.style = Series::Style::circles;
    for (const std::size_t i : members) {
      const Figure& f = rows[i].figures[figure];
      line.u.push_back(u[i]);
      line.v.push_back(scale.factor * f.value.get<double>());
      points.error.push_back(f.error ? scale.factor * *f.error : NAN);
      if (f.error || !spread || !spread->error) continue;
      others.u.push_back(u[i]);
      others.v.push_back(line.v.back());
      others.error.push_back(scale.factor * *spread->error);
    }
    points.u = line.u;
    points.v = line.v;
    plot.series.push_back(std::move(line));
    plot.series.push_back(std::move(points));
  }
  if (!others.u.empty()) plot.series.insert(plot.series.begin(), std::move(others));
  for (const Reference& r : study.references) {
    if (r.key != study.collect[figure]) continue;
    Series line{.label = r.source, .color = faint_ink, .u = {}, .v = {}};
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (!applies(study, r, rows[i])) continue;
      line.u.push_back(u[i]);
      line.v.push_back(scale.factor * r.value);
    }
    std::sort(line.u.begin(), line.u.end());
    if (!line.u.empty()) plot.series.push_back(std::move(line));
  }
  return plot;
}

/// One line for each run: its name, its figure with the error (in gray the study's largest, for a run without one of its own), and the
/// reference as a gray mark.
void draw_run_by_run(const Study& study, const std::vector<StudyRow>& rows, std::size_t figure, const path& file) {
  constexpr double row_height = 46, top = 80, bottom = 90, edge = 40, letters = 20;
  const Scaled scale = scaled(study, rows, figure);
  const auto height_px = static_cast<int>(top + bottom + row_height * static_cast<double>(rows.size()));
  Canvas canvas(file, width_px, height_px);
  const auto spread = spread_of(rows, figure);
  const auto error_shown = [&](const Figure& f) { return f.error || !spread ? f.error : spread->error; };
  double low = INFINITY, high = -INFINITY, widest = 0;
  const auto include = [&](double value, double error) {
    low = std::min(low, scale.factor * (value - error));
    high = std::max(high, scale.factor * (value + error));
  };
  for (const StudyRow& row : rows) {
    widest = std::max(widest, canvas.text_width(row.task->run->name, {letters, ink}));
    if (has_number(row, figure)) include(row.figures[figure].value.get<double>(), error_shown(row.figures[figure]).value_or(0));
    for (const Reference& r : study.references) {
      if (r.key == study.collect[figure] && applies(study, r, row)) include(r.value, r.tolerance);
    }
  }
  const double margin = high > low ? 0.06 * (high - low) : std::max(0.1 * std::abs(high), 1e-9);
  Frame frame{{edge + widest + 24, top},
              width_px - 2 * edge - widest - 24,
              row_height * static_cast<double>(rows.size()),
              low - margin,
              high + margin,
              0,
              static_cast<double>(rows.size())};
  canvas.text({edge, 34}, study.title, {.size = 26, .color = ink, .bold = true});
  const std::vector<double> marks = ticks(frame.u_min, frame.u_max, frame.width / 130);
  const double step = marks.size() > 1 ? marks[1] - marks[0] : 1;
  for (const double mark : marks) {
    const double x = frame.at(mark, 0).x;
    canvas.line({{x, frame.top_left.y}, {x, frame.bottom()}}, grid_gray, 1);
    canvas.text({x, frame.bottom() + 12}, tick_label(mark, step), {18, ink}, {0.5, 0});
  }
  canvas.frame(frame.top_left, frame.width, frame.height, ink, 1.2);
  canvas.text({frame.top_left.x + frame.width / 2, frame.bottom() + 48}, scale.label, {letters, ink}, {0.5, 0});
  bool lent = false;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double v = static_cast<double>(rows.size() - i) - 0.5;
    const auto at = [&](double value) { return frame.at(scale.factor * value, v); };
    canvas.text({frame.top_left.x - 16, at(0).y}, rows[i].task->run->name, {letters, ink}, {1, 0.5});
    for (const Reference& r : study.references) {
      if (r.key != study.collect[figure] || !applies(study, r, rows[i])) continue;
      const Point from = at(r.value - r.tolerance), to = at(r.value + r.tolerance), middle = at(r.value);
      canvas.rectangle({from.x, from.y - 10}, to.x - from.x, 20, grid_gray);
      canvas.line({{middle.x, middle.y - 14}, {middle.x, middle.y + 14}}, faint_ink, 3);
    }
    const Figure& f = rows[i].figures[figure];
    if (!f.value.is_number()) continue;
    const double value = f.value.get<double>();
    const Color color = yarn_color(0, true);
    if (const auto error = error_shown(f)) {
      const Color bar = f.error ? color : faint_ink;
      const Point from = at(value - *error), to = at(value + *error);
      canvas.line({from, to}, bar, 2);
      for (const Point& end : {from, to}) canvas.line({{end.x, end.y - 8}, {end.x, end.y + 8}}, bar, 2);
      lent = lent || !f.error;
    }
    canvas.ellipse(at(value), 7, 7, 0, white, color, 3);
  }
  if (lent) canvas.text({frame.right(), 34}, fmt::format("gray bars: {}", largest_error), {18, faint_ink}, {1, 0});
  canvas.finish();
}

}  // namespace

std::optional<Plot> study_curve(const Study& study, const std::vector<StudyRow>& rows, std::size_t figure, std::size_t parameter) {
  for (std::size_t before = 0; before < parameter; ++before) {
    if (change_together(rows, before, parameter)) return {};
  }
  const auto axis = axis_of(rows, parameter);
  return axis ? std::optional(curve(study, rows, figure, parameter, axis->first, axis->second)) : std::nullopt;
}

std::vector<path> draw_study(const Study& study, const std::vector<StudyRow>& rows, const path& output, const path& folder) {
  std::filesystem::create_directories(folder);
  std::vector<path> files;
  for (std::size_t figure = 0; figure < study.collect.size(); ++figure) {
    if (std::none_of(rows.begin(), rows.end(), [&](const StudyRow& row) { return has_number(row, figure); })) continue;
    bool drawn = false;
    for (std::size_t parameter = 0; parameter < study.parameters.size(); ++parameter) {
      const auto plot = study_curve(study, rows, figure, parameter);
      if (!plot) continue;
      files.push_back(folder / fmt::format("{}_by_{}.png", file_part(study.collect[figure]), file_part(study.parameters[parameter])));
      constexpr int height_px = 760;
      Canvas canvas(files.back(), width_px, height_px);
      draw_plot(canvas, *plot, {0, 0}, width_px, height_px, 1.3);
      canvas.finish();
      drawn = true;
    }
    if (drawn) continue;
    files.push_back(folder / (file_part(study.collect[figure]) + ".png"));
    draw_run_by_run(study, rows, figure, files.back());
  }
  const std::pair<std::string, std::string> cells[] = {{"weave", "cell.vtkhdf"}, {"relax", "relax.vtkhdf"}};
  for (const auto& [stage, name] : cells) {
    std::vector<CellPanel> panels;
    for (const StudyRow& row : rows) {
      const path file = run_folder(output, *row.task->run) / stage / name;
      if (row.task->record.state == RunState::finished && std::filesystem::exists(file)) panels.push_back({file, row.task->run->name});
    }
    if (panels.empty()) continue;
    const std::string title = study.title + (stage == "weave" ? ": woven" : ": relaxed");
    for (const auto axis : {weave::SectionAxis::x, weave::SectionAxis::y}) {
      files.push_back(folder / fmt::format("{}_section_{}.png", stage, axis == weave::SectionAxis::x ? "x" : "y"));
      draw_section_panels(panels, axis, title, files.back());
    }
    files.push_back(folder / fmt::format("{}_top.png", stage));
    draw_top_panels(panels, title, files.back());
  }
  return files;
}

}  // namespace heddle
