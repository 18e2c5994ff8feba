#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "heddle/picture.hpp"
#include "heddle/plot.hpp"
#include "weave/case.hpp"
#include "weave/snapshot.hpp"

namespace weave {
struct ResultsFile;
}

/// What views and sections of a snapshot share: its colors, and pages at true scale.
namespace heddle {

constexpr double mm = 1e3;

struct Range {
  double low = INFINITY, high = -INFINITY;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double length() const { return high - low; }
};

/// What the pictures of one snapshot have in common.
struct Scene {
  weave::Snapshot snapshot;         ///< along the fibers' axes
  std::optional<weave::Case> spec;  ///< of the run, where the file tells
  bool by_stress = false;
  Range stress;   ///< of the color scale [Pa]
  int warps = 0;  ///< number of the first weft
  int width_px = 0;
  double unit = 1;  ///< size of letters and gaps relative to a page 1600 px wide

  [[nodiscard]] Color yarn(std::size_t fiber) const {
    const bool weft = snapshot.weft[fiber] != 0;
    return yarn_color(snapshot.yarn[fiber] - (weft ? warps : 0), weft);
  }
  [[nodiscard]] Color color(std::size_t fiber, double stress_here) const {
    return by_stress ? scale_color((stress_here - stress.low) / stress.length()) : yarn(fiber);
  }
};

/// How a snapshot is drawn.
struct PageStyle {
  bool by_stress = false;  ///< by yarn otherwise
  int width_px = 1600;
};
Scene make_scene(const weave::ResultsFile& results, const PageStyle& style = {});

std::size_t first_node(const weave::Snapshot& s, std::size_t fiber);
std::size_t end_node(const weave::Snapshot& s, std::size_t fiber);
/// Where the wefts start along y, on the average: the start of a period.
double weft_start(const Scene& scene);

/// A page with one frame in which both axes have the same scale.
struct Page {
  Frame frame;  ///< in mm
  int height_px = 0;
  double scale = 0;  ///< [px/m]
};
Page lay_out(const Scene& scene, Range u, Range v);

/// A bar of a round length, about a tenth of the frame, at its lower right.
void draw_scale_bar(Canvas& canvas, const Page& page, double unit);
/// Axes, scale bar, title and legend.
void draw_surroundings(Canvas& canvas, const Scene& scene, const Page& page, const std::string& title, const std::string& u_label,
                       const std::string& v_label);

/// A cell among others in one picture.
struct CellPanel {
  std::filesystem::path results;  ///< results file of a unit cell
  std::string label;
};

/// Panels at one scale in rows and columns on a page with a heading, each with its label above it, and a scale bar below all.
struct PanelGrid {
  int count = 0, columns = 1;
  double width = 0, height = 0;  ///< of a panel [px]
  double scale = 0;              ///< [px/m]
  int width_px = 0, height_px = 0;

  void draw_heading(Canvas& canvas, const std::string& title, const std::string& subtitle) const;
  /// Writes a panel's label; returns the panel's frame for the ranges [m], v in its middle.
  Page begin_panel(Canvas& canvas, int panel, const std::string& label, Range u, Range v) const;
  void draw_scale(Canvas& canvas) const;
};
/// As many columns as keep a panel of the given lengths [m] about as high as four lines of text.
PanelGrid lay_out_panels(std::size_t count, double u_length, double v_length);

}  // namespace heddle
