#include "heddle/relax_command.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "heddle/compare_command.hpp"
#include "heddle/relax_table.hpp"
#include "heddle/results_folder.hpp"
#include "heddle/stop_signal.hpp"
#include "relax/minimize.hpp"
#include "relax/perturb.hpp"
#include "relax/refine.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "relax/topology_start.hpp"
#include "relax/version.hpp"
#include "relax/woven_start.hpp"
#include "weave/case.hpp"
#include "weave/measures.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;

void show(const relax::MinimizeProgress& p) {
  fmt::print(stderr,
             "{:4}  energy {:.9e} J  gradient {:.2e}  step {:.2e} m  damping {:.1e}{}  {} contact points  factor {:.2g} s  solve {:.2g} s  "
             "{:.1f} s\n",
             p.iteration, p.energy, p.gradient_max, p.step_max, p.damping,
             p.first_order   ? " first order"
             : p.factor_kept ? " factor kept"
                             : "",
             p.touching, p.factorization, p.solution, p.wall);
}

void print_certificate(const relax::MinimizeResult& r) {
  const relax::Certificate& c = r.certificate;
  fmt::print("  {}\n", c.converged ? "certified minimum, without friction" : "NOT CONVERGED: " + c.blocked_by);
  fmt::print("  gradient {:.2e} of {:.3g} N, Hessian {}positive definite, Newton step {:.2e} d, contacts {}, pins hold {:.2e}\n",
             c.gradient_max, r.reference_tension, c.positive_definite ? "" : "not ", c.newton_step_max,
             c.contacts_steady ? "steady" : "not steady", c.pin_force_max);
  if (c.free_fibers > 0) fmt::print("  fibers that touch nothing, and may lie anywhere: {}\n", c.free_fibers);
}

/// What is to be relaxed.
struct Start {
  weave::Case c;
  relax::Cell cell;
  std::vector<weave::Vec3> x;
  Eigen::VectorXd q;  ///< unknowns, under pressure and loads
  bool woven = false;
  relax::FaceMismatch mismatch;
};

/// A results file, or the last unit cell in a results folder; empty for a case.
std::filesystem::path woven_file(const std::filesystem::path& input) {
  if (std::filesystem::is_directory(input) && std::filesystem::exists(input / "cell.vtkhdf")) return input / "cell.vtkhdf";
  return input.extension() == ".vtkhdf" ? input : std::filesystem::path();
}

relax::WovenStart woven_start(const std::filesystem::path& file, const weave::Case& c, const weave::Snapshot& cell,
                              const relax::WovenOptions& options) {
  try {
    return relax::cell_from_woven(c, cell, options);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(file.string() + ": " + e.what());
  }
}

Start start_of(const RelaxOptions& options) {
  Start start;
  if (const std::filesystem::path file = woven_file(options.input); !file.empty()) {
    if (options.start_fibers > 0) throw std::invalid_argument("--start-fibers: a woven cell starts with the fibers that it has");
    if (relax::is_relaxed(file)) throw std::invalid_argument(file.string() + ": is a relaxed cell; give a woven one, or a case");
    const weave::ResultsFile results = weave::read_results(file);
    start.c = weave::parse_case(results.case_toml, file.string(), options.overrides);
    relax::WovenOptions woven{options.warp_tension, options.weft_tension, start.c.numerics.element_length};
    if (options.element_length > 0) woven.element_length = options.element_length;
    relax::WovenStart cut = woven_start(file, start.c, results.snapshot, woven);
    start.cell = std::move(cut.cell);
    start.x = std::move(cut.x);
    start.mismatch = cut.mismatch;
    start.woven = true;
    fmt::print(
        "cut out of {}: it leaned by {:.3f} d; warps meet across the faces within {:.3f} d (mean), {:.3f} d (largest), {} go on in another "
        "place\n",
        file.string(), start.mismatch.lean, start.mismatch.mean, start.mismatch.largest, start.mismatch.moved);
    return start;
  }
  std::vector<std::string> overrides = options.overrides;
  start.c = weave::load_case(options.input, overrides);
  if (options.start_fibers > 0) {
    for (const auto& [name, yarn] : start.c.yarns) overrides.push_back(fmt::format("yarns.{}.fibers={}", name, options.start_fibers));
    start.c = weave::load_case(options.input, overrides);
  }
  relax::TopologyOptions topology;
  topology.warp_tension = options.warp_tension;
  topology.weft_tension = options.weft_tension > 0 ? options.weft_tension : options.warp_tension;
  topology.element_length = options.element_length > 0 ? options.element_length : start.c.numerics.element_length;
  std::tie(start.cell, start.x) = relax::cell_from_topology(start.c, topology);
  return start;
}

