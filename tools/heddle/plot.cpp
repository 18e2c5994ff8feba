#include "heddle/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace heddle {

namespace {

double tick_step(double low, double high, double count) {
  const double rough = (high - low) / std::max(1.0, count);
  const double power = std::pow(10, std::floor(std::log10(rough)));
  for (const double factor : {1.0, 2.0, 5.0})
    if (rough <= factor * power * (1 + 1e-9)) return factor * power;
  return 10 * power;
}

/// "10" with the exponent raised.
std::string power_label(double exponent) {
  static constexpr std::array<const char*, 10> raised = {"\u2070", "\u00b9", "\u00b2", "\u00b3", "\u2074",
                                                         "\u2075", "\u2076", "\u2077", "\u2078", "\u2079"};
  std::string label = "10";
  for (const char c : fmt::format("{:.0f}", exponent)) label += c == '-' ? "\u207b" : raised.at(static_cast<std::size_t>(c - '0'));
  return label;
}

void draw_legend(Canvas& canvas, const std::vector<Series>& series, Point right_center, double unit) {
  const TextStyle style{16 * unit, ink};
  double x = right_center.x;
  for (auto s = series.rbegin(); s != series.rend(); ++s) {
    if (s->label.empty()) continue;
    x -= canvas.text_width(s->label, style);
    canvas.text({x, right_center.y}, s->label, style);
    x -= 10 * unit;
    if (s->style == Series::Style::circles)
      canvas.ellipse({x - 12 * unit, right_center.y}, 5 * unit, 5 * unit, 0, white, s->color, 2 * unit);
    else
      canvas.line({{x - 26 * unit, right_center.y}, {x, right_center.y}}, s->color, 3 * unit);
    x -= 26 * unit + 22 * unit;
  }
}

/// Whether two values differ by more than rounding.
bool differ(double low, double high) {
  return high - low > 1e-9 * std::max(std::abs(low), std::abs(high));
}

}  // namespace

std::vector<double> ticks(double low, double high, double count) {
  std::vector<double> values;
  if (!differ(low, high)) return values;
  const double step = tick_step(low, high, count);
  for (double n = std::ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; ++n) values.push_back(n * step);
  return values;
}

std::string tick_label(double value, double step) {
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
  std::string label = fmt::format("{:.{}f}", std::abs(value) < 0.4 * step ? 0.0 : value, digits);
  if (label.front() == '-') label.replace(0, 1, "\u2212");
  return label;
}

void draw_axes(Canvas& canvas, const Frame& frame, const std::string& u_label, const std::string& v_label, double unit, bool grid) {
  const TextStyle number{15 * unit, ink};
  const double mark = 6 * unit;

  const std::vector<double> u_ticks = ticks(frame.u_min, frame.u_max, std::max(2.0, frame.width / (95 * unit)));
  const double u_step = u_ticks.size() > 1 ? u_ticks[1] - u_ticks[0] : 1;
  for (const double u : u_ticks) {
    const double x = frame.at(u, frame.v_min).x;
    if (grid) canvas.line({{x, frame.top_left.y}, {x, frame.bottom()}}, grid_gray, unit);
    canvas.line({{x, frame.bottom()}, {x, frame.bottom() + mark}}, ink, 1.2 * unit);
    canvas.text({x, frame.bottom() + 1.7 * mark}, tick_label(u, u_step), number, {0.5, 0});
  }
  std::vector<double> v_ticks = ticks(frame.v_min, frame.v_max, std::max(2.5, frame.height / (60 * unit)));
  if (frame.v_log) std::erase_if(v_ticks, [](double v) { return std::abs(v - std::round(v)) > 1e-6; });
  const double v_step = v_ticks.size() > 1 ? v_ticks[1] - v_ticks[0] : 1;
  double widest = 0;
  for (const double v : v_ticks) {
    const double y = frame.at(frame.u_min, v).y;
    const std::string label = frame.v_log ? power_label(std::round(v)) : tick_label(v, v_step);
    widest = std::max(widest, canvas.text_width(label, number));
    if (grid) canvas.line({{frame.top_left.x, y}, {frame.right(), y}}, grid_gray, unit);
    canvas.line({{frame.top_left.x - mark, y}, {frame.top_left.x, y}}, ink, 1.2 * unit);
    canvas.text({frame.top_left.x - 1.7 * mark, y}, label, number, {1, 0.5});
  }
  canvas.frame(frame.top_left, frame.width, frame.height, ink, 1.2 * unit);
  canvas.text({frame.top_left.x + frame.width / 2, frame.bottom() + 36 * unit}, u_label, {17 * unit, ink}, {0.5, 0});
  canvas.text({frame.top_left.x - widest - 26 * unit, frame.top_left.y + frame.height / 2}, v_label,
              {.size = 17 * unit, .color = ink, .upward = true}, {0.5, 1});
}

