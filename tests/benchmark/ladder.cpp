// Run time against error: scenes at a ladder of settings, each judged by its error against a closed form or a far finer run.
//     heddle_ladder FOLDER [WORD]
// Writes ladder.md, a table for each scene with the Pareto front marked, ladder.csv and ladder.png into FOLDER; with WORD only the scenes
// whose name holds it. Times are those of the processor, on one thread.
#include <fmt/format.h>
#include <fmt/os.h>
#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "heddle/picture.hpp"
#include "heddle/plot.hpp"
#include "relax/minimize.hpp"
#include "relax/report.hpp"
#include "scenes/belt.hpp"
#include "scenes/cells.hpp"
#include "stress/loom_sweeps.hpp"
#include "weave/measures.hpp"
#include "weave/weaving_run.hpp"

namespace {

/// What a scene gives at one setting.
struct Figures {
  std::vector<double> value;  ///< by quantity of the scene
  double seconds = 0;         ///< of the processor
  std::int64_t steps = 0;
  std::size_t nodes = 0;
  std::string message;  ///< why it gave none; empty if it did
};

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

template <typename Work>
Figures timed(Work&& work) {
  const std::clock_t start = std::clock();
  Figures f;
  try {
    f = work();
  } catch (const std::exception& error) {
    f.message = error.what();
  }
  f.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
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
                                return Figures{.value = {drawn.ratio}, .steps = drawn.steps, .nodes = posed.model.nodes(), .message = ""};
                              }});
  };
  for (const int rods : {2, 4, 8, 16}) add(fmt::format("{} rods", rods), rods, 1, true);
  add("8 rods, half the step", 8, 0.5, true);
  add("8 rods, twice the step", 8, 2, true);
  add("4 rods, explicit bars", 4, 1, false);
  return scene;
}

/// A plain weave of two columns from the first insertion to the last taking-up.
Scene weave_cell() {
  Scene scene{"one cell of a plain weave of 3 fibers a yarn", {"reed load", "thickness", "warp tension", "crimp of the warp"}, {}, {}};
  const auto add = [&](const std::string& name, std::vector<std::string> overrides, bool on_ladder = true) {
    scene.settings.push_back({name,
                              [=] {
                                const weave::WeaveResult result = weave::weave_cloth(stress::plain_weave(overrides), {});
                                const weave::WeaveSummary& s = result.summary;
                                Figures f{.value = {}, .steps = s.steps, .nodes = s.nodes_max, .message = result.message};
                                if (result.status == weave::RunStatus::completed) {
                                  f.value = {s.reed_load_max, s.cell.thickness_mean, s.warp_tension_mean, s.cell.crimp_warp};
                                }
                                return f;
                              },
                              on_ladder});
  };
  const auto element = [](double diameters) { return fmt::format("numerics.element_length={:g}", diameters); };
  add("reference: elements of 0.5 d, half the step", {element(0.5), "numerics.safety=0.4"});
  add("the same, friction changed in its tenth digit", {element(0.5), "numerics.safety=0.4", "fabric.friction=0.2000000001"}, false);
  add("elements of 1 d", {element(1)});
  add("default", {element(2)});
  add("the same, friction changed in its tenth digit (default)", {element(2), "fabric.friction=0.2000000001"}, false);
  add("elements of 3 d", {element(3)});
  add("elements of 4 d", {element(4)});
  add("half the step", {element(2), "numerics.safety=0.4"});
  add("explicit bars", {element(2), "numerics.integrator=\"explicit\""});
  add("node-to-node contact, elements of 1 d", {element(1), "numerics.contact=\"node\""});
  add("no friction", {element(2), "fabric.friction=0"}, false);
  add("bars ten times softer", {element(2), "yarns.glass.youngs_modulus=\"8.69 GPa\""});
  add("inner skin of 0.1 d", {element(2), "numerics.skin=0.1"});
  add("inner skin of 0.25 d", {element(2), "numerics.skin=0.25"});
  add("7 fibers a yarn", {element(2), "yarns.glass.fibers=7"}, false);
  add("19 fibers a yarn", {element(2), "yarns.glass.fibers=19"}, false);
  return scene;
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
                                Figures f{.value = {result.energy.sum(), weave::measure_cell(cell).thickness_mean},
                                          .steps = static_cast<std::int64_t>(result.history.size()),
                                          .nodes = posed.x.size(),
                                          .message = ""};
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

std::vector<Row> climb(const Scene& scene) {
  std::vector<Row> rows;
  std::vector<double> truth = scene.truth;
  for (const Setting& setting : scene.settings) {
    Row row{.scene = scene.name, .setting = setting.name, .figures = timed(setting.run), .error = {}, .on_ladder = setting.on_ladder};
    row.reference = rows.empty() && scene.truth.empty();
    if (row.reference) truth = row.figures.value;
    for (std::size_t i = 0; i < row.figures.value.size(); ++i) row.error.push_back(std::abs(row.figures.value[i] / truth.at(i) - 1));
    fmt::print("{}, {}: {:.2f} s, {} steps, errors {:.2g} {}\n", row.scene, row.setting, row.figures.seconds, row.figures.steps,
               fmt::join(row.error, " "), row.figures.message);
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
  std::string text =
      fmt::format("**{}**\n\n| setting | {} | time [s] | steps | nodes | front |\n|---|", scene.name, fmt::join(scene.quantities, " | "));
  for (std::size_t i = 0; i < scene.quantities.size() + 4; ++i) text += "---|";
  for (const Row& row : rows) {
    text += fmt::format("\n| {} |", row.setting);
    if (row.error.empty()) text += fmt::format(" {} |", row.figures.message);
    for (std::size_t i = row.error.empty() ? 1 : 0; i < scene.quantities.size(); ++i) {
      text += row.error.empty() ? " |"
              : row.reference   ? fmt::format(" {:.4g} |", row.figures.value[i])
                                : fmt::format(" {:.2g} % |", 100 * row.error[i]);
    }
    text += fmt::format(" {:.2f} | {} | {} | {} |", row.figures.seconds, row.figures.steps, row.figures.nodes, row.on_front ? "*" : "");
  }
  return text + "\n\n";
}

void draw(const std::vector<std::vector<Row>>& scenes, const std::filesystem::path& file) {
  constexpr int width = 1000, height = 420;
  heddle::Canvas canvas(file, width, height * static_cast<int>(scenes.size()));
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    heddle::Series all{"settings", heddle::faint_ink, {}, {}, true}, front{"Pareto front", heddle::state_color(0), {}, {}, true};
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
  csv.print("scene,setting,quantity,value,relative_error,time_s,steps,nodes,on_front\n");
  std::vector<std::vector<Row>> done;
  for (const Scene& scene : {belt(), relaxation(), weave_cell()}) {
    if (scene.name.find(word) == std::string::npos) continue;
    const std::vector<Row> rows = climb(scene);
    markdown.print("{}", table(scene, rows));
    for (const Row& row : rows) {
      for (std::size_t i = 0; i < row.error.size(); ++i) {
        csv.print("\"{}\",\"{}\",\"{}\",{:.9g},{:.3g},{:.4g},{},{},{}\n", row.scene, row.setting, scene.quantities[i], row.figures.value[i],
                  row.error[i], row.figures.seconds, row.figures.steps, row.figures.nodes, static_cast<int>(row.on_front));
      }
    }
    done.push_back(rows);
  }
  if (!done.empty()) draw(done, folder / "ladder.png");
  return 0;
}
