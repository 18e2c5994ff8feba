#include "heddle/run_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "heddle/compare_command.hpp"
#include "heddle/edge_length.hpp"
#include "heddle/envelope_command.hpp"
#include "heddle/homogenize_command.hpp"
#include "heddle/json_file.hpp"
#include "heddle/mesh_command.hpp"
#include "heddle/page_tables.hpp"
#include "heddle/relax_command.hpp"
#include "heddle/report_page.hpp"
#include "heddle/view.hpp"
#include "heddle/weave_command.hpp"
#include "relax/envelope.hpp"
#include "relax/homogenize.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"
#include "weave/version.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;
using std::filesystem::path;

constexpr std::array<const char*, 5> stage_names = {"weave", "relax", "envelope", "mesh", "homogenize"};

/// A step of the pipeline, with a folder of its own.
struct Stage {
  std::string name, title;
  std::function<int()> run;  ///< returns the exit status
  path pictures;             ///< folder
  path drawn = {};           ///< folder of results to draw, once they are complete
};

/// Stages in folders of their own, each with a stage.json that says what it was made from.
class Pipeline {
 public:
  explicit Pipeline(path folder) : folder_(std::move(folder)) {}

  [[nodiscard]] path folder_of(const std::string& stage) const { return folder_ / stage; }

  /// Runs a stage unless its last run had the same inputs and finished. `work` is told whether an unfinished run had them; it returns the
  /// exit status. Returns the same. What is run later depends on it.
  int run(const std::string& stage, const ordered_json& inputs, const std::function<int(bool unfinished)>& work) {
    const int status = run_beside(stage, inputs, work);
    inputs_ = with_those_before(inputs);
    return status;
  }

  /// The same for a stage that no later one depends on.
  int run_beside(const std::string& stage, const ordered_json& own_inputs, const std::function<int(bool unfinished)>& work) {
    const ordered_json inputs = with_those_before(own_inputs);
    const path file = folder_of(stage) / "stage.json";
    const ordered_json before = read_json(file);
    const bool same = before.is_object() && before.value("inputs", ordered_json()) == inputs;
    if (same && before.value("finished", false)) {
      fmt::print("{}: unchanged, kept\n", stage);
      return before.value("status", 0);
    }
    std::filesystem::create_directories(folder_of(stage));
    weave::write_text_file(file, ordered_json{{"inputs", inputs}, {"finished", false}}.dump(2) + "\n");
    const auto start = std::chrono::steady_clock::now();
    const int status = work(same);
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const bool has_results = std::filesystem::exists(folder_of(stage) / "summary.json");
    if (has_results && status < 2)
      weave::write_text_file(file,
                             ordered_json{{"inputs", inputs}, {"finished", true}, {"status", status}, {"wall_s", wall}}.dump(2) + "\n");
    return status;
  }

 private:
  [[nodiscard]] ordered_json with_those_before(ordered_json inputs) const {
    inputs["after"] = inputs_;
    return inputs;
  }

  path folder_;
  ordered_json inputs_;  ///< of the last stage, with those of the stages before it
};

std::vector<path> pictures_in(const path& folder) {
  std::vector<path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".png") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// Keys of each stage's summary that a reader asks for first.
