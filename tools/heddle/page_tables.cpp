#include "heddle/page_tables.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <vector>

namespace heddle {
namespace {

using nlohmann::ordered_json;

/// A mean with its extremes, {"mean", "min", "max"} of a summary, in a unit of which `factor` make one of the base.
std::string spread_text(const ordered_json& spread, double factor) {
  return fmt::format("{:.4g} ({:.4g} \u2026 {:.4g})", factor * spread.at("mean").get<double>(), factor * spread.at("min").get<double>(),
                     factor * spread.at("max").get<double>());
}

}  // namespace

PageTable stiffness_table(const ordered_json& summary) {
  struct Source {
    const char *prefix, *label;
    bool bound;  // of moduli; no Poisson's ratio
  };
  constexpr std::array<Source, 4> sources = {
      {{"", "CalculiX", false}, {"reuss_", "Reuss", true}, {"laminate_", "laminate", false}, {"voigt_", "Voigt", true}}};
  constexpr std::array<const char*, 9> keys = {"ex_Pa", "ey_Pa", "ez_Pa", "gxy_Pa", "gyz_Pa", "gxz_Pa", "nu_xy", "nu_xz", "nu_yz"};
  PageTable table{"Engineering constants, moduli in GPa", {""}, {}};
  std::vector<Source> shown;
  for (const Source& s : sources)
    if (summary.contains(std::string(s.prefix) + "ex_Pa")) shown.push_back(s);
  for (const Source& s : shown) table.columns.emplace_back(s.label);
  for (const std::string key : keys) {
    if (!summary.contains(key)) continue;
    const bool modulus = key.ends_with("_Pa");
    std::vector<std::string> row = {key.substr(0, key.rfind("_Pa"))};
    for (const Source& s : shown) {
      const bool meant = modulus || !s.bound;
      row.push_back(meant ? fmt::format("{:.4g}", (modulus ? 1e-9 : 1) * summary.at(s.prefix + key).get<double>()) : "");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

PageTable section_table(const ordered_json& summary) {
  PageTable table{"Sections by yarn: mean (least \u2026 largest)",
                  {"yarn", "width [mm]", "height [mm]", "area [mm\u00b2]", "fiber volume fraction", "rotation [\u00b0]"},
                  {}};
  for (const ordered_json& yarn : summary.at("by_yarn")) {
    const ordered_json& s = yarn.at("sections");
    table.rows.push_back({fmt::format("{} {}", yarn.at("weft").get<bool>() ? "weft" : "warp", yarn.at("yarn").get<int>()),
                          spread_text(s.at("width_m"), 1e3), spread_text(s.at("height_m"), 1e3), spread_text(s.at("area_m2"), 1e6),
                          spread_text(s.at("fiber_volume_fraction"), 1), spread_text(s.at("rotation_rad"), 180 / std::numbers::pi)});
  }
  return table;
}

std::vector<PageTable> minima_tables(const ordered_json& summary) {
  struct Row {
    const char *label, *pointer;  ///< JSON pointer into a state or a pair
    double factor;                ///< of the base unit in the label's
  };
  const auto cell = [](const ordered_json& of, const Row& row) -> std::string {
    const ordered_json::json_pointer place(row.pointer);
    const ordered_json value = of.contains(place) ? of.at(place) : ordered_json();
    if (value.is_number()) return fmt::format("{:.5g}", row.factor * value.get<double>());
    if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
    return value.is_string() ? value.get<std::string>() : "";
  };
  constexpr std::array<Row, 13> state_rows = {{{"energy [J]", "/energy_J/sum", 1},
                                               {"of bars [J]", "/energy_J/bars", 1},
                                               {"of bending [J]", "/energy_J/bending", 1},
                                               {"of contact [J]", "/energy_J/contact", 1},
                                               {"work of tensions [J]", "/energy_J/tension", 1},
                                               {"error of the energy [J]", "/energy_error_J", 1},
                                               {"certified minimum", "/certificate/converged", 1},
                                               {"gradient [reference tension]", "/certificate/gradient_max", 1},
                                               {"thickness [mm]", "/thickness_m", 1e3},
                                               {"of the mean envelopes [mm]", "/thickness_mean_m", 1e3},
                                               {"fiber volume fraction", "/fiber_volume_fraction", 1},
                                               {"crimp of warps [%]", "/crimp_warp", 100},
                                               {"crimp of wefts [%]", "/crimp_weft", 100}}};
  constexpr std::array<Row, 8> pair_rows = {{{"yarn paths apart, mean [fiber diameters]", "/path_diameters/mean", 1},
                                             {"largest", "/path_diameters/largest", 1},
                                             {"yarn widths apart, mean [fiber diameters]", "/width_diameters/mean", 1},
                                             {"largest", "/width_diameters/largest", 1},
                                             {"fibers apart, mean [fiber diameters]", "/fibers_diameters/mean", 1},
                                             {"largest", "/fibers_diameters/largest", 1},
                                             {"energies apart [J]", "/energy_difference_J", 1},
                                             {"verdict", "/verdict", 1}}};
  PageTable states{"Minima, and the woven cell", {""}, {}}, pairs{"By how much they differ", {""}, {}};
  for (const ordered_json& s : summary.at("states")) states.columns.push_back(s.at("name"));
  for (const ordered_json& p : summary.at("pairs"))
    pairs.columns.push_back(p.at("a").get<std::string>() + ", " + p.at("b").get<std::string>());
  const auto fill = [&cell](PageTable& table, const auto& rows, const ordered_json& columns) {
    for (const Row& row : rows) {
      table.rows.push_back({row.label});
      for (const ordered_json& column : columns) table.rows.back().push_back(cell(column, row));
    }
  };
  fill(states, state_rows, summary.at("states"));
  fill(pairs, pair_rows, summary.at("pairs"));
  return {states, pairs};
}

PageTable wall_table(const ordered_json& summary) {
  PageTable table{"Wall time", {"stage", "[s]"}, {}};
  for (const auto& [stage, seconds] : summary.at("stage_wall_s").items())
    table.rows.push_back({stage, fmt::format("{:.4g}", seconds.get<double>())});
  table.rows.push_back({"all", fmt::format("{:.4g}", summary.at("wall_s").get<double>())});
  return table;
}

}  // namespace heddle