Unit readable_unit(double largest, const std::string& base) {
  static constexpr std::array<std::pair<double, const char*>, 8> prefixes = {
      {{1e-9, "G"}, {1e-6, "M"}, {1e-3, "k"}, {1, ""}, {1e3, "m"}, {1e6, "\u00b5"}, {1e9, "n"}, {1e12, "p"}}};
  if (!(largest > 0)) return {1, base};
  for (const auto& [factor, prefix] : prefixes)
    if (largest * factor >= 1) return {factor, prefix + base};
  return {prefixes.back().first, prefixes.back().second + base};
}

void draw_plot(Canvas& canvas, const Plot& plot, Point top_left, double width, double height, double unit) {
  Frame frame;
  frame.top_left = {top_left.x + 105 * unit, top_left.y + 56 * unit};
  frame.width = width - 140 * unit;
  frame.height = height - 126 * unit;

  frame.v_log = plot.log_v;
  const auto scaled = [&](double v) { return plot.log_v ? std::log10(v) : v; };

  double u_low = INFINITY, u_high = -INFINITY, v_low = plot.from_zero ? 0 : INFINITY, v_high = -INFINITY;
  for (const Series& s : plot.series)
    for (std::size_t i = 0; i < s.u.size(); ++i) {
      u_low = std::min(u_low, s.u[i]);
      u_high = std::max(u_high, s.u[i]);
      const double error = s.error.empty() || std::isnan(s.error[i]) ? 0 : s.error[i];
      v_low = std::min(v_low, scaled(s.v[i] - error));
      v_high = std::max(v_high, scaled(s.v[i] + error));
    }
  for (const double band : plot.bands) {
    u_low = std::min(u_low, band);
    u_high = std::max(u_high, band);
  }
  if (!differ(u_low, u_high)) u_high = u_low + 1;
  if (!differ(v_low, v_high)) v_high = v_low + std::max(1e-9, std::abs(v_low));
  const bool bars = std::any_of(plot.series.begin(), plot.series.end(), [](const Series& s) { return !s.error.empty(); });
  const double beside = bars ? 0.03 * (u_high - u_low) : 0;  // so that the outermost bars stand free of the frame
  frame.u_min = u_low - beside;
  frame.u_max = u_high + beside;
  frame.v_min = v_low - (plot.from_zero ? 0 : 0.06 * (v_high - v_low));
  frame.v_max = v_high + 0.08 * (v_high - v_low);

  for (std::size_t i = 0; i + 1 < plot.bands.size(); i += 2) {
    const Point from = frame.at(plot.bands[i], frame.v_max);
    canvas.rectangle(from, frame.at(plot.bands[i + 1], frame.v_max).x - from.x, frame.height, {0.965, 0.97, 0.98});
  }
  draw_axes(canvas, frame, plot.u_label, plot.v_label, unit, true);
  canvas.clip(frame.top_left, frame.width, frame.height);
  for (const Series& s : plot.series) {
    std::vector<Point> points;
    for (std::size_t i = 0; i < s.u.size(); ++i) points.push_back(frame.at(s.u[i], scaled(s.v[i])));
    for (std::size_t i = 0; i < s.error.size(); ++i) {
      if (std::isnan(s.error[i])) continue;
      const Point low = frame.at(s.u[i], scaled(s.v[i] - s.error[i])), high = frame.at(s.u[i], scaled(s.v[i] + s.error[i]));
      canvas.line({low, high}, s.color, 1.5 * unit);
      for (const Point& end : {low, high}) canvas.line({{end.x - 6 * unit, end.y}, {end.x + 6 * unit, end.y}}, s.color, 1.5 * unit);
    }
    if (s.style == Series::Style::circles)
      for (const Point& p : points) canvas.ellipse(p, 5 * unit, 5 * unit, 0, white, s.color, 2 * unit);
    else if (s.style == Series::Style::line)
      canvas.line(points, s.color, 2 * unit);
  }
  canvas.unclip();
  canvas.text({frame.top_left.x, top_left.y + 30 * unit}, plot.title, {.size = 21 * unit, .color = ink, .bold = true});
  draw_legend(canvas, plot.series, {frame.right(), top_left.y + 30 * unit}, unit);
}

void draw_plots(const std::filesystem::path& file, const std::vector<Plot>& plots, const std::vector<double>& heights, int width_px) {
  const double unit = width_px / 1600.0;
  const double total = std::accumulate(heights.begin(), heights.end(), 0.0);
  Canvas canvas(file, width_px, static_cast<int>(std::lround(total * unit)));
  double top = 0;
  for (std::size_t i = 0; i < plots.size(); ++i) {
    draw_plot(canvas, plots[i], {0, top}, width_px, heights[i] * unit, unit);
    top += heights[i] * unit;
  }
  canvas.finish();
}

}  // namespace heddle
