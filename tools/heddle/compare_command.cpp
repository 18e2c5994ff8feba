#include "heddle/compare_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "heddle/section_views.hpp"
#include "relax/compare.hpp"
#include "relax/report.hpp"
#include "relax/version.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;
using relax::ComparedState;

constexpr int name_width = 30, column_width = 14;  ///< of the table

/// Two states, by their place in the list, and how the second differs from the first.
struct Pair {
  std::size_t a = 0, b = 0;
  relax::Difference difference;
};

/// All pairs of states. Adds to `layers` each state as it lies over the first one.
std::vector<Pair> pairs_of(const std::vector<ComparedState>& states, std::vector<SectionLayer>& layers) {
  std::vector<Pair> pairs;
  layers.push_back({states.front().snapshot, states.front().name});
  for (std::size_t a = 0; a < states.size(); ++a) {
    for (std::size_t b = a + 1; b < states.size(); ++b) {
      relax::Aligned aligned = relax::align(states[a], states[b]);
      pairs.push_back({a, b, relax::difference(states[a], states[b], aligned)});
      if (a == 0) layers.push_back({std::move(aligned.snapshot), states[b].name});
    }
  }
  return pairs;
}

/// The relaxed states and, last, the woven one, all of one cell and named so that they can be told apart.
std::vector<ComparedState> read_states(const CompareOptions& options) {
  if (options.results.size() + !options.woven.empty() < 2)
    throw std::invalid_argument("compare: needs two relaxed results, or one and the woven cell that it started from (--woven)");
  std::vector<ComparedState> states;
  for (const std::filesystem::path& folder : options.results) states.push_back(relax::read_relaxed_state(folder));
  if (!options.woven.empty()) {
    states.push_back(relax::read_woven_state(options.woven));
    states.back().name = "woven";
  }
  for (const ComparedState& state : states) relax::expect_comparable(states.front(), state);
  // Results of one kind stand in folders of one name: their parents tell them apart, or the whole path does.
  for (const bool whole : {false, true}) {
    std::map<std::string, int> count;
    for (const ComparedState& state : states) ++count[state.name];
    for (std::size_t i = 0; i < options.results.size(); ++i) {
      if (count[states[i].name] == 1) continue;
      const std::filesystem::path folder = std::filesystem::absolute(options.results[i] / "").lexically_normal().parent_path();
      states[i].name = whole ? folder.string() : (folder.parent_path().filename() / folder.filename()).string();
    }
  }
  return states;
}

struct Figure {
  std::string name;  ///< with unit
  std::function<std::string(const ComparedState&)> text;
};

