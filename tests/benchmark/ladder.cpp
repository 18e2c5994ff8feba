// Run time against error: scenes at a ladder of settings, each judged by its error against a closed form or a far finer run.
//     heddle_ladder FOLDER [WORD]
// Writes ladder.md, a table for each scene with the Pareto front marked, ladder.csv and ladder.png into FOLDER; with WORD only the scenes
// whose name holds it. Each setting runs in a process of its own, on one thread, which tells the processor's time and the memory.
#include <fmt/format.h>
#include <fmt/os.h>
#include <omp.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "heddle/picture.hpp"
#include "heddle/plot.hpp"
#include "relax/minimize.hpp"
#include "relax/report.hpp"
#include "scenes/belt.hpp"
#include "scenes/cells.hpp"
#include "stress/contact_sweeps.hpp"
#include "stress/loom_sweeps.hpp"
#include "weave/measures.hpp"
#include "weave/weaving_run.hpp"

namespace {

/// What a scene gives at one setting.
struct Figures {
  std::vector<double> value;  ///< by quantity of the scene; empty if it gave none
  std::vector<double> curve;  ///< what the last quantity is the root mean square of; empty: it is a number like the others
  std::int64_t steps = 0;
  std::size_t nodes = 0;
  std::string message;  ///< why it gave none
  double seconds = 0;   ///< of the processor
  double memory = 0;    ///< at most [bytes]
};
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Figures, value, curve, steps, nodes, message)

struct Setting {
  std::string name;
  std::function<Figures()> run;
  bool on_ladder = true;  ///< may be on the front; not if it is another scene, or a second run that shows how far chaos carries
};

struct Scene {
  std::string name;
  std::vector<std::string> quantities;
  std::vector<double> truth;      ///< by quantity; empty: the first setting is the reference
  std::vector<Setting> settings;  ///< the default among them is named "default"
};

struct Row {
  std::string scene, setting;
  Figures figures;
  std::vector<double> error;  ///< relative, by quantity
  bool on_ladder = true, on_front = false;
  bool reference = false;
  [[nodiscard]] double worst() const { return error.empty() ? std::numeric_limits<double>::infinity() : *std::ranges::max_element(error); }
};

