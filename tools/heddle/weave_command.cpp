#include "heddle/weave_command.hpp"

#include <fmt/format.h>
#include <omp.h>

#include "heddle/draft.hpp"
#include "heddle/results_folder.hpp"
#include "heddle/stop_signal.hpp"
#include "weave/case.hpp"
#include "weave/weaving_run.hpp"

namespace heddle {
namespace {

std::string duration(double seconds) {
  const auto s = static_cast<long>(seconds);
  if (s < 3600) return fmt::format("{}:{:02}", s / 60, s % 60);
  return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

void show(const weave::RunProgress& p) {
  fmt::print(stderr, "\rpick {}/{}  {:<11}  {:8.3f} ms of {:.0f}  dt {:.3g} us  {:.0f} steps/s  {} gone, {} left   ", p.pick, p.picks,
             p.action, 1e3 * p.time, 1e3 * p.time_end, 1e6 * p.dt, p.steps_per_second, duration(p.wall), duration(p.left));
}

}  // namespace

int weave_command(const WeaveOptions& options) {
  if (options.threads > 0) omp_set_num_threads(options.threads);
  const weave::Case c = weave::load_case(options.case_file, options.overrides);
  weave::RunOptions run;
  run.output = options.output.empty() ? std::filesystem::path("results") / c.name : options.output;
  run.resume = options.resume;
  expect_no_unfinished(run.output / "checkpoint.h5", options.resume);
  run.stop_after_pick = options.picks;
  const StopSignal stop_signal;
  run.stop = &StopSignal::wanted();
  if (!options.quiet) run.on_progress = show;
  const weave::WeaveResult result = weave::weave_cloth(c, run);
  if (!options.quiet) fmt::print(stderr, "\n");
  const weave::WeaveSummary& s = result.summary;
  if (result.status == weave::RunStatus::interrupted && !StopSignal::wanted()) {
    fmt::print("stopped after {} of {} picks; go on with --resume\n  results in {}\n", s.picks, c.cells * c.picks_per_cell(),
               run.output.string());
    return 0;
  }
  if (result.status != weave::RunStatus::completed) {
    fmt::print(stderr, "{}: {}\n", result.status == weave::RunStatus::failed ? "stopped" : "interrupted", result.message);
    return result.status == weave::RunStatus::failed ? 1 : 130;
  }
  fmt::print("{}: {} picks woven in {} ({} steps of {:.3g} us, {} nodes)\n", c.name, s.picks, duration(s.wall), s.steps, 1e6 * s.dt_mean,
             s.nodes);
  fmt::print("  thickness {:.4g} mm (mean envelopes {:.4g} mm), fiber volume fraction {:.3f}, crimp warp {:.2f} % weft {:.2f} %\n",
             1e3 * s.cell.thickness, 1e3 * s.cell.thickness_mean, s.cell.fiber_volume_fraction, 1e2 * s.cell.crimp_warp,
             1e2 * s.cell.crimp_weft);
  fmt::print("  reed load in the last cell's blows up to {:.4g} N, in the mean {:.4g} N, {:.2f} of what its warps pull\n", s.reed_load_max,
             s.reed_load_mean, s.reed_load_mean / c.warp_tension());
  fmt::print("  mean warp tension {:.4g} N, deepest overlap {:.3f} d\n", s.warp_tension_mean, s.overlap_max);
  if (!s.steadiness.empty()) {
    fmt::print("  last two cells differ by {:.3f} d (mean), {:.3f} d (largest)\n", s.steadiness.back().mean, s.steadiness.back().largest);
  }
  fmt::print("  wefts of a column apart by {:.3g} mm at most, {} out of layer; fibers up to {:.2g} % longer than their yarn\n",
             1e3 * s.order.column_spread, s.order.wefts_out_of_layer, 1e2 * s.order.fiber_slack);
  fmt::print("  energy ledger open by {:.2e} of the work put in\n  results in {}\n", s.energy_residual, run.output.string());
  return 0;
}

int check_command(const CheckOptions& options) {
  const weave::Case c = weave::load_case(options.case_file, options.overrides);
  const weave::RunEstimate e = weave::estimate_run(c);
  fmt::print("{}: {}\n", c.name, c.title);
  fmt::print("  unit cell        {:.4g} x {:.4g} mm, {} picks, {} warps in {} sections and {} dents\n", 1e3 * c.cell_length(),
             1e3 * c.cell_width(), c.picks_per_cell(), e.warps, c.sections.size(), c.dents());
  fmt::print("  to weave         {} cells, {} picks, {:.4g} s of loom time\n", c.cells, e.picks, e.simulated_time);
  for (const auto& [name, y] : c.yarns) {
    fmt::print("  yarn {:<12}{} fibers of {:.4g} um radius, solid area {:.4g} mm2\n", name, y.fibers, 1e6 * y.fiber_radius(),
               1e6 * y.fiber_area() * y.fibers);
  }
  fmt::print("  fibers, nodes    up to {} and {}\n", e.fibers, e.nodes_end);
  fmt::print("  time step        about {:.3g} us (axial wave alone: {:.3g} us)\n", 1e6 * e.time_step, 1e6 * e.explicit_time_step);
  fmt::print("  steps            about {:.2g}\n", e.steps);
  fmt::print("  memory           about {:.3g} MB\n", 1e-6 * e.memory);
  fmt::print("  time             about {} on {} threads\n", duration(e.wall), omp_get_max_threads());
  for (const std::string& row : weave::rows_of(c.matrix())) fmt::print("  {}\n", row);
  if (!options.draft.empty()) {
    draw_draft(c, options.draft);
    fmt::print("  draft in {}\n", options.draft.string());
  }
  return 0;
}

}  // namespace heddle
