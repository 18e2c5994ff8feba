#include "heddle/relax_command.hpp"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "relax/minimize.hpp"
#include "relax/refine.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "relax/series.hpp"
#include "relax/topology_start.hpp"
#include "relax/version.hpp"
#include "relax/woven_start.hpp"
#include "weave/case.hpp"
#include "weave/measures.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<bool> stop_wanted = false;

void on_signal(int) {
  stop_wanted = true;
}

void show(const relax::MinimizeProgress& p) {
  fmt::print(stderr,
             "{:4}  energy {:.9e} J  gradient {:.2e}  step {:.2e} m  shift {:.1e}{}  {} contact points  factor {:.2g} s  solve {:.2g} s  "
             "{:.1f} s\n",
             p.iteration, p.energy, p.gradient_max, p.step_max, p.shift,
             p.first_order ? " first order"
             : p.convex    ? " convex"
                           : "",
             p.touching, p.factorization, p.solution, p.wall);
}

void print_certificate(const relax::MinimizeResult& r) {
  const relax::Certificate& c = r.certificate;
  fmt::print("  {}\n", c.converged ? "certified minimum, without friction" : "NOT CONVERGED: " + c.blocked_by);
  fmt::print("  gradient {:.2e} of {:.3g} N, Hessian {}positive definite, Newton step {:.2e} d, contacts {}, pins hold {:.2e}\n",
             c.gradient_max, r.reference_tension, c.positive_definite ? "" : "not ", c.newton_step_max,
             c.contacts_steady ? "steady" : "not steady", c.pin_force_max);
}

/// What is to be relaxed.
struct Start {
  weave::Case c;
  relax::Cell cell;
  std::vector<weave::Vec3> x;
  bool woven = false;
  relax::FaceMismatch mismatch;
};

/// A results file, or the last unit cell in a results folder; empty for a case.
std::filesystem::path woven_file(const std::filesystem::path& input) {
  if (std::filesystem::is_directory(input) && std::filesystem::exists(input / "cell.vtkhdf")) return input / "cell.vtkhdf";
  return input.extension() == ".vtkhdf" ? input : std::filesystem::path();
}

