#include "heddle/curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "heddle/picture.hpp"
#include "heddle/plot.hpp"

namespace heddle {

namespace {

constexpr Color blue{0.17, 0.42, 0.69}, red{0.80, 0.22, 0.18}, green{0.18, 0.56, 0.36}, violet{0.45, 0.35, 0.68};

std::vector<double> times(const std::vector<double>& values, double factor) {
  std::vector<double> scaled;
  scaled.reserve(values.size());
  for (const double value : values) scaled.push_back(value * factor);
  return scaled;
}

double largest(const std::vector<double>& values) {
  double most = 0;
  for (const double value : values) most = std::max(most, std::abs(value));
  return most;
}

/// Draws curves of one history; what they share.
struct Curves {
  const weave::History& history;
  std::filesystem::path folder;
  std::string extension;
  int width_px = 0;
  std::vector<std::filesystem::path>& written;

  Unit time_unit = readable_unit(history.time_s.back(), "s");
  std::vector<double> time = times(history.time_s, time_unit.factor);

  [[nodiscard]] Plot plot(const std::string& title, const std::string& v_label) const {
    Plot plot;
    plot.title = title;
    plot.u_label = "time [" + time_unit.name + "]";
    plot.v_label = v_label;
    for (std::size_t i = 0; i < time.size() && history.pick.size() == time.size(); ++i)
      if (i == 0 || history.pick[i] != history.pick[i - 1]) plot.bands.push_back(i == 0 ? 0 : time[i - 1]);
    if (!plot.bands.empty()) plot.bands.push_back(time.back());
    return plot;
  }