/// Runs a setting in a process of its own.
Figures run_apart(const Setting& setting) {
  std::array<int, 2> ends{};
  std::fflush(stdout);
  if (::pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("no process");
  if (child == 0) {
    Figures f;
    try {
      f = setting.run();
    } catch (const std::exception& error) {
      f.message = error.what();
    }
    const std::string text = nlohmann::json(f).dump();
    const bool written = ::write(ends[1], text.data(), text.size()) == static_cast<ssize_t>(text.size());
    ::_exit(written ? 0 : 1);
  }
  ::close(ends[1]);
  std::string text;
  std::array<char, 4096> piece{};
  for (ssize_t n = 0; (n = ::read(ends[0], piece.data(), piece.size())) > 0;) text.append(piece.data(), static_cast<std::size_t>(n));
  ::close(ends[0]);
  int status = 0;
  rusage used{};
  ::wait4(child, &status, 0, &used);
  Figures f;
  if (status == 0) {
    f = nlohmann::json::parse(text).get<Figures>();
  } else {
    f.message = fmt::format("its process ended with status {}", status);
  }
  f.seconds = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
              1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  f.memory = 1024 * static_cast<double>(used.ru_maxrss);
  return f;
}

/// Ratio of the tensions of a belt that slips on a drum: exp(mu wrap) on a round one. The belt's elements are as long as the rods are
/// apart.
Scene belt() {
  Scene scene{"belt on a drum", {"tension ratio"}, {}, {}};
  const scenes::BeltSpec round;
  scene.truth = {std::exp(round.friction * round.wrap)};
  const auto add = [&](const std::string& name, int rods, double step_share, bool implicit) {
    scene.settings.push_back({name, [=] {
                                scenes::BeltSpec spec;
                                spec.rods = rods;
                                spec.rod_over_bar = 0.16 / rods;
                                scenes::Scene posed = scenes::belt_on_drum(spec);
                                posed.model.implicit_axial = implicit;
                                if (implicit) {
                                  posed.options.time_step *= step_share;
                                } else {
                                  posed.options.time_step = 0;  // the axial wave bounds it
                                }
                                const scenes::DrawnBelt drawn = scenes::draw_belt(posed, spec);
                                Figures f;
                                f.value = {drawn.ratio};
                                f.steps = drawn.steps;
                                f.nodes = posed.model.nodes();
                                return f;
                              }});
  };
  for (const int rods : {2, 4, 8, 16}) add(fmt::format("{} rods", rods), rods, 1, true);
  add("8 rods, half the step", 8, 0.5, true);
  add("8 rods, twice the step", 8, 2, true);
  add("4 rods, explicit bars", 4, 1, false);
  return scene;
}

/// Two yarns that cross; the upper one is thrown onto the lower one, which is taut, and its inertia presses the fibers of both apart.
Scene pressed_yarns() {
  Scene scene{"yarn of 7 fibers thrown across another", {"least height", "lost to friction", "impulse"}, {}, {}};
  struct Way {
    double bar = 2, step_share = 1, skin = 0.5, friction = 0.2, softer = 1;
    bool node_contact = false, implicit = true;
    int fibers = 7;
  };
  const auto add = [&](const std::string& name, const Way& way, bool on_ladder = true) {
    scene.settings.push_back({name,
                              [way] {
                                stress::FallingYarn spec;
                                spec.fibers = way.fibers;
                                spec.length = 24;
                                spec.tension = 0.5;
                                spec.bar = way.bar;
                                spec.friction = way.friction;
                                spec.modulus_ratio /= way.softer;
                                scenes::Scene posed = stress::falling_yarn(spec);
                                posed.model.node_contact = way.node_contact;
                                posed.model.implicit_axial = way.implicit;
                                // as of a loom, whose skins and bounds these are
                                const double d = 2 * spec.lower_radius;
                                posed.options.safety = 0.95 * way.step_share;
                                posed.options.motion_max = 0.015 * way.step_share * d * std::min(1.0, way.bar);
                                posed.options.time_step_max = 0.05 * way.step_share * d;
                                posed.options.skin = way.skin * d;
                                weave::Engine engine = posed.engine();
                                const weave::Drive drive = scenes::at_rest(posed.model);
                                const weave::Model& m = engine.model();
                                const auto upward = [&] {
                                  double sum = 0;
                                  for (std::uint32_t p = 0; p < m.nodes(); ++p) {
                                    if (m.yarn[m.fiber_of[p]] == 1) sum += m.mass[p] * engine.state().v[p].z();
                                  }
                                  return sum;
                                };
                                const auto height = [&] {  // of one yarn's middle over the other's
                                  double sum = 0;
                                  for (std::uint32_t fiber = 0; fiber < m.fibers(); ++fiber) {
                                    const std::uint32_t bars = m.last(fiber) - m.first[fiber], middle = m.first[fiber] + bars / 2;
                                    const double z = 0.5 * (engine.state().x[middle].z() + engine.state().x[middle + bars % 2].z());
                                    sum += (m.yarn[fiber] == 1 ? z : -z) / way.fibers;
                                  }
                                  return sum;
                                };
                                const double before = upward();
                                weave::Ledger ledger;
                                Figures f;
                                f.nodes = posed.model.nodes();
                                double least = height();
                                while (engine.state().time < 3 * d / spec.speed) {
                                  const weave::StepReport report = engine.step(drive, &ledger);
                                  if (report.status != weave::StepStatus::ok) {
                                    f.message = report.message;
                                    return f;
                                  }
                                  least = std::min(least, height());
                                }
                                f.steps = engine.state().step;
                                f.value = {least, ledger.flows.slip, upward() - before};
                                return f;
                              },
                              on_ladder});
  };
  add("reference: elements of 0.5 d, half the step", {.bar = 0.5, .step_share = 0.5});
  add("the same, friction changed in its tenth digit", {.bar = 0.5, .step_share = 0.5, .friction = 0.2000000001}, false);
  add("elements of 0.5 d", {.bar = 0.5});
  add("elements of 1 d", {.bar = 1});
  add("default", {});
  add("elements of 3 d", {.bar = 3});
  add("elements of 4 d", {.bar = 4});
  add("half the step", {.step_share = 0.5});
  add("explicit bars", {.implicit = false});
  add("node-to-node contact, elements of 1 d", {.bar = 1, .node_contact = true});
  add("no friction", {.friction = 1e-9}, false);
  add("bars ten times softer", {.softer = 10});
  add("inner skin of 0.25 d", {.skin = 0.25});
  add("19 fibers a yarn", {.fibers = 19}, false);
  return scene;
}

std::string element(double diameters) {
  return fmt::format("numerics.element_length={:g}", diameters);
}

using Figured = std::function<Figures(const std::vector<std::string>& overrides)>;

/// A scene of the loom at the settings that all of these have; `glass` is the name of the yarn in the case.
Scene of_loom(const std::string& name, const std::vector<std::string>& quantities, const std::string& glass, const Figured& weave,
              const std::vector<int>& fibers) {
  Scene scene{name, quantities, {}, {}};
  const auto add = [&](const std::string& setting, const std::vector<std::string>& overrides, bool on_ladder = true) {
    scene.settings.push_back({setting, [=] { return weave(overrides); }, on_ladder});
  };
  const std::string half_step = "numerics.safety=0.475", fine = element(0.5), as_shipped = element(2);
  add("reference: elements of 0.5 d, half the step", {fine, half_step});
  add("the same, friction changed in its tenth digit", {fine, half_step, "fabric.friction=0.2000000001"}, false);
  add("elements of 0.5 d", {fine});
  add("elements of 1 d", {element(1)});
  add("default", {as_shipped});
  add("the same, friction changed in its tenth digit (default)", {as_shipped, "fabric.friction=0.2000000001"}, false);
  add("elements of 3 d", {element(3)});
  add("elements of 4 d", {element(4)});
  add("half the step", {as_shipped, half_step});
  add("explicit bars", {as_shipped, "numerics.integrator=\"explicit\""});
  add("node-to-node contact, elements of 1 d", {element(1), "numerics.contact=\"node\""});
  add("no friction", {as_shipped, "fabric.friction=0"}, false);
  add("bars ten times softer", {as_shipped, fmt::format("yarns.{}.youngs_modulus=\"8.69 GPa\"", glass)});
  add("inner skin of 0.25 d", {as_shipped, "numerics.skin=0.25"});
  for (const int n : fibers) add(fmt::format("{} fibers a yarn", n), {as_shipped, fmt::format("yarns.{}.fibers={}", glass, n)}, false);
  return scene;
}

/// What a weave gives, unless it failed.
Figures of_weave(const weave::WeaveResult& result, const std::vector<double>& value) {
  Figures f;
  f.steps = result.summary.steps;
  f.nodes = result.summary.nodes_max;
  if (result.status == weave::RunStatus::failed) {
    f.message = result.message;
  } else {
    f.value = value;
  }
  return f;
}

/// A plain weave of two columns from the first insertion to the last taking-up.
Scene weave_cell() {
  const auto weave = [](const std::vector<std::string>& overrides) {
    const weave::WeaveResult result = weave::weave_cloth(stress::plain_weave(overrides), {});
    const weave::WeaveSummary& s = result.summary;
    return of_weave(result, {s.reed_load_max, s.cell.thickness_mean, s.warp_tension_mean, s.cell.crimp_warp});
  };
  return of_loom("one cell of a plain weave of 3 fibers a yarn", {"reed load", "thickness", "warp tension", "crimp of the warp"}, "glass",
                 weave, {7, 19});
}

/// Blows of a third to an eighth weft against those before: the reed's impulse, and how it spreads over the last part of its way to the
/// fell. A single blow is as chaotic as its peak.
Scene beat_up() {
  const auto weave = [](std::vector<std::string> overrides) {
    constexpr int first_blow = 2, blows = 6, places = 10;
    constexpr double place = 0.04;  // of the loom's length
    overrides.emplace_back("fabric.cells=4");
    const weave::Case c = stress::plain_weave(overrides);
    const weave::WeaveResult result = weave::weave_cloth(c, {});
    std::vector<double> curve(places, 0);
    double impulse = 0;
    const weave::History& h = result.history;
    for (std::size_t i = 1; i < h.time_s.size(); ++i) {
      if (h.pick[i] < first_blow || h.action[i] != 1) continue;
      const double part = h.reed_load_N[i] * (h.time_s[i] - h.time_s[i - 1]) / blows;
      impulse += part;
      const auto at = static_cast<int>(h.reed_x_m[i] / (place * c.loom.length));
      if (at >= 0 && at < places) curve[at] += part;
    }
    const double squares = std::inner_product(curve.begin(), curve.end(), curve.begin(), 0.0);
    Figures f = of_weave(result, {impulse, std::sqrt(squares / places)});
    f.curve = curve;
    return f;
  };
  return of_loom("beat-up of a weft into a plain weave", {"impulse", "impulse along the reed's way"}, "glass", weave, {7});
}

/// The first pick of example 1b, as shipped.
Scene whole_pick() {
  const auto weave = [](const std::vector<std::string>& overrides) {
    weave::RunOptions options;
    options.stop_after_pick = 1;
    const weave::Case c = weave::load_case(std::filesystem::path(HEDDLE_CASES_DIR) / "example_1b", overrides);
    const weave::WeaveResult result = weave::weave_cloth(c, options);
    const weave::WeaveSummary& s = result.summary;
    return of_weave(result, {s.energy.flows.reed, s.energy.flows.heddle, s.warp_tension_mean});
  };
  return of_loom("a pick of example 1b", {"work of the reed", "work of the heddles", "warp tension"}, "s2_125", weave, {3, 19});
}

/// Minimum of the potential of a plain weave, started from its topology.
Scene relaxation() {
  Scene scene{"relaxation of a plain weave of 7 fibers a yarn", {"energy", "thickness"}, {}, {}};
  const auto add = [&](const std::string& name, double element_length, const std::function<void(relax::MinimizeOptions&)>& set) {
    scene.settings.push_back({name, [=] {
                                scenes::PlainWeave weave;
                                weave.fibers = 7;
                                weave.pitch = 9e-4;
                                const scenes::PosedCell posed = scenes::plain_weave_cell(weave, 0.1, element_length);
                                relax::MinimizeOptions options;
                                set(options);
                                const relax::MinimizeResult result = relax::minimize(posed.cell, posed.unknowns(), options);
                                const weave::Snapshot cell = relax::snapshot_of(posed.cell, result.q);
                                Figures f;
                                f.value = {result.energy.sum(), weave::measure_cell(cell).thickness_mean};
                                f.steps = static_cast<std::int64_t>(result.history.size());
                                f.nodes = posed.x.size();
                                if (!result.certificate.converged) f.message = result.certificate.blocked_by;
                                return f;
                              }});
  };
  const auto as_it_is = [](relax::MinimizeOptions&) {};
  add("reference: elements of 0.5 d", 0.5, as_it_is);
  add("elements of 1 d", 1, as_it_is);
  add("default", 2, as_it_is);
  add("elements of 3 d", 3, as_it_is);
  add("elements of 4 d", 4, as_it_is);
  add("Newton's method alone", 2, [](relax::MinimizeOptions& o) { o.method = relax::MinimizeMethod::newton; });
  add("first-order phase alone", 2, [](relax::MinimizeOptions& o) {
    o.method = relax::MinimizeMethod::dynamic;
    o.first_order_max = 200000;
  });
  return scene;
}

/// Relative, by quantity: of numbers to the truth, of a curve the root mean square of its distance from that of the reference.
std::vector<double> errors(const Figures& figures, const std::vector<double>& truth, const std::vector<double>& curve_of_reference) {
  std::vector<double> e;
  for (std::size_t i = 0; i < figures.value.size(); ++i) e.push_back(std::abs(figures.value[i] / truth.at(i) - 1));
  if (figures.curve.empty() || e.empty()) return e;
  double distance = 0, square = 0;
  for (std::size_t i = 0; i < figures.curve.size(); ++i) {
    distance += std::pow(figures.curve[i] - curve_of_reference.at(i), 2);
    square += std::pow(curve_of_reference[i], 2);
  }
  e.back() = std::sqrt(distance / square);
  return e;
}

std::vector<Row> climb(const Scene& scene) {
  std::vector<Row> rows;
  std::vector<double> truth = scene.truth;
  for (const Setting& setting : scene.settings) {
    Row row{.scene = scene.name, .setting = setting.name, .figures = run_apart(setting), .error = {}, .on_ladder = setting.on_ladder};
    row.reference = rows.empty() && scene.truth.empty();
    if (row.reference) truth = row.figures.value;
    row.error = errors(row.figures, truth, rows.empty() ? row.figures.curve : rows.front().figures.curve);
    fmt::print("{}, {}: {:.2f} s, {:.1f} MB, {} steps, errors {:.2g} {}\n", row.scene, row.setting, row.figures.seconds,
               1e-6 * row.figures.memory, row.figures.steps, fmt::join(row.error, " "), row.figures.message);
    std::fflush(stdout);
    rows.push_back(std::move(row));
  }
  const auto counts = [](const Row& row) { return row.on_ladder && !row.reference && !row.error.empty(); };
  for (Row& row : rows) {
    row.on_front = counts(row) && std::ranges::none_of(rows, [&](const Row& o) {
                     return counts(o) && o.figures.seconds < row.figures.seconds && o.worst() <= row.worst();
                   });
  }
  return rows;
}

std::string table(const Scene& scene, const std::vector<Row>& rows) {
  std::string text = fmt::format("**{}**\n\n| setting | {} | time [s] | steps | nodes | memory [MB] | front |\n|---|", scene.name,
                                 fmt::join(scene.quantities, " | "));
  for (std::size_t i = 0; i < scene.quantities.size() + 5; ++i) text += "---|";
  for (const Row& row : rows) {
    text += fmt::format("\n| {} |", row.setting);
    if (row.error.empty()) text += fmt::format(" {} |", row.figures.message);
    for (std::size_t i = row.error.empty() ? 1 : 0; i < scene.quantities.size(); ++i) {
      text += row.error.empty() ? " |"
              : row.reference   ? fmt::format(" {:.4g} |", row.figures.value[i])
                                : fmt::format(" {:.2g} % |", 100 * row.error[i]);
    }
    text += fmt::format(" {:.2f} | {} | {} | {:.0f} | {} |", row.figures.seconds, row.figures.steps, row.figures.nodes,
                        1e-6 * row.figures.memory, row.on_front ? "*" : "");
  }
  return text + "\n\n";
}

void draw(const std::vector<std::vector<Row>>& scenes, const std::filesystem::path& file) {
  constexpr int width = 1000, height = 420;
  heddle::Canvas canvas(file, width, height * static_cast<int>(scenes.size()));
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    heddle::Series all{"settings", heddle::faint_ink, {}, {}, heddle::Series::Style::circles},
        front{"Pareto front", heddle::state_color(0), {}, {}, heddle::Series::Style::circles};
    for (const Row& row : scenes[i]) {
      if (row.reference || row.error.empty() || row.worst() <= 0) continue;
      heddle::Series& series = row.on_front ? front : all;
      series.u.push_back(std::log10(row.figures.seconds));
      series.v.push_back(std::log10(row.worst()));
    }
    const heddle::Plot plot{
        scenes[i].front().scene, "log10 of the processor's time [s]", "log10 of the largest error", {all, front}, {}, false};
    heddle::draw_plot(canvas, plot, {0, static_cast<double>(height) * static_cast<double>(i)}, width, height, 1);
  }
  canvas.finish();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "heddle_ladder FOLDER [WORD]\n");
    return 2;
  }
  omp_set_num_threads(1);
  const std::filesystem::path folder = argv[1];
  const std::string word = argc > 2 ? argv[2] : "";
  std::filesystem::create_directories(folder);
  auto markdown = fmt::output_file((folder / "ladder.md").string());
  auto csv = fmt::output_file((folder / "ladder.csv").string());
  csv.print("scene,setting,quantity,value,relative_error,time_s,steps,nodes,memory_bytes,on_front\n");
  std::vector<std::vector<Row>> done;
  for (const Scene& scene : {belt(), pressed_yarns(), relaxation(), beat_up(), weave_cell(), whole_pick()}) {
    if (scene.name.find(word) == std::string::npos) continue;
    const std::vector<Row> rows = climb(scene);
    markdown.print("{}", table(scene, rows));
    for (const Row& row : rows) {
      for (std::size_t i = 0; i < row.error.size(); ++i) {
        csv.print("\"{}\",\"{}\",\"{}\",{:.9g},{:.3g},{:.4g},{},{},{:.0f},{}\n", row.scene, row.setting, scene.quantities[i],
                  row.figures.value[i], row.error[i], row.figures.seconds, row.figures.steps, row.figures.nodes, row.figures.memory,
                  static_cast<int>(row.on_front));
      }
    }
    done.push_back(rows);
  }
  if (!done.empty()) draw(done, folder / "ladder.png");
  return 0;
}
