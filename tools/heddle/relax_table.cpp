#include "heddle/relax_table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <utility>

#include "relax/report.hpp"
#include "weave/measures.hpp"

namespace heddle {
namespace {

constexpr int name_width = 28, column_width = 13;

/// What a table tells about one cell, name by name.
std::vector<std::pair<std::string, double>> figures_of(const relax::ComparedState& s) {
  const weave::CellMeasures& m = s.measures;
  std::vector<std::pair<std::string, double>> figures = {{"thickness_m", m.thickness},
                                                         {"thickness_mean_m", m.thickness_mean},
                                                         {"fiber_volume_fraction", m.fiber_volume_fraction},
                                                         {"fiber_volume_fraction_mean", m.fiber_volume_fraction_mean},
                                                         {"cell_length_m", s.cell.length_x},
                                                         {"cell_width_m", s.cell.length_y},
                                                         {"energy_J", s.energy.sum()},
                                                         {"crimp_warp", m.crimp_warp},
                                                         {"crimp_weft", m.crimp_weft}};
  const std::pair<std::string, double> sizes[] = {{"warp_width_m", m.yarn_width_warp},
                                                  {"warp_height_m", m.yarn_height_warp},
                                                  {"weft_width_m", m.yarn_width_weft},
                                                  {"weft_height_m", m.yarn_height_weft}};
  for (const auto& size : sizes) {
    if (!std::isnan(size.second)) figures.push_back(size);
  }
  return figures;
}

void print_row(const std::string& name, const std::vector<RelaxedColumn>& columns, auto&& text) {
  fmt::print("{:<{}}", name, name_width);
  for (const RelaxedColumn& column : columns) fmt::print("{:>{}}", text(column.state.certificate), column_width);
  fmt::print("\n");
}

}  // namespace

RelaxedColumn read_relaxed_column(const std::filesystem::path& folder, double value) {
  RelaxedColumn column{value, relax::read_relaxed_state(folder)};
  std::ifstream in(folder / "summary.json");
  column.wall = nlohmann::json::parse(in).value("wall_s", 0.0);
  return column;
}

std::map<std::string, relax::Extrapolation> extrapolate(const std::vector<RelaxedColumn>& columns) {
  std::vector<int> counts;
  std::map<std::string, std::vector<double>> values;
  for (const RelaxedColumn& column : columns) {
    counts.push_back(static_cast<int>(column.value));
    for (const auto& [name, figure] : figures_of(column.state)) values[name].push_back(figure);
  }
  std::map<std::string, relax::Extrapolation> endless;
  for (const auto& [name, of_counts] : values) {
    if (const auto e = relax::extrapolate(counts, of_counts)) endless[name] = *e;
  }
  return endless;
}

void print_relaxed(const std::string& value_name, const std::vector<RelaxedColumn>& columns,
                   const std::map<std::string, relax::Extrapolation>& endless) {
  fmt::print("\n{:<{}}", value_name, name_width);
  for (const RelaxedColumn& column : columns) fmt::print("{:>{}g}", column.value, column_width);
  fmt::print("{}\n", endless.empty() ? "" : fmt::format("{:>28}", "extrapolated"));
  std::vector<std::vector<std::pair<std::string, double>>> figures;
  for (const RelaxedColumn& column : columns) figures.push_back(figures_of(column.state));
  for (std::size_t i = 0; i < figures.front().size(); ++i) {
    const std::string& name = figures.front()[i].first;
    fmt::print("{:<{}}", name, name_width);
    for (const auto& of_column : figures) fmt::print("{:>{}.5g}", of_column.at(i).second, column_width);
    if (const auto e = endless.find(name); e != endless.end()) fmt::print("{:>14.5g} +- {:<10.2g}", e->second.value, e->second.uncertainty);
    fmt::print("\n");
  }
  using C = relax::Certificate;
  print_row("certified minimum", columns, [](const C& c) { return c.converged ? "yes" : "no"; });
  print_row("gradient_max", columns, [](const C& c) { return fmt::format("{:.1e}", c.gradient_max); });
  print_row("newton_step_max", columns, [](const C& c) { return fmt::format("{:.1e}", c.newton_step_max); });
  print_row("pin_force_max", columns, [](const C& c) { return fmt::format("{:.1e}", c.pin_force_max); });
  for (const RelaxedColumn& column : columns) {
    const C& c = column.state.certificate;
    if (!c.converged) fmt::print("{} {:g} is no certified minimum: {}\n", value_name, column.value, c.blocked_by);
  }
}

nlohmann::ordered_json json_of(const std::string& value_key, const std::vector<RelaxedColumn>& columns) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const RelaxedColumn& column : columns) {
    nlohmann::ordered_json row;
    if (column.value == std::floor(column.value))
      row[value_key] = static_cast<std::int64_t>(column.value);
    else
      row[value_key] = column.value;
    for (const auto& [name, figure] : figures_of(column.state)) row[name] = figure;
    relax::each_finding(column.state.certificate, [&](const char* key, const auto& finding) { row[key] = finding; });
    row["wall_s"] = column.wall;
    rows.push_back(row);
  }
  return rows;
}

}  // namespace heddle