/// Throws where loads would leave the size of a cell open: against prescribed tensions it grows without bound under as much, and has no
/// size of its own where both its lengths are free.
void check_loads(const relax::Cell& cell) {
  std::array<double, 2> pulled = {0, 0};
  std::array<bool, 2> by_tension = {true, true};
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    const auto axis = static_cast<std::size_t>(cell.axis_of(f));
    pulled[axis] += cell.tension[f];
    by_tension[axis] = by_tension[axis] && cell.tension[f] > 0;
  }
  const std::array<std::optional<double>, 2> load = {cell.load_x, cell.load_y};
  for (const std::size_t axis : {0, 1}) {
    if (load[axis] && by_tension[axis] && *load[axis] >= pulled[axis]) {
      throw std::invalid_argument(
          fmt::format("--load-{} = {:g}: must be < {:g} N, the prescribed tension of all {}, or the cell grows without bound", "xy"[axis],
                      *load[axis], pulled[axis], axis == 0 ? "warps" : "wefts"));
    }
  }
  if (load[0] && load[1] && by_tension[0] && by_tension[1]) {
    throw std::invalid_argument(
        "--load-x, --load-y: both with prescribed tensions of warps and wefts leave the size of the cell open; give one, or the yarns' "
        "lengths by a woven cell without --warp-tension and --weft-tension");
  }
}

/// Throws where yarns would have to be refined to fewer fibers than they start with.
void check_counts(const relax::Cell& cell, const RelaxOptions& o) {
  std::map<int, int> fibers;
  for (const int yarn : cell.yarn) ++fibers[yarn];
  const auto check = [&](const char* option, int count) {
    for (const auto& [yarn, has] : fibers) {
      if (count > 0 && count < has)
        throw std::invalid_argument(fmt::format("{} {}: must be >= {}, the fibers that yarn {} starts with", option, count, has, yarn));
    }
  };
  check("--fibers", o.fibers);
  for (const int count : o.series) check("--series", count);
}

/// The options that a state depends on, a line for each.
std::string text_of(const RelaxOptions& o, int fibers) {
  const auto load = [](const std::optional<double>& given) { return given ? fmt::format("{}", *given) : std::string("none"); };
  std::string text = fmt::format(
      "--fibers = {}\n--warp-tension = {}\n--weft-tension = {}\n--pressure = {}\n--load-x = {}\n--load-y = {}\n--element-length = "
      "{}\n--iterations = {}\n--first-order = "
      "{}\n",
      fibers, o.warp_tension, o.weft_tension, o.pressure, load(o.load_x), load(o.load_y), o.element_length, o.iterations, o.first_order);
  const RelaxOptions by_default;  // lines of later versions: those before wrote none
  if (o.method != by_default.method) text += fmt::format("--method = {}\n", o.method);
  if (o.tolerance != by_default.tolerance) text += fmt::format("--tolerance = {}\n", o.tolerance);
  return text;
}

relax::MinimizeMethod method_of(const std::string& name) {
  if (name == "dynamic") return relax::MinimizeMethod::dynamic;
  if (name == "newton") return relax::MinimizeMethod::newton;
  if (name == "auto") return relax::MinimizeMethod::automatic;
  throw std::invalid_argument("--method = " + name + ": must be auto, dynamic or newton");
}

/// Throws unless a file was made from the same case with the same options.
void expect_same(const std::filesystem::path& file, const std::string& case_a, const std::string& case_b, const std::string& options_a,
                 const std::string& options_b) {
  if (case_a != case_b) throw std::runtime_error(file.string() + ": is of another case (or the case was changed)");
  if (options_a == options_b) return;
  std::istringstream a(options_a), b(options_b);
  std::string line_a, line_b;
  while (line_a == line_b && (a || b)) {
    line_a = line_b = "";
    std::getline(a, line_a);
    std::getline(b, line_b);
  }
  const auto named = [](const std::string& line) { return line.empty() ? "no further option" : line; };
  throw std::runtime_error(file.string() + ": was made with " + named(line_a) + ", not " + named(line_b));
}