std::vector<Figure> figures() {
  const auto energy = [](auto&& part) {
    return [part](const ComparedState& s) { return s.relaxed ? fmt::format("{:.6g}", part(s)) : std::string("-"); };
  };
  const auto finding = [](double relax::Certificate::*part) {
    return [part](const ComparedState& s) { return s.relaxed ? fmt::format("{:.2e}", s.certificate.*part) : std::string("-"); };
  };
  return {
      {"fibers a yarn", [](const ComparedState& s) { return fmt::format("{}", s.fibers_per_yarn()); }},
      {"nodes", [](const ComparedState& s) { return fmt::format("{}", s.cell.nodes()); }},
      {"energy of bars [J]", energy([](const ComparedState& s) { return s.energy.bars; })},
      {"energy of contact [J]", energy([](const ComparedState& s) { return s.energy.contact; })},
      {"energy of bending [J]", energy([](const ComparedState& s) { return s.energy.bending; })},
      {"work of tensions [J]", energy([](const ComparedState& s) { return s.energy.tension; })},
      {"energy of platens [J]", energy([](const ComparedState& s) { return s.energy.platens; })},
      {"energy of loads [J]", energy([](const ComparedState& s) { return s.energy.loads; })},
      {"energy in all [J]", energy([](const ComparedState& s) { return s.energy.sum(); })},
      {"with loads from no length [J]", energy([](const ComparedState& s) { return s.potential(); })},
      {"error of the energy [J]", energy([](const ComparedState& s) { return s.energy_error(); })},
      {"cell along x [mm]", [](const ComparedState& s) { return fmt::format("{:.5g}", 1e3 * s.snapshot.cell_length); }},
      {"cell along y [mm]", [](const ComparedState& s) { return fmt::format("{:.5g}", 1e3 * s.snapshot.cell_width); }},
      {"thickness [mm]", [](const ComparedState& s) { return fmt::format("{:.5g}", 1e3 * s.measures.thickness); }},
      {"of the mean envelopes [mm]", [](const ComparedState& s) { return fmt::format("{:.5g}", 1e3 * s.measures.thickness_mean); }},
      {"fiber volume fraction", [](const ComparedState& s) { return fmt::format("{:.4f}", s.measures.fiber_volume_fraction); }},
      {"crimp of warps [%]", [](const ComparedState& s) { return fmt::format("{:.3f}", 1e2 * s.measures.crimp_warp); }},
      {"crimp of wefts [%]", [](const ComparedState& s) { return fmt::format("{:.3f}", 1e2 * s.measures.crimp_weft); }},
      {"certified minimum", [](const ComparedState& s) { return std::string(!s.relaxed                ? "-"
                                                                            : s.certificate.converged ? "yes"
                                                                                                      : "no"); }},
      {"gradient [reference tension]", finding(&relax::Certificate::gradient_max)},
      {"Newton step [diameters]", finding(&relax::Certificate::newton_step_max)},
      {"pins hold [reference tension]", finding(&relax::Certificate::pin_force_max)},
  };
}

void print_states(const std::vector<ComparedState>& states) {
  std::size_t width = column_width;
  for (const ComparedState& s : states) width = std::max(width, s.name.size() + 2);
  fmt::print("{:<{}}", "", name_width);
  for (const ComparedState& s : states) fmt::print("{:>{}}", s.name, width);
  fmt::print("\n");
  for (const Figure& figure : figures()) {
    fmt::print("{:<{}}", figure.name, name_width);
    for (const ComparedState& s : states) fmt::print("{:>{}}", figure.text(s), width);
    fmt::print("\n");
  }
  for (const ComparedState& s : states) {
    if (s.relaxed && !s.certificate.converged) fmt::print("{} is no certified minimum: {}\n", s.name, s.certificate.blocked_by);
  }
}

void print_pair(const ComparedState& a, const ComparedState& b, const relax::Difference& d) {
  fmt::print("{} and {}:\n", a.name, b.name);
  constexpr double round_off = 1e-9;
  if (std::abs(d.cell_length) > round_off || std::abs(d.cell_width) > round_off) {
    fmt::print("  the cell of {} is longer by {:.4g} %, wider by {:.4g} %, which is drawn out of what follows\n", b.name,
               100 * d.cell_length, 100 * d.cell_width);
  }
  fmt::print("  moved by {:.4g}, {:.4g}, {:.4g} mm; then, mean and largest in fiber diameters: yarn paths {:.4g}, {:.4g}",
             1e3 * d.shift.x(), 1e3 * d.shift.y(), 1e3 * d.shift.z(), d.path.mean, d.path.largest);
  if (d.fibers) fmt::print("; fibers {:.4g}, {:.4g}", d.fibers->mean, d.fibers->largest);
  fmt::print("; widths {:.4g}, {:.4g}; heights {:.4g}, {:.4g}\n", d.width.mean, d.width.largest, d.height.mean, d.height.largest);
  if (!a.relaxed || !b.relaxed) return;
  fmt::print("  energies differ by {:.4g} J, known to {:.2g} J: {}\n", b.potential() - a.potential(), a.energy_error() + b.energy_error(),
             text_of(verdict(a, b, d)));
}

