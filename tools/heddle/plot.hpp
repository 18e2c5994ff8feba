#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "heddle/picture.hpp"

namespace heddle {

/// A rectangle of the page that shows u_min ... u_max to the right and v_min ... v_max upwards.
struct Frame {
  Point top_left;
  double width = 0, height = 0;  ///< [px]
  double u_min = 0, u_max = 1, v_min = 0, v_max = 1;
  bool v_log = false;  ///< v are powers of ten

  [[nodiscard]] Point at(double u, double v) const {
    return {top_left.x + (u - u_min) / (u_max - u_min) * width, top_left.y + (v_max - v) / (v_max - v_min) * height};
  }
  [[nodiscard]] double right() const { return top_left.x + width; }
  [[nodiscard]] double bottom() const { return top_left.y + height; }
};

/// Multiples of 1, 2 or 5 times a power of ten within low ... high, about `count` of them; none where these differ by rounding alone.
std::vector<double> ticks(double low, double high, double count);

/// Text of a tick whose neighbors are `step` away: no more digits than tell them apart.
std::string tick_label(double value, double step);

/// Frame line, ticks with numbers and labels with units. unit: size of the letters and gaps relative to a page 1600 px wide.
void draw_axes(Canvas& canvas, const Frame& frame, const std::string& u_label, const std::string& v_label, double unit, bool grid);

/// A prefix that makes values as large as `largest` easy to read: {1e3, "mJ"} for 0.02 J.
struct Unit {
  double factor = 1;  ///< to multiply values in `base` with
  std::string name;
};
Unit readable_unit(double largest, const std::string& base);

struct Series {
  std::string label;
  Color color;
  std::vector<double> u, v;
  enum class Style { line, circles, bars } style = Style::line;  ///< through the points, at them, or nothing but their error bars
  std::vector<double> error = {};  ///< half-lengths of bars along v at the points, NaN where one has none; empty: none
};

struct Plot {
  std::string title, u_label, v_label;
  std::vector<Series> series;
  std::vector<double> bands;  ///< where bands of alternating background begin, and where the last one ends
  bool from_zero = false;     ///< v starts at 0
  bool log_v = false;         ///< v, all above 0, on a scale of powers of ten
};

/// Draws the plot with its title, axes and legend into a rectangle of the page.
void draw_plot(Canvas& canvas, const Plot& plot, Point top_left, double width, double height, double unit);

/// Draws plots one below the other into a file of their own, as high as `heights` say on a page 1600 px wide. Throws std::runtime_error
/// naming the file if it can not be written.
void draw_plots(const std::filesystem::path& file, const std::vector<Plot>& plots, const std::vector<double>& heights, int width_px);

}  // namespace heddle
