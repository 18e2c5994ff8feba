#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "toml_table.hpp"
#include "weave/case.hpp"

namespace weave {
namespace {

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::vector<std::string> split_key(const std::string& key) {
  std::vector<std::string> parts;
  std::istringstream stream(key);
  for (std::string part; std::getline(stream, part, '.');) parts.push_back(part);
  return parts;
}

/// The other ways to give a key's quantity: an override of one replaces whichever way the file uses.
std::string_view alternative_of(const std::string& key) {
  constexpr std::pair<std::string_view, std::string_view> pairs[] = {{"height", "height_ratio"},
                                                                     {"dent_width", "dents_per_length"},
                                                                     {"length", "rate"},
                                                                     {"yarn", "yarn_of_layer"},
                                                                     {"positions", "matrix"}};
  for (const auto& [a, b] : pairs) {
    if (key == a) return b;
    if (key == b) return a;
  }
  return "";
}

toml::node* child(toml::node& parent, const std::string& part) {
  if (toml::table* table = parent.as_table()) {
    if (!table->contains(part)) table->insert(part, toml::table{});
    return table->get(part);
  }
  std::size_t index = 0;
  const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), index);
  const bool is_index = status == std::errc() && end == part.data() + part.size();
  toml::array* array = parent.as_array();
  return array && is_index ? array->get(index) : nullptr;
}

void apply_override(toml::table& root, const std::string& assignment, Mistakes& mistakes) {
  const auto equals = assignment.find('=');
  const std::string key = trimmed(assignment.substr(0, equals));
  if (equals == std::string::npos || key.empty() || key.back() == '.') {
    mistakes.add(0, assignment, "(missing)", "an override must read key.path=value");
    return;
  }
  const std::string value = trimmed(assignment.substr(equals + 1));
  toml::table parsed;
  try {
    parsed = toml::parse(fmt::format("value = {}", value));
  } catch (const toml::parse_error&) {
    parsed.clear();
  }
  if (parsed.size() != 1) {
    parsed.clear();
    parsed.insert("value", value);
  }

  const std::vector<std::string> parts = split_key(key);
  toml::node* parent = &root;
  for (std::size_t i = 0; parent && i + 1 < parts.size(); ++i) parent = child(*parent, parts[i]);
  toml::table* table = parent ? parent->as_table() : nullptr;
  if (!table) {
    mistakes.add(0, key, value, "the key's path does not lead to a table of the case");
    return;
  }
  if (const std::string_view other = alternative_of(parts.back()); !other.empty()) table->erase(other);
  // Inserted as a copy: copies carry no place in a file, which marks them as overrides.
  const toml::node& node = *parsed.get("value");
  table->insert_or_assign(parts.back(), node);
}

// ---------------------------------------------------------------------------------------------------------------- the tables of a case

bool is_fiber_count(int n) {
  if (n == 1 || n == 3 || n == 5) return true;
  for (int k = 1; 3 * k * (k + 1) + 1 <= n; ++k) {
    if (3 * k * (k + 1) + 1 == n) return true;
  }
  return false;
}

/// Fiber materials by name, each checked by itself and as a whole.
void read_materials(TableReader table, Case& c) {
  for (auto& [name, material] : table.named_tables()) {
    TransverseIsotropic& m = c.materials[name];
    m.e1 = material.quantity("e1", Dimension::pressure, positive);
    m.e2 = material.quantity("e2", Dimension::pressure, positive);
    m.g12 = material.quantity("g12", Dimension::pressure, positive);
    m.nu12 = material.quantity("nu12", Dimension::number, {-1, 5, true});
    m.nu23 = material.quantity("nu23", Dimension::number, {-1, 1, true, true});
    if (std::abs(m.nu12) >= m.nu12_bound()) {
      material.mistake("nu12", fmt::format("must be within +-sqrt((1 - nu23) e1 / (2 e2)) = {:.6g}, or the strain energy is not positive",
                                           m.nu12_bound()));
    }
    material.report_unknown();
    for (const KnownFiber& known : known_fibers()) {
      if (name == known.name) table.mistake(name, "is the name of a known fiber; choose another");
    }
  }
}

void check_material_name(const Case& c, const std::string& name, TableReader& table) {
  std::vector<std::string> names;
  for (const KnownFiber& fiber : known_fibers()) names.emplace_back(fiber.name);
  for (const auto& [own, constants] : c.materials) names.push_back(own);
  if (std::find(names.begin(), names.end(), name) != names.end()) return;
  table.mistake("material", fmt::format("unknown material; known ones: {}, and those of tables [material.NAME]", fmt::join(names, ", ")));
}