std::vector<std::string> keys_of(const std::string& stage) {
  if (stage == "weave") {
    return {"version",
            "picks",
            "fibers",
            "nodes",
            "steps",
            "dt_s",
            "reed_load_max_N",
            "reed_load_mean_N",
            "reed_load_over_warp_tension",
            "warp_tension_mean_N",
            "thickness_m",
            "thickness_mean_m",
            "fiber_volume_fraction",
            "crimp_warp",
            "crimp_weft",
            "steadiness",
            "order_violations",
            "overlap_max",
            "energy_residual",
            "wall_s"};
  }
  if (stage == "relax") {
    return {"converged",       "blocked_by",    "fibers_per_yarn", "unknowns",         "gradient_max",          "positive_definite",
            "newton_step_max", "energy_J",      "thickness_m",     "thickness_mean_m", "fiber_volume_fraction", "crimp_warp",
            "crimp_weft",      "cell_length_m", "cell_width_m",    "borne_load_x_N",   "borne_load_y_N",        "order_violations",
            "overlap_max",     "iterations",    "wall_s"};
  }
  if (stage == "minima") return {"closest_to_woven"};
  if (stage == "envelope") {
    return {"yarns",
            "triangles",
            "closed",
            "self_intersections",
            "mutual_intersections",
            "periodic_mismatch_m",
            "gap_min_m",
            "distance_mean_radii",
            "distance_max_radii",
            "volume_ratio",
            "yarn_volume_fraction",
            "fiber_volume_fraction",
            "wall_s"};
  }
  if (stage == "mesh") {
    return {"elements",
            "element_shape",
            "nodes",
            "voxels",
            "dihedral_min_rad",
            "flat_elements_share",
            "fiber_volume_fraction",
            "yarn_volume_fraction",
            "wall_s"};
  }
  return {"elements", "fiber", "matrix", "micromechanics", "stiffness_order", "stiffness_Pa", "mesh_error", "wall_s"};
}

/// What a stage's figures look like side by side.
std::vector<PageTable> tables_of(const std::string& stage, const ordered_json& summary) {
  if (stage == "minima") return minima_tables(summary);
  if (stage == "envelope") return {section_table(summary)};
  if (stage == "homogenize") return {stiffness_table(summary)};
  return {};
}

std::vector<PageYarn> yarns_of(const path& envelope) {
  const weave::Snapshot snapshot = weave::read_results(envelope / "fibers.vtkhdf").snapshot;
  std::vector<PageYarn> yarns;
  for (std::size_t f = 0; f < snapshot.fibers(); ++f) {
    const path surface = envelope / fmt::format("{}_{}.off", snapshot.weft[f] ? "weft" : "warp", snapshot.yarn[f]);
    const bool known = std::any_of(yarns.begin(), yarns.end(), [&](const PageYarn& y) { return y.surface == surface; });
    if (!known) yarns.push_back({surface, snapshot.weft[f] != 0});
  }
  return yarns;
}

/// Draws a folder's results unless that was done since they were made. If it can not be done, they are no less complete.
void draw(const path& folder) {
  ViewOptions view_options;
  view_options.results = folder;
  view_options.output = folder / "pictures";
  const std::vector<path> pictures = pictures_in(view_options.output);
  const auto is_new = [&](const path& picture) {
    return std::filesystem::last_write_time(picture) >= std::filesystem::last_write_time(folder / "summary.json");
  };
  if (!pictures.empty() && std::all_of(pictures.begin(), pictures.end(), is_new)) return;
  try {
    view(view_options);
  } catch (const std::exception& e) {
    fmt::print(stderr, "the pictures of {} failed: {}\n", folder.string(), e.what());
  }
}

/// Whether a folder has a checkpoint to go on from; that of other inputs is taken away.
bool goes_on(const path& folder, bool unfinished) {
  const path checkpoint = folder / "checkpoint.h5";
  if (!unfinished) std::filesystem::remove(checkpoint);
  return std::filesystem::exists(checkpoint);
}

/// Throws for what later stages could not take, before the first one begins.
void check_options(const PipelineOptions& o, const weave::Case& c, bool meshes, bool homogenizes) {
  std::vector<std::string> used = c.weft.yarn_of_layer;
  for (const weave::WarpSection& section : c.sections) used.push_back(section.yarn);
  double diameter = 1e300;
  for (const std::string& name : used) {
    const weave::YarnType& yarn = c.yarns.at(name);
    diameter = std::min(diameter, 2 * yarn.fiber_radius());
    if (const int has = yarn.fibers; o.fibers > 0 && o.fibers < has)
      throw std::invalid_argument(fmt::format("--fibers {}: must be >= {}, the fibers of yarn {}", o.fibers, has, name));
  }
  const EdgeLength edge_length = parse_edge_length(o.edge_length);
  relax::EnvelopeOptions envelope;
  (edge_length.in_diameters ? envelope.edge_length : envelope.edge_length_m) = edge_length.value;
  relax::check_options(envelope, diameter);
  HomogenizeCommandOptions homogenize;
  homogenize.fiber = o.fiber;
  if (meshes) constituents_of(homogenize, c);
  if (homogenizes) relax::find_ccx(homogenize.ccx);
}

}  // namespace

