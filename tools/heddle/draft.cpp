#include "heddle/draft.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "heddle/picture.hpp"

namespace heddle {

namespace {

// Sizes on the page [px].
constexpr double margin = 40;
constexpr double title_height = 60;
constexpr double heading_height = 40;
constexpr double column_gap = 120;  ///< between weft columns
constexpr double layer_gap = 52;    ///< between weft layers
constexpr double weft_radius = 15;
constexpr double warp_width = 6;
constexpr double label_room = 46;       ///< for the warps' numbers, left of a sketch
constexpr double tallest_stack = 1100;  ///< of sketches before they go on beside it
constexpr double square = 20;           ///< of the matrix

struct Sketch {
  const weave::WarpSection* section = nullptr;
  int index = 0;       ///< of the section
  int first_warp = 0;  ///< number of its first warp in the fabric
  std::optional<weave::PositionMatrix> positions;
};

std::vector<Sketch> sketches_of(const weave::Case& spec) {
  std::vector<Sketch> sketches;
  int first_warp = 0;
  for (std::size_t i = 0; i < spec.sections.size(); ++i) {
    const weave::WarpSection& section = spec.sections[i];
    sketches.push_back({&section, static_cast<int>(i), first_warp,
                        weave::positions_from_weaving_matrix(section.matrix, spec.layers, spec.insertion_order)});
    first_warp += static_cast<int>(section.matrix.cols());
  }
  return sketches;
}

double sketch_width(const weave::Case& spec) {
  return std::max(label_room + (spec.columns + 0.3) * column_gap, 240.0);
}
double sketch_height(const weave::Case& spec) {
  return heading_height + (spec.layers + 1.2) * layer_gap;
}

/// Height of a warp above the stack's middle, upwards. Warps that share a place between two layers spread over it, the upper ones
/// above.
double warp_height(const weave::PositionMatrix& positions, int warp, int column, int layers) {
  const int place = positions(warp, column);
  int sharing = 0, above = 0;
  for (int other = 0; other < positions.rows(); ++other)
    if (positions(other, column) == place) {
      ++sharing;
      if (other < warp) ++above;
    }
  const double spread = std::min(1.6 * warp_width, 0.6 * layer_gap / sharing);
  return (place - 0.5 * layers) * layer_gap + spread * (0.5 * (sharing - 1) - above);
}

/// A warp's path through the period and half a column gap to either side: level over each column, an S between.
std::vector<Point> warp_path(const weave::PositionMatrix& positions, int warp, int layers, Point middle_of_first) {
  constexpr double level = 0.2;  // of a column gap, to either side of the column
  constexpr int steps = 24;
  const int columns = static_cast<int>(positions.cols());
  const auto height = [&](int column) { return warp_height(positions, warp, (column % columns + columns) % columns, layers); };
  std::vector<Point> path;
  for (int step = -steps; step <= columns * steps; ++step) {
    const double along = static_cast<double>(step) / steps;  // in column gaps from the first column
    const int column = static_cast<int>(std::floor(along));
    const double part = std::clamp((along - column - level) / (1 - 2 * level), 0.0, 1.0);
    const double rise = 0.5 - 0.5 * std::cos(std::numbers::pi * part);
    const double z = height(column) + rise * (height(column + 1) - height(column));
    path.push_back({middle_of_first.x + along * column_gap, middle_of_first.y - z});
  }
  return path;
}

void draw_wefts(Canvas& canvas, const weave::Case& spec, Point middle_of_first) {
  for (int pick = 0; pick < spec.picks_per_cell(); ++pick) {
    const int column = pick / spec.layers, layer = spec.layer_of_pick(pick);
    const Point center{middle_of_first.x + column * column_gap, middle_of_first.y - (0.5 * (spec.layers - 1) - layer) * layer_gap};
    canvas.ellipse(center, weft_radius, weft_radius, 0, {0.84, 0.90, 0.96}, {0.25, 0.40, 0.58}, 1.5);
    canvas.text(center, std::to_string(pick + 1), {12, {0.20, 0.32, 0.48}}, {0.5, 0.5});
  }
}

/// A heading in bold with a remark behind it.
void draw_heading(Canvas& canvas, Point top_left, const std::string& heading, const std::string& remark) {
  const TextStyle bold{15, ink, true};
  const double y = top_left.y + 0.4 * heading_height;
  canvas.text({top_left.x, y}, heading, bold);
  canvas.text({top_left.x + canvas.text_width(heading, bold) + 12, y}, remark, {14, faint_ink});
}

/// top_left: of the sketch's rectangle, sketch_width by sketch_height.
void draw_sketch(Canvas& canvas, const weave::Case& spec, const Sketch& sketch, Point top_left) {
  draw_heading(canvas, top_left, fmt::format("Section {}", sketch.index + 1),
               fmt::format("dent {}, {}", sketch.section->dent + 1, sketch.section->yarn));
  const Point middle{top_left.x + label_room + 0.6 * column_gap,
                     top_left.y + heading_height + 0.5 * (sketch_height(spec) - heading_height) - 0.2 * layer_gap};
  if (!sketch.positions) {
    canvas.text({top_left.x, middle.y}, "no warp positions describe this matrix", {14, faint_ink});
    return;
  }
  const double left = middle.x - 0.6 * column_gap, right = middle.x + (spec.columns - 0.4) * column_gap;
  const int warps = static_cast<int>(sketch.positions->rows());
  canvas.clip({left, top_left.y + heading_height - 12}, right - left, sketch_height(spec) - heading_height);
  draw_wefts(canvas, spec, middle);
  for (int warp = 0; warp < warps; ++warp) {
    const std::vector<Point> path = warp_path(*sketch.positions, warp, spec.layers, middle);
    canvas.line(path, white, warp_width + 4);
    canvas.line(path, yarn_color(sketch.first_warp + warp, false), warp_width);
  }
  canvas.unclip();
  // Numbers where the paths enter, moved apart where they enter close together.
  std::vector<std::pair<double, int>> labels;
  for (int warp = 0; warp < warps; ++warp) {
    const std::vector<Point> path = warp_path(*sketch.positions, warp, spec.layers, middle);
    const auto entry = std::find_if(path.begin(), path.end(), [&](Point p) { return p.x >= left; });
    labels.emplace_back(entry->y, warp);
  }
  std::sort(labels.begin(), labels.end());
  for (std::size_t i = 1; i < labels.size(); ++i) labels[i].first = std::max(labels[i].first, labels[i - 1].first + 15);
  for (const auto& [y, warp] : labels)
    canvas.text({left - 8, y}, std::to_string(sketch.first_warp + warp + 1),
                {13, mix(yarn_color(sketch.first_warp + warp, false), {0, 0, 0}, 0.15), true}, {1, 0.5});
}

double grid_width(const weave::Case& spec) {
  return std::max(60 + square * spec.warps() + 8.0 * static_cast<double>(spec.sections.size()), 260.0);
}
double grid_height(const weave::Case& spec) {
  return heading_height + 46 + square * spec.picks_per_cell() + 6.0 * spec.columns;
}

void draw_matrix(Canvas& canvas, const weave::Case& spec, const std::vector<Sketch>& sketches, Point top_left) {
  draw_heading(canvas, top_left, "Weaving matrix", "filled: warp up");
  const double first_row = top_left.y + heading_height + 46;
  double x = top_left.x + 60;
  canvas.text({top_left.x + 52, first_row - 34}, "section", {12, faint_ink}, {1, 0.5});
  canvas.text({top_left.x + 52, first_row - 12}, "warp", {12, faint_ink}, {1, 0.5});
  for (const Sketch& sketch : sketches) {
    const weave::WeavingMatrix& matrix = sketch.section->matrix;
    const double width = square * static_cast<double>(matrix.cols());
    canvas.text({x + width / 2, first_row - 34}, std::to_string(sketch.index + 1), {12, faint_ink}, {0.5, 0.5});
    for (int row = 0; row < matrix.rows(); ++row) {
      const double y = first_row + square * row + 6.0 * (row / spec.layers);
      const std::string pick = (row == 0 ? "pick " : "") + std::to_string(row + 1);
      if (sketch.index == 0) canvas.text({top_left.x + 52, y + square / 2}, pick, {12, ink}, {1, 0.5});
      for (int warp = 0; warp < matrix.cols(); ++warp) {
        const Point corner{x + square * warp, y};
        if (matrix(row, warp) > 0) canvas.rectangle({corner.x + 1.5, corner.y + 1.5}, square - 3, square - 3, ink);
        canvas.frame(corner, square, square, {0.72, 0.72, 0.74}, 1);
      }
    }
    for (int warp = 0; warp < matrix.cols(); ++warp)
      canvas.text({x + square * (warp + 0.5), first_row - 12}, std::to_string(sketch.first_warp + warp + 1),
                  {12, mix(yarn_color(sketch.first_warp + warp, false), {0, 0, 0}, 0.15), true}, {0.5, 0.5});
    x += width + 8;
  }
}

}  // namespace

void draw_draft(const weave::Case& spec, const std::filesystem::path& file) {
  const std::vector<Sketch> sketches = sketches_of(spec);
  const int count = static_cast<int>(sketches.size());
  const int stack = std::clamp(static_cast<int>(tallest_stack / sketch_height(spec)), 1, std::max(1, count));
  const int stacks = (count + stack - 1) / stack;
  const double sketches_width = stacks * (sketch_width(spec) + 20);
  const double height = title_height + std::max(stack * sketch_height(spec), grid_height(spec)) + margin;
  const double width = std::max(2 * margin + sketches_width + grid_width(spec), 620.0);
  Canvas canvas(file, static_cast<int>(std::ceil(width)), static_cast<int>(std::ceil(height)));
  canvas.text({margin, 30}, spec.title.empty() ? spec.name : spec.title, {21, ink, true});
  canvas.text(
      {margin, 54},
      fmt::format("{} layer{} \u00d7 {} column{}, {} warps in {} section{}; first pick on the left, fell to the right", spec.layers,
                  spec.layers == 1 ? "" : "s", spec.columns, spec.columns == 1 ? "" : "s", spec.warps(), count, count == 1 ? "" : "s"),
      {14, faint_ink});
  for (int i = 0; i < count; ++i)
    draw_sketch(canvas, spec, sketches[static_cast<std::size_t>(i)],
                {margin + (i / stack) * (sketch_width(spec) + 20), title_height + 10 + (i % stack) * sketch_height(spec)});
  draw_matrix(canvas, spec, sketches, {margin + sketches_width, title_height + 10});
  canvas.finish();
}

}  // namespace heddle