YarnType read_yarn(const std::string& name, const Case& c, TableReader& table) {
  YarnType yarn;
  yarn.name = name;
  yarn.linear_density = table.quantity("linear_density", Dimension::linear_density, positive);
  yarn.density = table.quantity("density", Dimension::density, positive);
  yarn.youngs_modulus = table.quantity("youngs_modulus", Dimension::pressure, positive);
  yarn.transverse_modulus = table.quantity("transverse_modulus", Dimension::pressure, positive, yarn.transverse_modulus);
  yarn.packing = table.quantity("packing", Dimension::number, positive_fraction, yarn.packing);
  yarn.compression_factor = table.quantity("compression_factor", Dimension::number, fraction, yarn.compression_factor);
  yarn.bending_stiffness = table.quantity("bending_stiffness", Dimension::bending_stiffness, not_negative, yarn.bending_stiffness);
  yarn.friction_within = table.quantity("friction_within", Dimension::number, {0, 10}, c.friction);
  yarn.fibers = table.integer("fibers", 1, 100000, yarn.fibers);
  if (yarn.fibers != wrong_integer && !is_fiber_count(yarn.fibers)) {
    table.mistake("fibers", "must be 1, 3, 5 or a centred hexagonal number 7, 19, 37, 61, 91, 127, ...");
  }
  yarn.material = table.text("material", yarn.material);
  if (!yarn.material.empty()) check_material_name(c, yarn.material, table);
  table.report_unknown();
  return yarn;
}

/// Warp positions, each entry checked against 0...layers where `layers` is known; empty if anything is wrong.
PositionMatrix read_positions(TableReader& table, int layers) {
  const toml::array* rows = table.find("positions")->as_array();
  if (!rows || rows->empty() || !rows->is_homogeneous(toml::node_type::array)) {
    table.mistake("positions", "expected one list per warp, each with one integer per weft column");
    return {};
  }
  const std::size_t columns = rows->get(0)->ref<toml::array>().size();
  PositionMatrix positions(static_cast<Eigen::Index>(rows->size()), static_cast<Eigen::Index>(columns));
  bool good = columns > 0;
  if (!good) table.mistake("positions", "expected at least one weft column");
  for (std::size_t warp = 0; warp < rows->size(); ++warp) {
    const toml::array& row = rows->get(warp)->ref<toml::array>();
    const std::string row_key = fmt::format("{}[{}]", table.full_key("positions"), warp);
    if (row.size() != columns) {
      table.mistakes().add(line_of(row), row_key, value_text(row),
                           fmt::format("has {} entries, the first warp has {}", row.size(), columns));
      good = false;
      continue;
    }
    for (std::size_t column = 0; column < columns; ++column) {
      const toml::node& entry = *row.get(column);
      const std::int64_t p = entry.is_integer() ? entry.ref<std::int64_t>() : -1;
      const std::int64_t highest = layers == wrong_integer ? std::numeric_limits<int>::max() : layers;
      if (p < 0 || p > highest) {
        table.mistakes().add(line_of(entry), fmt::format("{}[{}]", row_key, column), value_text(entry),
                             fmt::format("must be an integer from 0 to {} (fabric.layers)", highest));
        good = false;
        continue;
      }
      positions(static_cast<Eigen::Index>(warp), static_cast<Eigen::Index>(column)) = static_cast<int>(p);
    }
  }
  return good ? positions : PositionMatrix{};
}

WeavingMatrix read_matrix(TableReader& table) {
  const std::vector<std::string> rows = table.texts("matrix");
  if (rows.empty()) return {};
  try {
    return weaving_matrix_from_rows(rows);
  } catch (const std::invalid_argument& error) {
    table.mistake("matrix", error.what());
    return {};
  }
}