Start start_of(const RelaxOptions& options) {
  Start start;
  if (const std::filesystem::path file = woven_file(options.input); !file.empty()) {
    if (options.start_fibers > 0) throw std::invalid_argument("--start-fibers: a woven cell starts with the fibers that it has");
    const weave::ResultsFile results = weave::read_results(file);
    start.c = weave::parse_case(results.case_toml, file.string(), options.overrides);
    relax::WovenOptions woven{options.warp_tension, options.weft_tension, start.c.numerics.element_length};
    if (options.element_length > 0) woven.element_length = options.element_length;
    relax::WovenStart cut = relax::cell_from_woven(start.c, results.snapshot, woven);
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

/// A cell at its minimum, or where it was left.
struct Relaxed {
  relax::Cell cell;
  relax::MinimizeResult result;
  weave::Snapshot snapshot;
  weave::CellMeasures measures;
};

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
    minimize_.stop = &stop_wanted;
    if (!options.quiet) minimize_.on_progress = show;
    minimize_.on_checkpoint = [this](const relax::MinimizeState& state) { save(state); };
  }

  Relaxed run() {
    std::filesystem::create_directories(output_);
    relax::Cell& cell = relaxed_.cell;
    cell = start_.cell;
    cell_start_ = start_q_ = relax::unknowns_at(cell, start_.x);
    const bool coarser = std::any_of(cell.yarn.begin(), cell.yarn.end(),
                                     [&](int yarn) { return std::count(cell.yarn.begin(), cell.yarn.end(), yarn) != fibers_; });
    const bool wanted = fibers_ > 0 && coarser;
    bool taken_up = false;
    relax::MinimizeState state;
    if (options_.resume && std::filesystem::exists(checkpoint())) {
      relax::Checkpoint c = relax::read_checkpoint(checkpoint());
      expect_same(checkpoint(), c.case_toml, case_toml_, c.options, options_text_);
      if (c.start.size() != start_q_.size() || c.start != start_q_)
        throw std::runtime_error(checkpoint().string() + ": is of another start");
      cell = std::move(c.cell);
      cell_start_ = std::move(c.cell_start);
      refined_ = c.refined;
      state = std::move(c.state);
      wall_before_ = c.wall;
      taken_up = true;
    } else if (options_.resume) {
      throw std::runtime_error(checkpoint().string() + ": there is no checkpoint to resume from");
    }
    if (wanted && !refined_) {
      // The way to the minimum is long: the coarse fibers go most of it.
      relax::MinimizeOptions rough = minimize_;
      if (rough.method == relax::MinimizeMethod::dynamic) rough.method = relax::MinimizeMethod::automatic;
      if (rough.method == relax::MinimizeMethod::automatic) rough.iterations_max = 0;
      relaxed_.result = taken_up ? relax::resume(cell, state, rough) : relax::minimize(cell, cell_start_, rough);
      taken_up = false;
      if (relaxed_.result.interrupted) return leave_off();
      const double element_length = options_.element_length > 0 ? options_.element_length : start_.c.numerics.element_length;
      std::vector<weave::Vec3> x;
      std::tie(cell, x) = relax::refine(cell, relaxed_.result.q, fibers_, element_length);
      cell_start_ = relax::unknowns_at(cell, x);
      refined_ = true;
    }
    relaxed_.result = taken_up ? relax::resume(cell, state, minimize_) : relax::minimize(cell, cell_start_, minimize_);
    if (relaxed_.result.interrupted) return leave_off();
    finish();
    return std::move(relaxed_);
  }

 private:
  [[nodiscard]] std::filesystem::path checkpoint() const { return output_ / "checkpoint.h5"; }
  [[nodiscard]] double wall() const { return wall_before_ + std::chrono::duration<double>(Clock::now() - begun_).count(); }

  void save(const relax::MinimizeState& state) const {
    relax::write_checkpoint(checkpoint(), {case_toml_, options_text_, start_q_, refined_, relaxed_.cell, cell_start_, state, wall()});
  }

  Relaxed leave_off() {
    save(relaxed_.result.state);
    fmt::print(stderr, "interrupted after {} iterations; --resume goes on from {}\n", relaxed_.result.history.size(),
               checkpoint().string());
    return std::move(relaxed_);
  }

  /// Takes free lengths as those of the cell, and counts the energy from these, as any reader of the file does.
  void settle_lengths() {
    relax::Cell& cell = relaxed_.cell;
    if (!cell.load_x && !cell.load_y) return;
    Eigen::VectorXd& q = relaxed_.result.q;
    relax::settle_lengths(cell, q);
    relaxed_.result.energy = relax::potential(cell, relax::Unknowns(cell), relax::find_contacts(cell, q, 0), q, {});
  }

  void finish() {
    const Eigen::MatrixXi order = relax::crossing_order(relaxed_.cell, cell_start_);
    settle_lengths();
    const relax::MinimizeResult& result = relaxed_.result;
    const relax::Cell& cell = relaxed_.cell;
    relaxed_.snapshot = relax::snapshot_of(cell, result.q);
    relaxed_.measures = weave::measure_cell(relaxed_.snapshot);
    const weave::CellMeasures& measures = relaxed_.measures;
    relax::ReportContext context;
    context.case_name = start_.c.name;
    context.case_toml = case_toml_;
    context.start = start_.woven ? "woven" : "topology";
    context.mismatch = start_.mismatch;
    context.violations = relax::order_violations(order, relax::crossing_order(cell, result.q));
    context.wall = wall();
    relax::write_relaxed(output_ / "relax.vtkhdf",
                         {cell, result.q, result.history, case_toml_, options_text_, relax::version(), result.certificate.blocked_by});
    weave::write_text_file(output_ / "summary.json", relax::summary_json(cell, result, measures, context));
    std::filesystem::remove(checkpoint());

    fmt::print("{}: {} fibers, {} nodes, {} unknowns, {} iterations in {:.1f} s\n", start_.c.name, cell.fibers(), cell.nodes(),
               result.q.size(), result.history.size() - 1, context.wall);
    print_certificate(result);
    fmt::print("  thickness {:.4g} mm (mean envelopes {:.4g} mm), fiber volume fraction {:.3f}, crimp warp {:.2f} % weft {:.2f} %\n",
               1e3 * measures.thickness, 1e3 * measures.thickness_mean, measures.fiber_volume_fraction, 1e2 * measures.crimp_warp,
               1e2 * measures.crimp_weft);
    fmt::print("  cell {:.5g} x {:.5g} mm{}\n", 1e3 * cell.length_x, 1e3 * cell.length_y, cell.load_x || cell.load_y ? ", under load" : "");
    fmt::print("  deepest overlap {:.3f} d, {} crossings out of order\n  results in {}\n", result.contacts.overlap_max, context.violations,
               output_.string());
  }

  const RelaxOptions& options_;
  const Start& start_;
  int fibers_;
  std::filesystem::path output_;
  std::string options_text_, case_toml_;
  relax::MinimizeOptions minimize_;
  Relaxed relaxed_;
  Eigen::VectorXd start_q_, cell_start_;  ///< unknowns of the start, and of the cell that is being relaxed
  bool refined_ = false;
  double wall_before_ = 0;
  Clock::time_point begun_ = Clock::now();
};