/// Name of the relaxed state whose yarns run nearest to the woven ones, on the average, once the cell's lengths are drawn out; empty
/// without a woven state.
std::string closest_to_woven(const std::vector<ComparedState>& states, const std::vector<Pair>& pairs) {
  const Pair* closest = nullptr;
  for (const Pair& p : pairs) {
    if (states[p.b].relaxed || (closest && closest->difference.path.mean <= p.difference.path.mean)) continue;
    closest = &p;
  }
  return closest ? states[closest->a].name : "";
}

ordered_json finite(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json();
}

ordered_json json_of(const ComparedState& s) {
  ordered_json j;
  j["name"] = s.name;
  j["file"] = s.file.string();
  j["kind"] = s.relaxed ? "relaxed" : "woven";
  j["fibers_per_yarn"] = s.fibers_per_yarn();
  j["nodes"] = s.cell.nodes();
  j["cell_length_m"] = s.snapshot.cell_length;
  j["cell_width_m"] = s.snapshot.cell_width;
  for (const auto& [name, value] : weave::named(s.measures)) j[name] = value;
  if (!s.relaxed) return j;
  for (const auto& [name, value] : relax::named(s.energy)) j["energy_J"][name] = value;
  j["potential_J"] = s.potential();
  j["energy_error_J"] = finite(s.energy_error());
  relax::each_finding(s.certificate, [&](const char* key, const auto& value) { j["certificate"][key] = value; });
  return j;
}

ordered_json json_of(const relax::MeanAndLargest& figure) {
  return {{"mean", figure.mean}, {"largest", figure.largest}};
}

ordered_json json_of(const ComparedState& a, const ComparedState& b, const relax::Difference& d) {
  ordered_json j;
  j["a"] = a.name;
  j["b"] = b.name;
  j["cell_length_ratio"] = 1 + d.cell_length;
  j["cell_width_ratio"] = 1 + d.cell_width;
  j["shift_m"] = {d.shift.x(), d.shift.y(), d.shift.z()};
  j["path_diameters"] = json_of(d.path);
  j["width_diameters"] = json_of(d.width);
  j["height_diameters"] = json_of(d.height);
  j["fibers_diameters"] = d.fibers ? json_of(*d.fibers) : ordered_json();
  if (!a.relaxed || !b.relaxed) return j;
  j["energy_difference_J"] = b.potential() - a.potential();
  j["energy_error_J"] = finite(a.energy_error() + b.energy_error());
  const relax::Verdict v = verdict(a, b, d);
  const bool comparable = v != relax::Verdict::other_potential && v != relax::Verdict::not_certified;
  j["different_minima"] = comparable ? ordered_json(v != relax::Verdict::same) : ordered_json();
  j["verdict"] = text_of(v);
  return j;
}

}  // namespace

int compare_command(const CompareOptions& options) {
  const std::vector<ComparedState> states = read_states(options);
  std::vector<SectionLayer> layers;
  const std::vector<Pair> pairs = pairs_of(states, layers);
  const std::string closest = closest_to_woven(states, pairs);
  const std::filesystem::path output = options.output.empty() ? std::filesystem::path("results") / "comparison" : options.output;
  std::filesystem::create_directories(output);

  ordered_json j;
  j["tool"] = "compare";
  j["case"] = states.front().case_name;
  j["version"] = relax::version();
  for (const ComparedState& s : states) j["states"].push_back(json_of(s));
  for (const Pair& p : pairs) j["pairs"].push_back(json_of(states[p.a], states[p.b], p.difference));
  if (!closest.empty()) j["closest_to_woven"] = closest;
  weave::write_text_file(output / "summary.json", j.dump(2) + "\n");

  const std::vector<std::filesystem::path> pictures = draw_section_overlays(layers, states.front().case_toml, output);

  print_states(states);
  for (const Pair& p : pairs) print_pair(states[p.a], states[p.b], p.difference);
  if (!closest.empty()) fmt::print("closest to the woven cell: {}\n", closest);
  fmt::print("{} pictures and summary.json in {}\n", pictures.size(), output.string());
  return 0;
}

}  // namespace heddle