void check_yarn_name(const Case& c, const std::string& name, std::string_view key, TableReader& table) {
  if (c.yarns.contains(name)) return;
  std::vector<std::string> names;
  for (const auto& [known, yarn] : c.yarns) names.push_back(known);
  table.mistake(
      key, fmt::format("unknown yarn \"{}\"; known ones: {}", name, names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
}

void read_sections(std::vector<TableReader>& tables, Case& c) {
  for (TableReader& table : tables) {
    WarpSection section;
    section.yarn = table.text("yarn");
    if (!section.yarn.empty()) check_yarn_name(c, section.yarn, "yarn", table);
    section.dent = table.integer("dent", 0, 9999, tables.size() == 1 ? std::optional(0) : std::nullopt);
    section.tension = table.quantity("tension", Dimension::force, positive, c.loom.tension);
    if (table.first_of("positions", "matrix", true)) {
      const PositionMatrix positions = read_positions(table, c.layers);
      if (c.layers != wrong_integer && positions.size() > 0)
        section.matrix = weaving_matrix_from_positions(positions, c.layers, c.insertion_order);
    } else if (table.find("matrix") && !table.find("positions")) {
      section.matrix = read_matrix(table);
    }
    table.report_unknown();
    c.sections.push_back(section);
  }
}

void read_weft(TableReader table, Case& c) {
  if (table.first_of("yarn", "yarn_of_layer", true)) {
    const std::string yarn = table.text("yarn");
    if (!yarn.empty()) check_yarn_name(c, yarn, "yarn", table);
    if (c.layers != wrong_integer) c.weft.yarn_of_layer.assign(static_cast<std::size_t>(c.layers), yarn);
  } else if (table.find("yarn_of_layer") && !table.find("yarn")) {
    c.weft.yarn_of_layer = table.texts("yarn_of_layer");
    for (const std::string& yarn : c.weft.yarn_of_layer) check_yarn_name(c, yarn, "yarn_of_layer", table);
    const std::size_t given = c.weft.yarn_of_layer.size();
    if (given > 0 && c.layers != wrong_integer && given != static_cast<std::size_t>(c.layers)) {
      table.mistake("yarn_of_layer", fmt::format("names {} yarns; must name {} (fabric.layers)", given, c.layers));
    }
  }
  c.weft.length_coefficient = table.quantity("length_coefficient", Dimension::number, {0.5, 2}, c.weft.length_coefficient);
  table.report_unknown();
}

void read_loom(TableReader& table, LoomSpec& loom) {
  loom.length = table.quantity("length", Dimension::length, length_bounds, loom.length);
  table.first_of("height", "height_ratio", false);
  const double ratio = table.quantity("height_ratio", Dimension::number, positive, 0.7);
  loom.height = table.quantity("height", Dimension::length, length_bounds, ratio * loom.length);
  if (loom.height > length_bounds.high) {
    table.mistake("height_ratio", fmt::format("makes the loom {:.6g} m high; must be <= {} m", loom.height, length_bounds.high));
  }
  const double per_length = table.quantity("dents_per_length", Dimension::per_length, per_length_bounds, wrong_number);
  loom.dent_width = table.first_of("dent_width", "dents_per_length", true) ? table.quantity("dent_width", Dimension::length, length_bounds)
                                                                           : 1 / per_length;
  loom.tension = table.quantity("tension", Dimension::force, positive, loom.tension);
  loom.reed_bar_radius = table.quantity("reed_bar_radius", Dimension::length, length_bounds, loom.reed_bar_radius);
  table.report_unknown();
}

void read_beat_up(TableReader& table, double loom_length, BeatUpSpec& beat_up) {
  beat_up.enabled = table.boolean("enabled", beat_up.enabled);
  beat_up.travel = table.quantity("travel", Dimension::length, length_bounds, 0.7 * loom_length);
  if (beat_up.travel > loom_length) {
    table.mistake("travel", fmt::format("must be <= {:.6g} m (loom.length): the reed moves between fell and heddles", loom_length));
    beat_up.travel = wrong_number;
  }
  beat_up.top_speed = table.quantity("top_speed", Dimension::speed, speed_bounds, beat_up.top_speed);
  beat_up.dwell = table.quantity("dwell", Dimension::time, not_negative, beat_up.dwell);
  beat_up.return_time = table.quantity("return_time", Dimension::time, positive, 2 * beat_up.travel / beat_up.top_speed);
  beat_up.return_delay = table.quantity("return_delay", Dimension::number, fraction, beat_up.return_delay);
  table.report_unknown();
}

void read_insertion(TableReader& table, double loom_length, double travel, InsertionSpec& insertion) {
  insertion.distance = table.quantity("distance", Dimension::length, length_bounds, 0.45 * loom_length);
  if (insertion.distance >= travel) {
    table.mistake("distance", fmt::format("must be < {:.6g} m (beat_up.travel): the reed starts behind the weft", travel),
                  fmt::format("{}", insertion.distance));
  }
  insertion.time = table.quantity("time", Dimension::time, positive, insertion.time);
  table.report_unknown();
}

void read_take_up(TableReader& table, int layers, TakeUpSpec& take_up) {
  const double rate = table.quantity("rate", Dimension::per_length, per_length_bounds, wrong_number);
  take_up.length = table.first_of("length", "rate", true) ? table.quantity("length", Dimension::length, length_bounds) : 1 / rate;
  take_up.flags = table.integer("flags", 1, 10000, take_up.flags);
  if (layers != wrong_integer && take_up.flags != wrong_integer && layers % take_up.flags != 0) {
    table.mistake("flags", fmt::format("must divide fabric.layers = {}", layers));
  }
  take_up.time = table.quantity("time", Dimension::time, positive, take_up.time);
  table.report_unknown();
}

void read_numerics(TableReader table, NumericsSpec& numerics) {
  numerics.element_length = table.quantity("element_length", Dimension::number, {0.05, 100}, numerics.element_length);
  numerics.contact = table.choice("contact", {"line", "node"}, numerics.contact);
  numerics.integrator = table.choice("integrator", {"imex", "explicit"}, numerics.integrator);
  numerics.time_step = table.quantity("time_step", Dimension::time, not_negative, numerics.time_step);
  numerics.safety = table.quantity("safety", Dimension::number, positive_fraction, numerics.safety);
  numerics.damping = table.quantity("damping", Dimension::per_time, not_negative, numerics.damping);
  numerics.axial_damping = table.quantity("axial_damping", Dimension::number, not_negative, numerics.axial_damping);
  numerics.skin = table.quantity("skin", Dimension::number, {0, 10, true}, numerics.skin);
  numerics.outer_skin = table.quantity("outer_skin", Dimension::number, {0, 10, true}, numerics.outer_skin);
  table.report_unknown();
}

void read_output(TableReader table, OutputSpec& output) {
  output.checkpoint_interval = table.quantity("checkpoint_interval", Dimension::time, positive, output.checkpoint_interval);
  output.history_interval = table.quantity("history_interval", Dimension::time, not_negative, output.history_interval);
  table.report_unknown();
}

// ---------------------------------------------------------------------------------------------------------------- checks across tables

std::string_view pattern_key(TableReader& section) {
  return section.find("positions") ? "positions" : "matrix";
}

/// Sets the columns of a cell from the sections' patterns, and checks that they agree with one another and with fabric.columns.
void check_picks(TableReader& fabric, std::vector<TableReader>& sections, Case& c) {
  const int given_columns = fabric.integer("columns", 1, 10000, 0);
  if (c.layers == wrong_integer || given_columns == wrong_integer) return;
  Eigen::Index picks = static_cast<Eigen::Index>(given_columns) * c.layers;
  std::string reason = fmt::format("fabric.layers * fabric.columns = {} * {}", c.layers, given_columns);
  for (std::size_t i = 0; i < c.sections.size(); ++i) {
    const Eigen::Index rows = c.sections[i].matrix.rows();
    if (rows == 0) continue;
    const std::string_view key = pattern_key(sections[i]);
    if (rows % c.layers != 0) {
      sections[i].mistake(key, fmt::format("has {} picks; must be a multiple of fabric.layers = {}", rows, c.layers));
    } else if (picks == 0) {
      picks = rows;
      reason = sections[i].full_key(key);
    } else if (rows != picks) {
      sections[i].mistake(key, fmt::format("has {} picks; must have {} ({})", rows, picks, reason));
    }
  }
  c.columns = static_cast<int>(picks) / c.layers;
  if (c.insertion_order == InsertionOrder::alternating && c.columns % 2 != 0) {
    fabric.mistake("insertion_order", fmt::format("needs an even number of weft columns in the cell, which has {}", c.columns));
  }
  const std::int64_t kept_columns = std::int64_t{c.kept_cells} * c.columns;
  if (c.columns_behind_fell > kept_columns) {
    fabric.mistake("columns_behind_fell",
                   fmt::format("must be <= {} (fabric.kept_cells times the weft columns of a cell): farther behind no "
                               "whole cell stays on the loom",
                               kept_columns));
  }
  constexpr std::int64_t picks_most = 1000000000;
  if (c.cells > picks_most / std::max<Eigen::Index>(picks, 1))
    fabric.mistake("cells", fmt::format("must be <= {} with {} picks a cell", picks_most / picks, picks));
}

/// A warp that the loom's tension would stretch by more than this is no yarn: most likely its modulus has another unit.
constexpr double strain_most = 0.5;

void check_strains(TableReader& yarns, const Case& c) {
  for (const auto& [name, y] : c.yarns) {
    double tension = 0;
    for (const WarpSection& section : c.sections) {
      if (section.yarn == name) tension = std::max(tension, section.tension > 0 ? section.tension : c.loom.tension);
    }
    const double strain = tension / (y.youngs_modulus * y.fiber_area() * y.fibers);
    if (y.youngs_modulus > 0 && y.fiber_area() > 0 && strain > strain_most)
      yarns.mistake(name, fmt::format("would be stretched by {:.3g} % under {:.4g} N with a modulus of {:.4g} Pa; must be <= {:g} %",
                                      100 * strain, tension, y.youngs_modulus, 100 * strain_most));
  }
}

/// Every pick needs an open shed: warps of the fabric both up and down.
void check_sheds(std::vector<TableReader>& sections, const Case& c) {
  for (const WarpSection& section : c.sections) {
    if (section.matrix.rows() != c.picks_per_cell()) return;
  }
  if (c.sections.empty()) return;
  const WeavingMatrix fabric = c.matrix();
  for (Eigen::Index pick = 0; pick < fabric.rows(); ++pick) {
    if (fabric.row(pick).minCoeff() != fabric.row(pick).maxCoeff()) continue;
    sections[0].mistake(pattern_key(sections[0]), fmt::format("at pick {} (0-based) all {} warps of the fabric are {}: no shed opens", pick,
                                                              fabric.cols(), fabric(pick, 0) > 0 ? "up" : "down"));
  }
}

/// The dents of a cell count from 0 without gaps, and the warps of each pass between its reed bars.
void check_dents(TableReader& loom_table, std::vector<TableReader>& tables, const Case& c) {
  std::vector<int> dents;
  for (const WarpSection& section : c.sections) {
    if (section.dent == wrong_integer) return;
    dents.push_back(section.dent);
  }
  std::sort(dents.begin(), dents.end());
  int next = 0;
  for (const int dent : dents) {
    if (dent > next) {
      const auto above = std::find_if(c.sections.begin(), c.sections.end(), [&](const WarpSection& s) { return s.dent == dent; });
      tables[static_cast<std::size_t>(above - c.sections.begin())].mistake(
          "dent", fmt::format("must be <= {}: dents count from 0 without gaps, and dent {} has no section", next, next));
      return;
    }
    next = dent + 1;
  }

  const double opening = c.loom.dent_width - 2 * c.loom.reed_bar_radius;
  if (opening <= 0) {
    loom_table.mistake("reed_bar_radius",
                       fmt::format("must be < {:.6g} m (half of loom.dent_width): the reed bars fill the dent", c.loom.dent_width / 2),
                       fmt::format("{}", c.loom.reed_bar_radius));
    return;
  }
  double widest = 0;
  int tightest_dent = 0;
  for (int dent = 0; dent < c.dents(); ++dent) {
    // The least that a section needs is one fiber's diameter across and its fibers' area, closely packed, in the height of the loom.
    double width = 0, area = 0;
    for (const WarpSection& section : c.sections) {
      const auto yarn = c.yarns.find(section.yarn);
      if (section.dent != dent || yarn == c.yarns.end()) continue;
      const double radius = yarn->second.fiber_radius();
      width += 2 * radius;
      area += static_cast<double>(section.matrix.cols()) * yarn->second.fibers * 2 * std::numbers::sqrt3 * radius * radius;
    }
    const double needed = std::max(width, area / c.loom.height);
    if (needed > widest) {
      widest = needed;
      tightest_dent = dent;
    }
  }
  if (widest > opening) {
    loom_table.mistake(
        loom_table.find("dents_per_length") ? "dents_per_length" : "dent_width",
        fmt::format("the warps of dent {} can not fit: the dent is {:.6g} m wide and must be >= {:.6g} m, {:.6g} m for the fibers and "
                    "{:.6g} m for the reed bars",
                    tightest_dent, c.loom.dent_width, widest + 2 * c.loom.reed_bar_radius, widest, 2 * c.loom.reed_bar_radius));
  }
}

/// Fiber volume of a cell over its area, crimp neglected: the thickness that the cloth would have without voids [m].
double solid_thickness(const Case& c) {
  double thickness = 0;
  for (const WarpSection& section : c.sections) {
    const auto yarn = c.yarns.find(section.yarn);
    if (yarn == c.yarns.end() || section.dent == wrong_integer) return wrong_number;
    thickness += static_cast<double>(section.matrix.cols()) * yarn->second.fibers * yarn->second.fiber_area() / c.cell_width();
  }
  for (const std::string& name : c.weft.yarn_of_layer) {
    const auto yarn = c.yarns.find(name);
    if (yarn == c.yarns.end()) return wrong_number;
    thickness += yarn->second.fibers * yarn->second.fiber_area() / c.take_up.length;
  }
  return thickness;
}

void check_height(TableReader& loom_table, const Case& c) {
  const double thickness = solid_thickness(c);
  if (!(c.loom.height < 2 * thickness)) return;
  const std::string_view key = loom_table.find("height_ratio") ? "height_ratio" : "height";
  loom_table.mistake(
      key,
      fmt::format("the height {:.6g} m must be >= {:.6g} m, twice the cloth's solid thickness {:.6g} m (fiber volume / cell area)",
                  c.loom.height, 2 * thickness, thickness),
      fmt::format("{}", c.loom.height));
}

}  // namespace

Case parse_case(const std::string& text, const std::string& file, const std::vector<std::string>& overrides) {
  toml::table root;
  try {
    root = toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    throw CaseError(fmt::format("{}:{}: not TOML: {}", file, error.source().begin.line, on_one_line(error.description())));
  }
  Mistakes mistakes(file);
  for (const std::string& assignment : overrides) apply_override(root, assignment, mistakes);

  Case c;
  TableReader top(&root, "", 1, mistakes);
  c.name = top.text("name");
  c.title = top.text("title", c.name);
  TableReader fabric = top.table("fabric");
  c.layers = fabric.integer("layers", 1, 10000);
  if (fabric.choice("insertion_order", {"top_first", "alternating"}, "top_first") == "alternating") {
    c.insertion_order = InsertionOrder::alternating;
  }
  c.cells = fabric.integer("cells", 1, 1000000, c.cells);
  c.kept_cells = fabric.integer("kept_cells", 1, 1000000, c.kept_cells);
  c.columns_behind_fell = fabric.integer("columns_behind_fell", 0, 1000000, c.columns_behind_fell);
  c.friction = fabric.quantity("friction", Dimension::number, {0, 10}, c.friction);

  read_materials(top.table("material"), c);
  TableReader yarns = top.table("yarns");
  for (auto& [name, table] : yarns.named_tables()) c.yarns[name] = read_yarn(name, c, table);
  if (c.yarns.empty()) top.mistake("yarns", "at least one yarn [yarns.NAME] is needed");

  TableReader loom = top.table("loom");
  read_loom(loom, c.loom);
  std::vector<TableReader> sections = top.tables("section");
  read_sections(sections, c);
  read_weft(top.table("weft"), c);
  TableReader beat_up = top.table("beat_up"), insertion = top.table("insertion"), take_up = top.table("take_up");
  read_beat_up(beat_up, c.loom.length, c.beat_up);
  read_insertion(insertion, c.loom.length, c.beat_up.travel, c.insertion);
  read_take_up(take_up, c.layers, c.take_up);
  TableReader shedding = top.table("shedding"), settle = top.table("settle");
  c.shedding.time = shedding.quantity("time", Dimension::time, positive, c.shedding.time);
  shedding.report_unknown();
  c.settle_time = settle.quantity("time", Dimension::time, not_negative, c.settle_time);
  settle.report_unknown();
  read_numerics(top.table("numerics"), c.numerics);
  read_output(top.table("output"), c.output);
  if (top.find("matrix")) {
    TableReader matrix = top.table("matrix");
    c.matrix_material = {matrix.quantity("e", Dimension::pressure, positive),
                         matrix.quantity("nu", Dimension::number, {-1, 0.5, true, true})};
    matrix.report_unknown();
  }
  top.report_unknown();

  check_picks(fabric, sections, c);
  fabric.report_unknown();
  check_strains(yarns, c);
  check_sheds(sections, c);
  check_dents(loom, sections, c);
  check_height(loom, c);
  mistakes.throw_if_any();
  return c;
}

}  // namespace weave