/// What a series tells about one count, name by name.
std::vector<std::pair<std::string, double>> figures_of(const Relaxed& r) {
  const weave::CellMeasures& m = r.measures;
  std::vector<std::pair<std::string, double>> figures = {{"thickness_m", m.thickness},
                                                         {"thickness_mean_m", m.thickness_mean},
                                                         {"fiber_volume_fraction", m.fiber_volume_fraction},
                                                         {"fiber_volume_fraction_mean", m.fiber_volume_fraction_mean},
                                                         {"cell_length_m", r.cell.length_x},
                                                         {"cell_width_m", r.cell.length_y},
                                                         {"energy_J", r.result.energy.sum()},
                                                         {"crimp_warp", m.crimp_warp},
                                                         {"crimp_weft", m.crimp_weft}};
  const std::pair<std::string, double> sizes[] = {{"warp_width_m", m.yarn_width_warp},
                                                  {"warp_height_m", m.yarn_height_warp},
                                                  {"weft_width_m", m.yarn_width_weft},
                                                  {"weft_height_m", m.yarn_height_weft}};
  for (const auto& size : sizes) {
    if (!std::isnan(size.second)) figures.push_back(size);
  }
  return figures;
}

int relax_series(const RelaxOptions& options, const Start& start, const std::filesystem::path& output) {
  using nlohmann::ordered_json;
  const auto begun = Clock::now();
  std::vector<int> counts = options.series;
  std::sort(counts.begin(), counts.end());
  if (std::adjacent_find(counts.begin(), counts.end()) != counts.end()) throw std::invalid_argument("--series: a count stands there twice");
  std::vector<std::vector<std::pair<std::string, double>>> figures;
  ordered_json rows = ordered_json::array();
  bool all_converged = true;
  for (const int n : counts) {
    const auto since = Clock::now();
    const Relaxed relaxed = Relaxation(options, start, n, output / fmt::format("fibers_{}", n)).run();
    if (relaxed.result.interrupted) return 130;
    figures.push_back(figures_of(relaxed));
    ordered_json row = {{"fibers_per_yarn", n}, {"converged", relaxed.result.certificate.converged}};
    for (const auto& [name, value] : figures.back()) row[name] = value;
    row["wall_s"] = std::chrono::duration<double>(Clock::now() - since).count();
    rows.push_back(row);
    all_converged = all_converged && relaxed.result.certificate.converged;
  }
  ordered_json endless;
  fmt::print("\n{:<28}", "fibers a yarn");
  for (const int n : counts) fmt::print("{:>13}", n);
  fmt::print("{:>28}\n", counts.size() < 3 ? "" : "extrapolated");
  for (std::size_t i = 0; i < figures.front().size(); ++i) {
    const std::string& name = figures.front()[i].first;
    std::vector<double> values;
    fmt::print("{:<28}", name);
    for (const auto& row : figures) {
      values.push_back(row.at(i).second);
      fmt::print("{:>13.5g}", values.back());
    }
    if (const auto e = relax::extrapolate(counts, values)) {
      endless[name] = {{"value", e->value}, {"uncertainty", e->uncertainty}};
      fmt::print("{:>14.5g} +- {:<10.2g}", e->value, e->uncertainty);
    }
    fmt::print("\n");
  }
  ordered_json j;
  j["tool"] = "relax";
  j["case"] = start.c.name;
  j["start"] = start.woven ? "woven" : "topology";
  j["version"] = relax::version();
  j["series"] = rows;
  j["extrapolated"] = endless;
  j["extrapolation"] =
      "least squares of a + b/n over the counts n; uncertainty: the largest difference to that with any one count left out, or with "
      "n^(-1/2) or "
      "n^(-3/2) in place of 1/n; none for fewer than three counts";
  j["wall_s"] = std::chrono::duration<double>(Clock::now() - begun).count();
  j["case_toml"] = weave::to_toml(start.c);
  weave::write_text_file(output / "series.json", j.dump(2) + "\n");
  fmt::print("series in {}\n", (output / "series.json").string());
  return all_converged ? 0 : 1;
}

}  // namespace

int relax_command(const RelaxOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
  if (!options.series.empty() && options.fibers > 0) throw std::invalid_argument("--series: gives the counts in place of --fibers");
  if (!options.series.empty() && options.resume) throw std::invalid_argument("--resume: goes on with one relaxation, not with a series");
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  Start start = start_of(options);
  start.cell.pressure = options.pressure;
  start.cell.load_x = options.load_x;
  start.cell.load_y = options.load_y;
  check_loads(start.cell);
  if (options.method == "dynamic" && (options.load_x || options.load_y))
    throw std::invalid_argument("--method dynamic: moves no free length of the cell (--load-x, --load-y)");
  const std::filesystem::path output =
      options.output.empty() ? std::filesystem::path("results") / (start.c.name + "_relaxed") : options.output;
  if (!options.series.empty()) return relax_series(options, start, output);
  const Relaxed relaxed = Relaxation(options, start, options.fibers, output).run();
  if (relaxed.result.interrupted) return 130;
  return relaxed.result.certificate.converged ? 0 : 1;
}

}  // namespace heddle
