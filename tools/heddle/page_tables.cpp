#include "heddle/page_tables.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

namespace heddle {

using nlohmann::ordered_json;

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

}  // namespace heddle
