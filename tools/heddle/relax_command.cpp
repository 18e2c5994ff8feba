#include "relax_command.hpp"

#include <fmt/format.h>

#include <chrono>

#include "relax/minimize.hpp"
#include "relax/report.hpp"
#include "relax/topology_start.hpp"
#include "relax/version.hpp"
#include "weave/case.hpp"
#include "weave/measures.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

void show(const relax::MinimizeProgress& p) {
  fmt::print(stderr, "{:4}  energy {:.9e} J  gradient {:.2e}  step {:.2e} m  shift {:.1e}{}  {} contact points  {:.1f} s\n", p.iteration, p.energy,
             p.gradient_max, p.step_max, p.shift, p.convex ? " convex" : "", p.touching, p.wall);
}

void print_certificate(const relax::MinimizeResult& r) {
  const relax::Certificate& c = r.certificate;
  fmt::print("  {}\n", c.converged ? "certified minimum, without friction" : "NOT CONVERGED: " + c.blocked_by);
  fmt::print("  gradient {:.2e} of {:.3g} N, Hessian {}positive definite, Newton step {:.2e} d, contacts {}, pins hold {:.2e}\n", c.gradient_max,
             r.reference_tension, c.positive_definite ? "" : "not ", c.newton_step_max, c.contacts_steady ? "steady" : "not steady", c.pin_force_max);
}

}  // namespace

int relax_command(const RelaxOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> overrides = options.overrides;
  weave::Case c = weave::load_case(options.input, overrides);
  if (options.fibers > 0) {
    for (const auto& [name, yarn] : c.yarns) overrides.push_back(fmt::format("yarns.{}.fibers={}", name, options.fibers));
    c = weave::load_case(options.input, overrides);
  }
  relax::TopologyOptions topology;
  topology.warp_tension = options.warp_tension > 0 ? options.warp_tension : c.loom.tension;
  topology.weft_tension = options.weft_tension > 0 ? options.weft_tension : topology.warp_tension;
  topology.element_length = options.element_length > 0 ? options.element_length : c.numerics.element_length;
  auto [cell, x] = relax::cell_from_topology(c, topology);
  cell.pressure = options.pressure;
  const Eigen::VectorXd q = relax::unknowns_at(cell, x);

  relax::MinimizeOptions minimize;
  minimize.iterations_max = options.iterations;
  if (!options.quiet) minimize.on_progress = show;
  const relax::MinimizeResult result = relax::minimize(cell, q, minimize);

  const weave::Snapshot snapshot = relax::snapshot_of(cell, result.q);
  const weave::CellMeasures measures = weave::measure_cell(snapshot);
  relax::ReportContext context;
  context.case_name = c.name;
  context.case_toml = weave::to_toml(c);
  context.start = "topology";
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
