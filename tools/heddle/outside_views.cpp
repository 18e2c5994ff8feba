#include "heddle/outside_views.hpp"

#include <cmath>
#include <stdexcept>
#include <vector>

#include "heddle/tubes.hpp"
#include "weave/measures.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using weave::Snapshot;
using weave::Vec3;

enum class ViewFrom { side, above };

/// Tubes as seen from a side, moved by `shift`.
void add_tubes(const Scene& scene, ViewFrom from, const Vec3& shift, std::vector<Tube>& tubes) {
  const Snapshot& s = scene.snapshot;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber) {
    Tube tube;
    tube.radius = s.radius[fiber];
    for (std::size_t node = first_node(s, fiber); node < end_node(s, fiber); ++node) {
      const Vec3 x = s.x[node] + shift;
      tube.points.push_back(from == ViewFrom::side ? Vec3(x.x(), x.z(), x.y()) : Vec3(x.x(), x.y(), -x.z()));
      tube.colors.push_back(scene.color(fiber, s.stress(fiber, node)));
    }
    tubes.push_back(std::move(tube));
  }
}

Image render(const Page& page, const std::vector<Tube>& tubes) {
  constexpr int sharpness = 2;  // pixels of the rendering per pixel of the page, each way
  const Frame& frame = page.frame;
  return render_tubes(tubes, frame.u_min / mm, frame.v_min / mm, sharpness * page.scale,
                      static_cast<int>(std::lround(sharpness * frame.width)), static_cast<int>(std::lround(sharpness * frame.height)));
}

/// The part of x that a view shows: the cell; or the cloth and the warps as far as the heddles.
Range view_along_x(const Scene& scene) {
  const Snapshot& s = scene.snapshot;
  if (s.cell_length > 0) return {s.x_min, s.x_min + s.cell_length};
  Range x;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber)
    for (std::size_t node = first_node(s, fiber); node < end_node(s, fiber); ++node)
      if (s.weft[fiber] == 0 || scene.warps == 0) x.add(s.x[node].x());
  if (scene.spec) x.high = std::min(x.high, scene.spec->loom.length);
  return x;
}

/// Heights between the lowest and the highest surface of the warps, and of the wefts among them, within a range of x.
Range heights(const Scene& scene, Range x) {
  const Snapshot& s = scene.snapshot;
  Range z;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber)
    for (std::size_t node = first_node(s, fiber); node < end_node(s, fiber); ++node)
      if (s.x[node].x() >= x.low && s.x[node].x() <= x.high) {
        z.add(s.x[node].z() - s.radius[fiber]);
        z.add(s.x[node].z() + s.radius[fiber]);
      }
  const double margin = 0.06 * std::max(z.length(), 0.1 * x.length());
  return {z.low - margin, z.high + margin};
}

/// The fibers with all of their images that a page of up to two periods shows.
Image render_from_above(const Scene& scene, const Page& page) {
  const Snapshot& s = scene.snapshot;
  std::vector<Tube> tubes;
  for (const int i : s.cell_length > 0 ? std::vector<int>{-1, 0, 1, 2} : std::vector<int>{0})
    for (const int j : {-1, 0, 1, 2}) add_tubes(scene, ViewFrom::above, Vec3(i * s.cell_length, j * s.cell_width, 0), tubes);
  return render(page, tubes);
}

/// None for a cell that some yarn does not pass whole, as the first one of a cloth, in which warps begin.
std::vector<weave::YarnPath> paths_of(const Snapshot& cell) {
  try {
    return weave::yarn_paths(cell);
  } catch (const std::invalid_argument&) {
    return {};
  }
}

}  // namespace

void draw_side_view(const Scene& scene, const std::filesystem::path& file, const std::string& title) {
  const Range x = view_along_x(scene);
  const Page page = lay_out(scene, x, heights(scene, x));
  Canvas canvas(file, scene.width_px, page.height_px);
  std::vector<Tube> tubes;
  const double period = scene.snapshot.cell_length;
  for (const int image : {-1, 0, 1})
    if (image == 0 || period > 0) add_tubes(scene, ViewFrom::side, Vec3(image * period, 0, 0), tubes);
  canvas.image(render(page, tubes), page.frame.top_left, page.frame.width, page.frame.height);
  draw_surroundings(canvas, scene, page, title, "x, warp direction [mm]", "z [mm]");
  canvas.finish();
}

void draw_top_view(const Scene& scene, const std::filesystem::path& file) {
  const Snapshot& s = scene.snapshot;
  const Range cell = view_along_x(scene);
  const double y = weft_start(scene);
  const Page page = lay_out(scene, {cell.low, cell.high + s.cell_length}, {y, y + 2 * s.cell_width});
  const Frame& frame = page.frame;
  const Image image = render_from_above(scene, page);

  Canvas canvas(file, scene.width_px, page.height_px);
  canvas.image(image, frame.top_left, frame.width, frame.height, 0.45);
  const Point corner = frame.at(cell.low * mm, (y + s.cell_width) * mm), opposite = frame.at(cell.high * mm, y * mm);
  canvas.clip(corner, opposite.x - corner.x, opposite.y - corner.y);
  canvas.rectangle(frame.top_left, frame.width, frame.height, white);
  canvas.image(image, frame.top_left, frame.width, frame.height);
  canvas.unclip();
  draw_surroundings(canvas, scene, page, "View from above, one period and its repeats", "x, warp direction [mm]", "y, weft direction [mm]");
  canvas.finish();
}

void draw_top_panels(const std::vector<CellPanel>& panels, const std::string& title, const std::filesystem::path& file) {
  std::vector<Scene> scenes;
  double length = 0, width = 0;
  for (const CellPanel& panel : panels) {
    scenes.push_back(make_scene(weave::read_results(panel.results)));
    length = std::max(length, scenes.back().snapshot.cell_length);
    width = std::max(width, scenes.back().snapshot.cell_width);
  }
  const PanelGrid grid = lay_out_panels(panels.size(), length, width);
  Canvas canvas(file, grid.width_px, grid.height_px);
  grid.draw_heading(canvas, title, "From above, a period of each: warps to the right, wefts upwards with their middle lines");
  for (int i = 0; i < grid.count; ++i) {
    const Scene& scene = scenes[static_cast<std::size_t>(i)];
    const Snapshot& s = scene.snapshot;
    const double y = weft_start(scene);
    const Page page =
        grid.begin_panel(canvas, i, panels[static_cast<std::size_t>(i)].label, {s.x_min, s.x_min + s.cell_length}, {y, y + s.cell_width});
    const Frame& frame = page.frame;
    canvas.image(render_from_above(scene, page), frame.top_left, frame.width, frame.height);
    canvas.clip(frame.top_left, frame.width, frame.height);
    for (const weave::YarnPath& path : paths_of(s)) {
      for (int image = -1; path.weft && image <= 1; ++image) {
        std::vector<Point> line;
        for (const int period : {-1, 0, 1})
          for (const weave::YarnStation& station : path.stations)
            line.push_back(frame.at((station.across + image * s.cell_length) * mm, (station.along + period * s.cell_width) * mm));
        canvas.line(line, ink, 2);
      }
    }
    canvas.unclip();
    canvas.frame(frame.top_left, frame.width, frame.height, ink, 1.2);
  }
  grid.draw_scale(canvas);
  canvas.finish();
}

}  // namespace heddle