constexpr double perturbation = 0.3;  ///< of further starts [fiber diameters]
constexpr const char *checkpoint_name = "checkpoint.h5", *results_name = "relax.vtkhdf", *summary_name = "summary.json";

/// The relaxation of one start with one number of fibers a yarn, and its files.
class Relaxation {
 public:
  Relaxation(const RelaxOptions& options, const Start& start, int fibers, const std::filesystem::path& output)
      : options_(options),
        start_(start),
        fibers_(fibers),
        output_(output),
        options_text_(text_of(options, fibers)),
        case_toml_(weave::to_toml(start.c)) {
    minimize_.method = method_of(options.method);
    minimize_.gradient_tolerance = minimize_.step_tolerance = options.tolerance;
    minimize_.iterations_max = options.iterations;
    minimize_.first_order_max = options.first_order;
    minimize_.stop = &StopSignal::wanted();
    if (!options.quiet) minimize_.on_progress = show;
    minimize_.on_checkpoint = [this](const relax::MinimizeState& state) { save(state); };
  }

  /// Whether the folder holds the results of this relaxation already. Throws std::runtime_error if they are of another case or other
  /// options.
  [[nodiscard]] bool finished() const {
    const std::filesystem::path file = output_ / results_name;
    if (std::filesystem::exists(checkpoint()) || !std::filesystem::exists(file) || !std::filesystem::exists(output_ / summary_name))
      return false;
    const relax::RelaxedFile relaxed = relax::read_relaxed(file);
    expect_same(file, relaxed.case_toml, case_toml_, relaxed.options, options_text_);
    if (relaxed.start.size() > 0) expect_start(file, relaxed.start);
    return true;
  }

  relax::MinimizeResult run() {
    expect_no_unfinished(checkpoint(), options_.resume);
    std::filesystem::create_directories(output_);
    cell_ = start_.cell;
    cell_start_ = start_.q;
    const bool coarser = std::any_of(cell_.yarn.begin(), cell_.yarn.end(),
                                     [&](int yarn) { return std::count(cell_.yarn.begin(), cell_.yarn.end(), yarn) != fibers_; });
    const bool wanted = fibers_ > 0 && coarser;
    std::optional<relax::MinimizeState> taken_up;
    if (options_.resume && std::filesystem::exists(checkpoint())) {
      relax::Checkpoint c = relax::read_checkpoint(checkpoint());
      expect_same(checkpoint(), c.case_toml, case_toml_, c.options, options_text_);
      expect_start(checkpoint(), c.start);
      cell_ = std::move(c.cell);
      cell_start_ = std::move(c.cell_start);
      refined_ = c.refined;
      refinement_ = c.refinement;
      taken_up = std::move(c.state);
      wall_before_ = c.wall;
    }
    const auto minimize = [&](const relax::MinimizeOptions& options) {
      result_ = taken_up ? relax::resume(cell_, *taken_up, options) : relax::minimize(cell_, cell_start_, options);
      taken_up.reset();
      return !result_.interrupted;
    };
    if (wanted && !refined_) {
      // The way to the minimum is long: the coarse fibers go most of it.
      relax::MinimizeOptions rough = minimize_;
      if (rough.method == relax::MinimizeMethod::dynamic) rough.method = relax::MinimizeMethod::automatic;
      if (rough.method == relax::MinimizeMethod::automatic) rough.iterations_max = 0;
      if (!minimize(rough)) return leave_off();
      refine();
    }
    if (!minimize(minimize_)) return leave_off();
    finish();
    return std::move(result_);
  }

 private:
  [[nodiscard]] std::filesystem::path checkpoint() const { return output_ / checkpoint_name; }
  [[nodiscard]] double wall() const { return wall_before_ + std::chrono::duration<double>(Clock::now() - begun_).count(); }

  void expect_start(const std::filesystem::path& file, const Eigen::VectorXd& start) const {
    if (start.size() != start_.q.size() || start != start_.q) throw std::runtime_error(file.string() + ": is of another start");
  }

