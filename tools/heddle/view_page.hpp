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

}  // namespace heddle
