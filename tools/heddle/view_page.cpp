#include "heddle/view_page.hpp"

#include <fmt/format.h>

#include "weave/results.hpp"

namespace heddle {
namespace {

using weave::Snapshot;

constexpr double mega = 1e-6;

/// From the first to the 99th percentile, so that a few stray bars do not take the whole color scale, and from 0 where it is near.
Range stress_range(const Snapshot& s) {
  std::vector<double> values;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber)
    for (std::size_t node = first_node(s, fiber); node < end_node(s, fiber); ++node) values.push_back(s.stress(fiber, node));
  std::sort(values.begin(), values.end());
  Range range;
  range.low = values[values.size() / 100];
  range.high = values[values.size() - 1 - values.size() / 100];
  if (range.low > 0 && range.low < 0.5 * range.high) range.low = 0;
  if (range.length() <= 0) range.high = range.low + 1;
  return range;
}

void draw_color_bar(Canvas& canvas, const Scene& scene, const Frame& frame) {
  const double unit = scene.unit, width = 22 * unit, height = std::max(frame.height, 90 * unit);
  const Point top{frame.right() + 34 * unit, frame.top_left.y + (frame.height - height) / 2};
  Image colors{1, 256, {}};
  for (int i = 0; i < 256; ++i) {
    const Color c = scale_color((255 - i) / 255.0);
    const auto byte = [](double value) { return static_cast<std::uint32_t>(std::lround(255 * value)); };
    colors.pixels.push_back(0xff000000U | byte(c.red) << 16 | byte(c.green) << 8 | byte(c.blue));
  }
  canvas.image(colors, top, width, height);
  canvas.frame(top, width, height, ink, 1.2 * unit);
  const Range range{scene.stress.low * mega, scene.stress.high * mega};
  const std::vector<double> values = ticks(range.low, range.high, height / (60 * unit));
  const double step = values.size() > 1 ? values[1] - values[0] : 1;
  for (const double value : values) {
    const double y = top.y + height * (range.high - value) / range.length();
    canvas.line({{top.x + width, y}, {top.x + width + 6 * unit, y}}, ink, 1.2 * unit);
    canvas.text({top.x + width + 11 * unit, y}, tick_label(value, step), {15 * unit, ink});
  }
  canvas.text({top.x + width / 2, top.y - 18 * unit}, "stress [MPa]", {15 * unit, ink}, {0.4, 0.5});
}

void draw_yarn_legend(Canvas& canvas, const Frame& frame, double unit) {
  const TextStyle style{16 * unit, ink};
  const double side = 14 * unit, y = frame.top_left.y - 24 * unit;
  double x = frame.right();
  for (const bool weft : {true, false}) {
    const std::string label = weft ? "wefts" : "warps";
    x -= canvas.text_width(label, style);
    canvas.text({x, y}, label, style);
    x -= 8 * unit;
    for (int i = 3; i >= 0; --i) {
      x -= side;
      canvas.rectangle({x, y - side / 2}, side, side, yarn_color(i, weft));
    }
    x -= 26 * unit;
  }
}

}  // namespace

std::size_t first_node(const Snapshot& s, std::size_t fiber) {
  return static_cast<std::size_t>(s.offset[fiber]);
}
std::size_t end_node(const Snapshot& s, std::size_t fiber) {
  return static_cast<std::size_t>(s.offset[fiber + 1]);
}

Scene make_scene(const weave::ResultsFile& results, const PageStyle& style) {
  Scene scene{.snapshot = weave::on_axis(results.snapshot), .spec = {}, .by_stress = style.by_stress, .stress = {}};
  if (!results.case_toml.empty()) scene.spec = weave::parse_case(results.case_toml, "/meta/case_toml");
  if (scene.by_stress) scene.stress = stress_range(scene.snapshot);
  for (std::size_t fiber = 0; fiber < results.snapshot.fibers(); ++fiber)
    if (results.snapshot.weft[fiber] == 0) scene.warps = std::max(scene.warps, results.snapshot.yarn[fiber] + 1);
  scene.width_px = style.width_px;
  scene.unit = style.width_px / 1600.0;
  return scene;
}