  void save(const relax::MinimizeState& state) const {
    relax::write_checkpoint(checkpoint(), {case_toml_, options_text_, start_.q, refined_, cell_, cell_start_, state, wall(), refinement_});
  }

  relax::MinimizeResult leave_off() {
    save(result_.state);
    fmt::print(stderr, "interrupted after {} iterations; --resume goes on from {}\n", result_.history.size(), checkpoint().string());
    return std::move(result_);
  }

  /// Goes over to the finer fibers.
  void refine() {
    const auto [fine, x] = relax::refine(cell_, result_.q, fibers_, refined_element_length());
    cell_start_ = relax::unknowns_at(fine, x);
    refinement_ = relax::check_refinement(cell_, result_.q, fine, cell_start_);
    cell_ = fine;
    refined_ = true;
  }

  /// Elements that follow the bends of a yarn of 19 fibers do so with more fibers, too: so the more there are, the more of their diameters
  /// an element is long.
  [[nodiscard]] double refined_element_length() const {
    constexpr double fibers_enough = 19;
    if (options_.element_length > 0) return options_.element_length;
    return start_.c.numerics.element_length * std::sqrt(std::max(1.0, fibers_ / fibers_enough));
  }

  /// Certifies no minimum whose fibers do not stand for the coarse ones.
  void check_refinement() {
    const auto& history = result_.history;
    const auto newton = std::find_if(history.begin(), history.end(), [](const relax::MinimizeProgress& p) { return !p.first_order; });
    double overlap_at_rest = result_.contacts.overlap_max;
    if (newton != history.end()) {
      refinement_.overlap_before_newton = newton->overlap_max;
      // Lengths that are free then were held before: what rested in them may be pressed together deeper than at the end.
      const bool held_till_then = cell_.load_x || cell_.load_y;
      if (held_till_then && newton != history.begin() && std::prev(newton)->gradient_max <= minimize_.first_order_tolerance)
        overlap_at_rest = std::max(overlap_at_rest, newton->overlap_max);
    }
    const std::string broken = refinement_.blocked_by(overlap_at_rest);
    if (broken.empty()) return;
    relax::Certificate& c = result_.certificate;
    c.blocked_by += (c.blocked_by.empty() ? "" : "; ") + broken;
    c.converged = false;
  }

  /// Takes free lengths as those of the cell, and counts the energy from these, as any reader of the file does.
  void settle_lengths() {
    if (!cell_.load_x && !cell_.load_y) return;
    Eigen::VectorXd& q = result_.q;
    relax::settle_lengths(cell_, q);
    result_.energy = relax::potential(cell_, relax::Unknowns(cell_), relax::find_contacts(cell_, q, 0), q, {});
  }

  void finish() {
    const Eigen::MatrixXi order = relax::crossing_order(cell_, cell_start_);
    settle_lengths();
    if (refined_) check_refinement();
    const relax::MinimizeResult& result = result_;
    const relax::Cell& cell = cell_;
    const weave::CellMeasures measures = weave::measure_cell(relax::snapshot_of(cell, result.q));
    relax::ReportContext context;
    context.case_name = start_.c.name;
    context.case_toml = case_toml_;
    context.start = start_.woven ? "woven" : "topology";
    context.mismatch = start_.mismatch;
    context.violations = relax::order_violations(order, relax::crossing_order(cell, result.q));
    context.wall = wall();
    if (refined_) context.refinement = refinement_;
    std::filesystem::remove(output_ / summary_name);  // it comes last: no old one stands beside new results
    relax::write_relaxed(output_ / results_name, {cell, result.q, result.history, case_toml_, options_text_, relax::version(),
                                                  result.certificate.blocked_by, start_.q});
    weave::write_text_file(output_ / summary_name, relax::summary_json(cell, result, measures, context));
    std::filesystem::remove(checkpoint());

    fmt::print("{}: {} fibers, {} nodes, {} unknowns, {} iterations in {:.1f} s\n", start_.c.name, cell.fibers(), cell.nodes(),
               result.q.size(), result.history.size() - 1, context.wall);
    print_certificate(result);
    fmt::print("  thickness {:.4g} mm (mean envelopes {:.4g} mm), fiber volume fraction {:.3f}, crimp warp {:.2f} % weft {:.2f} %\n",
               1e3 * measures.thickness, 1e3 * measures.thickness_mean, measures.fiber_volume_fraction, 1e2 * measures.crimp_warp,
               1e2 * measures.crimp_weft);
    fmt::print("  cell {:.5g} x {:.5g} mm{}\n", 1e3 * cell.length_x, 1e3 * cell.length_y, cell.load_x || cell.load_y ? ", under load" : "");
    fmt::print("  deepest overlap {:.3f} d, {} crossings out of order\n", result.contacts.overlap_max, context.violations);
    if (refined_) {
      fmt::print(
          "  refined: area of a section {:.4f} of the coarse one, {} crossings out of order, overlap before Newton's method {:.3f} d\n",
          refinement_.area_ratio, refinement_.order_violations, refinement_.overlap_before_newton);
    }
    fmt::print("  results in {}\n", output_.string());
  }

