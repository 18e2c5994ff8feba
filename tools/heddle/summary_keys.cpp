#include "heddle/summary_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>
#include <vector>

#include "heddle/homogenize_summary.hpp"
#include "relax/envelope.hpp"
#include "relax/report.hpp"
#include "weave/weaving_run.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;

/// A cell of one straight fiber, of which a summary can be written.
struct SmallestCell {
  relax::Cell cell;
  relax::MinimizeResult result;
  weave::Snapshot snapshot;

  SmallestCell() {
    constexpr double length = 1e-3;
    constexpr int nodes = 4;
    cell.length_x = cell.length_y = length;
    cell.types.push_back(
        {.radius = 1e-5, .area = 1e-10, .youngs_modulus = 1e11, .transverse_modulus = 1e9, .density = 1000, .bending_stiffness = 0});
    relax::finish_types(cell);
    relax::CellFiber fiber;
    for (int i = 0; i < nodes; ++i) fiber.x.emplace_back(length * i / nodes, 0, 0);
    fiber.rest_length.assign(nodes, length / nodes);
    std::vector<weave::Vec3> x;
    relax::add_fiber(cell, fiber, x);
    result.q = relax::unknowns_at(cell, x);
    snapshot = relax::snapshot_of(cell, result.q);
  }
};

/// A summary as its stage writes it: the keys are true, the values mean nothing.
ordered_json sample_of(const std::string& stage) {
  if (stage == "weave") return ordered_json::parse(weave::summary_json({}, {}));
  const SmallestCell smallest;
  if (stage == "relax") {
    relax::ReportContext context;
    context.start = "woven";
    return ordered_json::parse(relax::summary_json(smallest.cell, smallest.result, weave::measure_cell(smallest.snapshot), context));
  }
  if (stage == "envelope") {
    relax::Envelopes envelopes;
    envelopes.yarns.emplace_back().sections.resize(2);
    return ordered_json::parse(relax::envelope_summary_json(smallest.snapshot, {}, envelopes, "", "", 0));
  }
  SolvedCell solved;
  solved.cell.composite.mesh = relax::box_mesh({0, 0, 0}, {1, 1, 1}, {1, 1, 1});
  solved.cell.composite.volumes.emplace_back();
  solved.result.stiffness.setIdentity();
  solved.result.bounds.voigt.setIdentity();
  solved.result.bounds.reuss.setIdentity();
  solved.result.laminate.setIdentity();
  return ordered_json::parse(homogenize_summary({}, {}, {}, solved, &solved, 0, 0));
}

/// Single letters to put in, take out or change that make one word of the other (V. I. Levenshtein, Sov. Phys. Dokl. 10 (1966) 707).
std::size_t edits_between(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, change});
    }
  }
  return row.back();
}

std::vector<std::string> keys_near(const std::string& key, const ordered_json& table) {
  constexpr std::size_t count = 3;
  std::vector<std::string> keys;
  for (const auto& [name, value] : table.items()) keys.push_back(name);
  std::stable_sort(keys.begin(), keys.end(),
                   [&](const std::string& a, const std::string& b) { return edits_between(key, a) < edits_between(key, b); });
  keys.resize(std::min(keys.size(), count));
  return keys;
}

bool is_place(const std::string& part) {
  return part == "last" || std::all_of(part.begin(), part.end(), [](unsigned char c) { return std::isdigit(c); });
}

}  // namespace

std::string figure_mistake(const std::string& figure) {
  std::istringstream parts(figure);
  std::string part, path;
  std::getline(parts, part, '.');
  ordered_json value = sample_of(part);
  path = part;
  while (std::getline(parts, part, '.')) {
    if (value.is_object()) {
      if (!value.contains(part))
        return fmt::format("the summary has no \"{}\" in {}; the nearest keys are {}", part, path, fmt::join(keys_near(part, value), ", "));
      const ordered_json inner = value[part];
      value = inner;
    } else if (value.is_array()) {
      if (!is_place(part)) return fmt::format("{} is a list: its entries are 0, 1, ... or last, not \"{}\"", path, part);
      if (value.empty()) return "";
      const ordered_json inner = value[0];
      value = inner;
    } else {
      return fmt::format("{} is a figure by itself, without \".{}\"", path, part);
    }
    path += "." + part;
  }
  if (value.is_object()) {
    std::vector<std::string> keys;
    for (const auto& [name, inner] : value.items()) keys.push_back(name);
    return fmt::format("{} is a table: give one of its keys {} after a dot", path, fmt::join(keys, ", "));
  }
  if (value.is_array()) return fmt::format("{} is a list: give an entry's number, or last, after a dot", path);
  return "";
}

}  // namespace heddle
