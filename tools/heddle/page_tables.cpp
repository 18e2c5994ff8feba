#include "heddle/page_tables.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <numbers>

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

PageTable wall_table(const ordered_json& summary) {
  PageTable table{"Wall time", {"stage", "[s]"}, {}};
  for (const auto& [stage, seconds] : summary.at("stage_wall_s").items())
    table.rows.push_back({stage, fmt::format("{:.4g}", seconds.get<double>())});
  table.rows.push_back({"all", fmt::format("{:.4g}", summary.at("wall_s").get<double>())});
  return table;
}

}  // namespace heddle
