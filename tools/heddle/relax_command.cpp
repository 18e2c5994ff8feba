#include "relax_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <stdexcept>
#include <tuple>

#include "relax/minimize.hpp"
#include "relax/refine.hpp"
#include "relax/report.hpp"
#include "relax/topology_start.hpp"
#include "relax/version.hpp"
#include "relax/woven_start.hpp"
#include "weave/case.hpp"
#include "weave/measures.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

void show(const relax::MinimizeProgress& p) {
  fmt::print(stderr, "{:4}  energy {:.9e} J  gradient {:.2e}  step {:.2e} m  shift {:.1e}{}  {} contact points  {:.1f} s\n", p.iteration,
             p.energy, p.gradient_max, p.step_max, p.shift,
             p.first_order ? " first order"
             : p.convex    ? " convex"
                           : "",
             p.touching, p.wall);
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
    fmt::print("cut out of {}: it leaned by {:.3f} d; warps meet across the faces within {:.3f} d (mean), {:.3f} d (largest), {} go on in another place\n",
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
  topology.warp_tension = options.warp_tension > 0 ? options.warp_tension : start.c.loom.tension;
  topology.weft_tension = options.weft_tension > 0 ? options.weft_tension : topology.warp_tension;
  topology.element_length = options.element_length > 0 ? options.element_length : start.c.numerics.element_length;
  std::tie(start.cell, start.x) = relax::cell_from_topology(start.c, topology);
  return start;
}

}  // namespace

int relax_command(const RelaxOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  Start state = start_of(options);
  const weave::Case& c = state.c;
  relax::Cell& cell = state.cell;
  cell.pressure = options.pressure;
  Eigen::VectorXd q = relax::unknowns_at(cell, state.x);

  relax::MinimizeOptions minimize;
  minimize.iterations_max = options.iterations;
  minimize.first_order_max = options.first_order;
  if (!options.quiet) minimize.on_progress = show;
  if (options.fibers > 0) {
    // The way to the minimum is long: the coarse fibers go most of it.
    relax::MinimizeOptions rough = minimize;
    rough.iterations_max = 0;
    q = relax::minimize(cell, q, rough).q;
    const double element_length = options.element_length > 0 ? options.element_length : c.numerics.element_length;
    std::tie(cell, state.x) = relax::refine(cell, q, options.fibers, element_length);
    q = relax::unknowns_at(cell, state.x);
  }
  const relax::MinimizeResult result = relax::minimize(cell, q, minimize);

  const weave::Snapshot snapshot = relax::snapshot_of(cell, result.q);
  const weave::CellMeasures measures = weave::measure_cell(snapshot);
  relax::ReportContext context;
  context.case_name = c.name;
  context.case_toml = weave::to_toml(c);
  context.start = state.woven ? "woven" : "topology";
  context.mismatch = state.mismatch;
  context.violations = relax::order_violations(relax::crossing_order(cell, q), relax::crossing_order(cell, result.q));
  context.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::filesystem::path output = options.output.empty() ? std::filesystem::path("results") / (c.name + "_relaxed") : options.output;
  std::filesystem::create_directories(output);
  weave::write_results(output / "relax.vtkhdf", {snapshot, {}, context.case_toml, relax::version()});
  weave::write_text_file(output / "summary.json", relax::summary_json(cell, result, measures, context));

  fmt::print("{}: {} fibers, {} nodes, {} unknowns, {} iterations in {:.1f} s\n", c.name, cell.fibers(), cell.nodes(), q.size(),
             result.history.size() - 1, context.wall);
  print_certificate(result);
  fmt::print("  thickness {:.4g} mm (mean envelopes {:.4g} mm), fiber volume fraction {:.3f}, crimp warp {:.2f} % weft {:.2f} %\n",
             1e3 * measures.thickness, 1e3 * measures.thickness_mean, measures.fiber_volume_fraction, 1e2 * measures.crimp_warp,
             1e2 * measures.crimp_weft);
  fmt::print("  deepest overlap {:.3f} d, {} crossings out of order\n  results in {}\n", result.contacts.overlap_max, context.violations,
             output.string());
  return result.certificate.converged ? 0 : 1;
}

}  // namespace heddle