int run_command(const PipelineOptions& options) {
  const weave::Case c = weave::load_case(options.case_file, options.overrides);
  const auto last = std::find(stage_names.begin(), stage_names.end(), options.until);
  if (last == stage_names.end())
    throw std::invalid_argument("--until " + options.until + ": must be weave, relax, envelope, mesh or homogenize");
  if (options.minima && last == stage_names.begin())
    throw std::invalid_argument("--minima: needs a relaxed cell, so --until relax at least");
  HomogenizeCommandOptions homogenize_options;
  homogenize_options.fiber = options.fiber;
  homogenize_options.elements = options.elements;
  homogenize_options.tetrahedra = options.tetrahedra;
  const auto reaches = [&](const char* stage) { return last >= std::find(stage_names.begin(), stage_names.end(), std::string(stage)); };
  check_options(options, c, reaches("mesh"), reaches("homogenize"));
  const path output = options.output.empty() ? path("results") / c.name : options.output;
  Pipeline pipeline(output);
  const path woven = pipeline.folder_of("weave"), relaxed = pipeline.folder_of("relax"), minima = pipeline.folder_of("minima"),
             envelope = pipeline.folder_of("envelope"), meshed = pipeline.folder_of("mesh"), homogenized = pipeline.folder_of("homogenize");

  const auto weave_stage = [&] {
    return pipeline.run("weave", {{"version", weave::version()}, {"case", weave::to_toml(c)}}, [&](bool unfinished) {
      WeaveOptions o;
      o.case_file = options.case_file;
      o.overrides = options.overrides;
      o.output = woven;
      o.resume = goes_on(woven, unfinished);
      o.quiet = options.quiet;
      const int status = weave_command(o);
      return status == 0 ? 0 : std::max(status, 2);
    });
  };
  // From a woven cell or a case into a folder; goes on from the checkpoint of an unfinished run.
  const auto relax_into = [&](const path& folder, const path& start, const std::vector<std::string>& overrides, bool unfinished) {
    RelaxOptions o;
    o.input = start;
    o.overrides = overrides;
    o.output = folder;
    o.fibers = options.fibers;
    o.pressure = options.pressure;
    o.load_x = options.load_x;
    o.load_y = options.load_y;
    o.resume = goes_on(folder, unfinished);
    o.quiet = options.quiet;
    return relax_command(o);
  };
  const auto relax_stage = [&] {
    ordered_json inputs = {{"fibers", options.fibers}};
    if (options.pressure > 0) inputs["pressure"] = options.pressure;
    if (options.load_x) inputs["load_x"] = *options.load_x;
    if (options.load_y) inputs["load_y"] = *options.load_y;
    const int status = pipeline.run("relax", inputs, [&](bool unfinished) { return relax_into(relaxed, woven, {}, unfinished); });
    if (status != 1) return status;
    const ordered_json summary = read_json(relaxed / "summary.json");
    fmt::print(stderr, "{}the relaxed cell is no certified minimum: {}; {}\n",
               options.unconverged ? "" : "relax failed: ", summary.value("blocked_by", ""),
               options.unconverged ? "going on with it" : "--unconverged goes on with it");
    return options.unconverged ? 0 : 1;
  };
  const auto minima_stage = [&] {
    return pipeline.run_beside("minima", ordered_json::object(), [&](bool unfinished) {
      const path from_topology = minima / "from_topology";
      const int result = relax_into(from_topology, options.case_file, options.overrides, unfinished);
      return result < 2 ? compare_command({{relaxed, from_topology}, woven, minima}) : result;  // it tells what is no certified minimum
    });
  };
  const auto envelope_stage = [&] {
    ordered_json inputs = ordered_json::object();
    if (options.edge_length != EnvelopeCommandOptions{}.edge_length) inputs["edge_length"] = options.edge_length;
    return pipeline.run("envelope", inputs, [&](bool) {
      EnvelopeCommandOptions o;
      o.input = relaxed;
      o.output = envelope;
      o.formats = envelope_formats;
      o.edge_length = options.edge_length;
      o.unconverged = options.unconverged;
      return envelope_command(o);
    });
  };
  const auto mesh_stage = [&] {
    ordered_json inputs = {{"elements", options.elements}};
    if (options.tetrahedra) inputs["tetrahedra"] = true;
    if (!options.fiber.empty()) inputs["fiber"] = options.fiber;
    return pipeline.run("mesh", inputs, [&](bool) {
      CompositeOptions o = homogenize_options;
      o.input = envelope;
      o.output = meshed;
      o.quadratic = options.tetrahedra;  // as it is homogenized
      return mesh_command(o);
    });
  };
  const auto homogenize_stage = [&] {
    return pipeline.run("homogenize", ordered_json::object(), [&](bool) {
      HomogenizeCommandOptions o = homogenize_options;
      o.input = envelope;
      o.output = homogenized;
      return homogenize_command(o);
    });
  };
  std::vector<Stage> stages = {{"weave", "Weaving", weave_stage, woven / "pictures", woven},
                               {"relax", "Relaxation", relax_stage, relaxed / "pictures", relaxed},
                               {"envelope", "Yarn envelopes", envelope_stage, envelope},
                               {"mesh", "Mesh", mesh_stage, meshed / "pictures"},
                               {"homogenize", "Stiffness of the composite", homogenize_stage, homogenized / "pictures"}};
  stages.resize(static_cast<std::size_t>(last - stage_names.begin()) + 1);
  if (options.minima) stages.insert(stages.begin() + 2, {"minima", "Minima", minima_stage, minima, minima / "from_topology"});

  PageContent page;
  page.title = c.name;
  page.subtitle = c.title;
  page.case_toml = weave::to_toml(c);
  ordered_json walls = ordered_json::object();
  double wall = 0;
  int status = 0;
  for (const Stage& stage : stages) {
    try {
      status = stage.run();
    } catch (const std::exception& e) {
      fmt::print(stderr, "{} failed: {}\n", stage.name, e.what());
      status = 2;
    }
    const path folder = pipeline.folder_of(stage.name);
    if (status >= 2 || !std::filesystem::exists(folder / "summary.json")) break;
    if (!stage.drawn.empty()) draw(stage.drawn);
    const ordered_json summary = read_json(folder / "summary.json");
    page.stages.push_back(
        {stage.title, folder / "summary.json", keys_of(stage.name), pictures_in(stage.pictures), tables_of(stage.name, summary)});
    if (stage.name == "envelope" && status == 0) page.yarns = yarns_of(envelope);
    walls[stage.name] = read_json(folder / "stage.json").value("wall_s", 0.0);
    wall += walls[stage.name].get<double>();
    if (status != 0) break;
  }
  if (!page.stages.empty()) {
    const ordered_json summary = {{"tool", "run"},    {"case", c.name}, {"version", weave::version()}, {"until", options.until},
                                  {"status", status}, {"wall_s", wall}, {"stage_wall_s", walls}};
    weave::write_text_file(output / "summary.json", summary.dump(2) + "\n");
    page.tables.push_back(wall_table(summary));
    weave::write_text_file(output / "report.html", report_page(page));
    fmt::print("{}: stages in {}, all of them in {}\n", c.name, output.string(), (output / "report.html").string());
  }
  return status;
}

}  // namespace heddle