double weft_start(const Scene& scene) {
  double sum = 0;
  int count = 0;
  for (std::size_t fiber = 0; fiber < scene.snapshot.fibers(); ++fiber)
    if (scene.snapshot.weft[fiber] != 0) {
      sum += scene.snapshot.x[first_node(scene.snapshot, fiber)].y();
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

Page lay_out(const Scene& scene, Range u, Range v) {
  const double unit = scene.unit;
  const double left = 110 * unit, right = (scene.by_stress ? 150 : 40) * unit, top = 74 * unit, bottom = 80 * unit;
  const double room = scene.width_px - left - right;
  Page page;
  page.scale = std::min(room / u.length(), 0.62 * scene.width_px / v.length());
  page.frame.width = page.scale * u.length();
  page.frame.height = page.scale * v.length();
  page.frame.top_left = {left + (room - page.frame.width) / 2, top};
  page.frame.u_min = u.low * mm;
  page.frame.u_max = u.high * mm;
  page.frame.v_min = v.low * mm;
  page.frame.v_max = v.high * mm;
  page.height_px = static_cast<int>(std::ceil(top + page.frame.height + bottom));
  return page;
}

void draw_scale_bar(Canvas& canvas, const Page& page, double unit) {
  const double wanted = 0.16 * page.frame.width / page.scale * mm;
  const double power = std::pow(10, std::floor(std::log10(wanted)));
  const double length = wanted >= 5 * power ? 5 * power : wanted >= 2 * power ? 2 * power : power;
  const double px = length / mm * page.scale;
  const double x = page.frame.right() - px, y = page.frame.bottom() + 46 * unit;
  canvas.rectangle({x, y - 3 * unit}, px, 6 * unit, ink);
  canvas.text({x - 10 * unit, y}, fmt::format("{:g} mm", length), {16 * unit, ink}, {1, 0.5});
}

void draw_surroundings(Canvas& canvas, const Scene& scene, const Page& page, const std::string& title, const std::string& u_label,
                       const std::string& v_label) {
  const double unit = scene.unit;
  draw_axes(canvas, page.frame, u_label, v_label, unit, false);
  draw_scale_bar(canvas, page, unit);
  canvas.text({110 * unit, 30 * unit}, title, {.size = 21 * unit, .color = ink, .bold = true});
  std::string state = "relaxed";  // a state without a time is none of a loom
  if (scene.snapshot.time > 0) state = fmt::format("after {} picks, t = {:.4g} s", scene.snapshot.pick, scene.snapshot.time);
  if (scene.spec && !scene.spec->name.empty()) state = (scene.spec->title.empty() ? scene.spec->name : scene.spec->title) + ", " + state;
  canvas.text({110 * unit, 54 * unit}, state, {15 * unit, faint_ink});
  if (scene.by_stress)
    draw_color_bar(canvas, scene, page.frame);
  else
    draw_yarn_legend(canvas, page.frame, unit);
}

namespace {

constexpr double panel_edge = 40, panel_gap = 30, panel_top = 92, panel_label = 34, panel_bottom = 60;  // [px]

}  // namespace

PanelGrid lay_out_panels(std::size_t count, double u_length, double v_length) {
  PanelGrid grid;
  grid.width_px = 1600;
  grid.count = static_cast<int>(count);
  const double aspect = u_length / v_length;
  grid.columns = std::clamp(static_cast<int>(std::floor(9 / aspect)), 1, std::min(grid.count, 6));
  const int rows = (grid.count + grid.columns - 1) / grid.columns;
  grid.width = (grid.width_px - 2 * panel_edge - (grid.columns - 1) * panel_gap) / grid.columns;
  grid.scale = grid.width / u_length;
  grid.height = grid.scale * v_length;
  grid.height_px = static_cast<int>(std::ceil(panel_top + rows * (panel_label + grid.height) + (rows - 1) * panel_gap + panel_bottom));
  return grid;
}

void PanelGrid::draw_heading(Canvas& canvas, const std::string& title, const std::string& subtitle) const {
  canvas.text({panel_edge, 30}, title, {.size = 21, .color = ink, .bold = true});
  canvas.text({panel_edge, 58}, subtitle + "; one scale for all", {15, faint_ink});
}

Page PanelGrid::begin_panel(Canvas& canvas, int panel, const std::string& label, Range u, Range v) const {
  const Point corner{panel_edge + panel % columns * (width + panel_gap), panel_top + panel / columns * (panel_label + height + panel_gap)};
  const double middle = (v.low + v.high) / 2, half = 0.5 * height / scale;
  canvas.text({corner.x, corner.y + panel_label / 2}, label, {17, ink});
  Page page;
  page.height_px = height_px;
  page.scale = scale;
  page.frame = {
      {corner.x, corner.y + panel_label}, scale * u.length(), height, u.low * mm, u.high * mm, (middle - half) * mm, (middle + half) * mm};
  return page;
}

void PanelGrid::draw_scale(Canvas& canvas) const {
  Page page;
  page.scale = scale;
  page.frame = {{panel_edge, 0}, width_px - 2 * panel_edge, height_px - panel_bottom, 0, 1, 0, 1};
  draw_scale_bar(canvas, page, 1);
}

}  // namespace heddle