  void draw(const std::string& name, const std::vector<Plot>& plots, const std::vector<double>& heights) {
    const std::filesystem::path file = folder / ("curve_" + name + "." + extension);
    draw_plots(file, plots, heights, width_px);
    written.push_back(file);
  }
};

void draw_reed_load(Curves& curves) {
  const weave::History& h = curves.history;
  const Unit force = readable_unit(largest(h.reed_load_N), "N");
  Plot plot = curves.plot("Reed load per unit cell", "reed load [" + force.name + "]");
  plot.from_zero = true;
  plot.series.push_back({"load", blue, curves.time, times(h.reed_load_N, force.factor)});
  plot.series.push_back({"largest of each beat-up", red, times(h.beat_time_s, curves.time_unit.factor),
                         times(h.reed_load_per_beat_N, force.factor), Series::Style::circles});
  curves.draw("reed_load", {plot}, {760});
}

void draw_warp_tension(Curves& curves) {
  const Unit force = readable_unit(largest(curves.history.warp_tension_N), "N");
  Plot plot = curves.plot("Warp tension, mean over the warps", "tension per yarn [" + force.name + "]");
  plot.from_zero = true;
  plot.series.push_back({"", blue, curves.time, times(curves.history.warp_tension_N, force.factor)});
  curves.draw("warp_tension", {plot}, {760});
}

void draw_overlap(Curves& curves) {
  Plot plot = curves.plot("Largest contact overlap", "overlap [fiber diameters]");
  plot.from_zero = true;
  plot.series.push_back({"", blue, curves.time, curves.history.overlap});
  curves.draw("overlap", {plot}, {760});
}

std::vector<double> sum_of(const std::vector<const std::vector<double>*>& columns) {
  std::vector<double> sum(columns.front()->size());
  for (const std::vector<double>* column : columns)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += (*column)[i];
  return sum;
}

void draw_energy(Curves& curves) {
  const weave::History& h = curves.history;
  const std::vector<double> stored = sum_of({&h.kinetic_J, &h.bars_J, &h.contact_J, &h.friction_store_J, &h.heddle_J});
  const std::vector<double> lost = sum_of({&h.slip_J, &h.damping_J});
  const std::vector<double> put_in = sum_of({&h.work_tension_J, &h.work_reed_J, &h.work_heddle_J, &h.work_take_up_J, &h.work_insertion_J});
  const Unit energy = readable_unit(std::max({largest(stored), largest(lost), largest(put_in)}), "J");
  const Unit small = readable_unit(largest(h.residual_J), "J");
  Plot ledger = curves.plot("Energy ledger", "energy [" + energy.name + "]");
  ledger.u_label = "";
  ledger.series.push_back({"put in", blue, curves.time, times(put_in, energy.factor)});
  ledger.series.push_back({"lost to slip and damping", red, curves.time, times(lost, energy.factor)});
  ledger.series.push_back({"stored", green, curves.time, times(stored, energy.factor)});
  Plot residual = curves.plot("Residual: stored + lost \u2212 put in", "residual [" + small.name + "]");
  residual.series.push_back({"", violet, curves.time, times(h.residual_J, small.factor)});
  curves.draw("energy", {ledger, residual}, {660, 400});
}

}  // namespace

void draw_curves(const weave::History& history, const ViewOptions& options, std::vector<std::filesystem::path>& written) {
  if (history.time_s.empty()) return;
  for (const std::vector<double>* column :
       {&history.reed_load_N, &history.warp_tension_N, &history.overlap, &history.kinetic_J, &history.bars_J, &history.contact_J,
        &history.friction_store_J, &history.heddle_J, &history.slip_J, &history.damping_J, &history.work_tension_J, &history.work_reed_J,
        &history.work_heddle_J, &history.work_take_up_J, &history.work_insertion_J, &history.residual_J})
    if (column->size() != history.time_s.size())
      throw std::runtime_error(fmt::format("{}: /history: a column has {} rows where time_s has {}", options.results.string(),
                                           column->size(), history.time_s.size()));
  if (history.beat_time_s.size() != history.reed_load_per_beat_N.size())
    throw std::runtime_error(fmt::format("{}: /history: beat_time_s has {} rows, reed_load_per_beat_N {}", options.results.string(),
                                         history.beat_time_s.size(), history.reed_load_per_beat_N.size()));
  Curves curves{history, options.output, options.format, options.width_px, written};
  draw_reed_load(curves);
  draw_warp_tension(curves);
  draw_energy(curves);
  draw_overlap(curves);
}

void draw_convergence(const std::vector<relax::MinimizeProgress>& history, const ViewOptions& options,
                      std::vector<std::filesystem::path>& written) {
  if (history.empty()) return;
  const double end = history.back().energy, scale = end != 0 ? std::abs(end) : 1;
  Plot gradient, energy;
  gradient.title = "Convergence of the relaxation";
  gradient.v_label = "gradient / reference tension";
  energy.v_label = "energy above its end / end";
  energy.u_label = "iteration";
  bool named[2] = {false, false};
  for (std::size_t first = 0, last = 0; first < history.size(); first = last) {
    const bool first_order = history[first].first_order;
    Series g{named[first_order] ? "" : first_order ? "first-order phase" : "Newton's method", first_order ? blue : red, {}, {}};
    named[first_order] = true;
    Series e{"", g.color, {}, {}};
    for (last = first; last < history.size() && history[last].first_order == first_order; ++last) {
      const auto iteration = static_cast<double>(last);
      if (history[last].gradient_max > 0) {
        g.u.push_back(iteration);
        g.v.push_back(history[last].gradient_max);
      }
      if (history[last].energy > end) {
        e.u.push_back(iteration);
        e.v.push_back((history[last].energy - end) / scale);
      }
    }
    if (first_order)
      for (Plot* plot : {&gradient, &energy})
        plot->bands.insert(plot->bands.end(), {static_cast<double>(first), static_cast<double>(last)});
    if (!g.u.empty()) gradient.series.push_back(std::move(g));
    if (!e.u.empty()) energy.series.push_back(std::move(e));
  }
  std::vector<Plot> plots;
  for (Plot* plot : {&gradient, &energy}) {
    plot->log_v = true;
    plot->bands.push_back(static_cast<double>(history.size() - 1));  // the same iterations in both
    if (!plot->series.empty()) plots.push_back(std::move(*plot));
  }
  if (plots.empty()) return;
  written.push_back(options.output / ("curve_convergence." + options.format));
  draw_plots(written.back(), plots, std::vector<double>(plots.size(), 560), options.width_px);
}

}  // namespace heddle