  const RelaxOptions& options_;
  const Start& start_;
  int fibers_;
  std::filesystem::path output_;
  std::string options_text_, case_toml_;
  relax::MinimizeOptions minimize_;
  relax::Cell cell_;            ///< that is being relaxed: the start, or the finer one
  Eigen::VectorXd cell_start_;  ///< its unknowns at its start
  relax::MinimizeResult result_;
  bool refined_ = false;
  relax::RefinementCheck refinement_;
  double wall_before_ = 0;
  Clock::time_point begun_ = Clock::now();
};

/// Relaxes a start in a folder of its own, unless that is to be resumed and was done before. Nothing if interrupted.
std::optional<RelaxedColumn> relaxed_in(const std::filesystem::path& folder, const RelaxOptions& options, const Start& start, int fibers,
                                        double value) {
  Relaxation relaxation(options, start, fibers, folder);
  if (options.resume && relaxation.finished()) {
    fmt::print("{}: was relaxed before\n", folder.string());
  } else if (relaxation.run().interrupted) {
    return std::nullopt;
  }
  return read_relaxed_column(folder, value);
}

/// What the summary of several relaxations starts with.
nlohmann::ordered_json summary_of(const Start& start) {
  nlohmann::ordered_json j;
  j["tool"] = "relax";
  j["case"] = start.c.name;
  j["start"] = start.woven ? "woven" : "topology";
  j["version"] = relax::version();
  return j;
}

int exit_status(const std::vector<RelaxedColumn>& columns) {
  return std::all_of(columns.begin(), columns.end(), [](const RelaxedColumn& c) { return c.state.certificate.converged; }) ? 0 : 1;
}

int relax_series(const RelaxOptions& options, const Start& start, const std::filesystem::path& output) {
  using nlohmann::ordered_json;
  const auto begun = Clock::now();
  std::vector<int> counts = options.series;
  std::sort(counts.begin(), counts.end());
  if (std::adjacent_find(counts.begin(), counts.end()) != counts.end()) throw std::invalid_argument("--series: a count stands there twice");
  std::vector<RelaxedColumn> columns;
  for (const int n : counts) {
    const auto column = relaxed_in(output / fmt::format("fibers_{}", n), options, start, n, n);
    if (!column) return 130;
    columns.push_back(*column);
  }
  const std::map<std::string, relax::Extrapolation> endless = extrapolate(columns);
  print_relaxed("fibers a yarn", columns, endless);
  ordered_json j = summary_of(start);
  j["series"] = json_of("fibers_per_yarn", columns);
  for (const auto& [name, e] : endless) j["extrapolated"][name] = {{"value", e.value}, {"uncertainty", e.uncertainty}};
  j["extrapolation"] =
      "least squares of a + b/n over the counts n; uncertainty: the largest difference to that with any one count left out, or with "
      "n^(-1/2) or "
      "n^(-3/2) in place of 1/n; none for fewer than three counts";
  j["wall_s"] = std::chrono::duration<double>(Clock::now() - begun).count();
  j["case_toml"] = weave::to_toml(start.c);
  weave::write_text_file(output / "series.json", j.dump(2) + "\n");
  fmt::print("series in {}\n", (output / "series.json").string());
  return exit_status(columns);
}

std::string pressure_folder(double pressure) {
  return fmt::format("pressure_{:g}", pressure);
}

/// Each pressure from the minimum of the one before.
int relax_pressures(const RelaxOptions& options, Start start, const std::filesystem::path& output) {
  const auto begun = Clock::now();
  std::vector<RelaxedColumn> columns;
  for (const double pressure : options.pressures) {
    RelaxOptions one = options;
    one.pressure = pressure;
    if (columns.empty()) {
      start.cell.pressure = pressure;
      start.q = relax::unknowns_at(start.cell, start.x);
    } else {
      start.cell = columns.back().state.cell;
      start.q = columns.back().state.q;
      relax::set_pressure(start.cell, pressure, start.q);
    }
    const auto column = relaxed_in(output / pressure_folder(pressure), one, start, options.fibers, pressure);
    if (!column) return 130;
    columns.push_back(*column);
  }
  print_relaxed("pressure_Pa", columns);
  nlohmann::ordered_json j = summary_of(start);
  j["pressures"] = json_of("pressure_Pa", columns);
  j["wall_s"] = std::chrono::duration<double>(Clock::now() - begun).count();
  j["case_toml"] = weave::to_toml(start.c);
  weave::write_text_file(output / "summary.json", j.dump(2) + "\n");
  fmt::print("summary in {}\n", (output / "summary.json").string());
  return exit_status(columns);
}

/// The start as it is, and perturbed by the seeds 1, 2 ...
int relax_starts(const RelaxOptions& options, const Start& start, const std::filesystem::path& output) {
  CompareOptions compare;
  compare.output = output / "comparison";
  bool all_converged = true;
  for (int k = 0; k < options.starts; ++k) {
    Start moved = start;
    if (k > 0) relax::perturb(moved.cell, perturbation, static_cast<std::uint64_t>(k), moved.x);
    moved.q = relax::unknowns_at(moved.cell, moved.x);
    compare.results.push_back(output / fmt::format("start_{}", k));
    const auto column = relaxed_in(compare.results.back(), options, moved, options.fibers, k);
    if (!column) return 130;
    all_converged = all_converged && column->state.certificate.converged;
  }
  compare_command(compare);
  return all_converged ? 0 : 1;
}

/// Throws for options that exclude one another.
void check_options(const RelaxOptions& o) {
  if (!o.series.empty() && o.fibers > 0) throw std::invalid_argument("--series: gives the counts in place of --fibers");
  if (!o.pressures.empty() && o.pressure > 0) throw std::invalid_argument("--pressures: gives them in place of --pressure");
  if (!o.pressures.empty() && !o.series.empty())
    throw std::invalid_argument("--pressures: goes with one count of fibers, not with --series");
  if (o.starts > 1 && (!o.series.empty() || !o.pressures.empty()))
    throw std::invalid_argument("--starts: goes with one count of fibers and one pressure, not with --series or --pressures");
  std::set<std::string> folders;
  for (const double pressure : o.pressures) {
    if (!folders.insert(pressure_folder(pressure)).second)
      throw std::invalid_argument(fmt::format("--pressures: {} stands there twice, to six digits", pressure));
  }
  if (o.method == "dynamic" && (o.load_x || o.load_y))
    throw std::invalid_argument("--method dynamic: moves no free length of the cell (--load-x, --load-y)");
}

}  // namespace

int relax_command(const RelaxOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
  check_options(options);
  const StopSignal stop_signal;
  Start start = start_of(options);
  start.cell.pressure = options.pressure;
  start.cell.load_x = options.load_x;
  start.cell.load_y = options.load_y;
  start.q = relax::unknowns_at(start.cell, start.x);
  check_loads(start.cell);
  check_counts(start.cell, options);
  const std::filesystem::path output =
      options.output.empty() ? std::filesystem::path("results") / (start.c.name + "_relaxed") : options.output;
  if (!options.series.empty()) return relax_series(options, start, output);
  if (!options.pressures.empty()) return relax_pressures(options, start, output);
  if (options.starts > 1) return relax_starts(options, start, output);
  const std::filesystem::path checkpoint = output / checkpoint_name;
  if (options.resume && !std::filesystem::exists(checkpoint))
    throw std::runtime_error(checkpoint.string() + ": there is no checkpoint to resume from");
  const relax::MinimizeResult result = Relaxation(options, start, options.fibers, output).run();
  if (result.interrupted) return 130;
  return result.certificate.converged ? 0 : 1;
}

}  // namespace heddle
