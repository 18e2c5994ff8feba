#include "heddle/section_views.hpp"

#include <fmt/format.h>

#include <array>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <utility>

#include "weave/results.hpp"

namespace heddle {
namespace {

using weave::SectionAxis;
using weave::SectionCircle;
using weave::Snapshot;
using weave::Vec3;

/// A stretch of a fiber that runs along the plane, nearer than its radius: the cut is a strip.
struct Strip {
  std::size_t fiber = 0;
  std::vector<double> u, z;        ///< middle [m]
  std::vector<double> half_width;  ///< [m]
  std::vector<double> stress;      ///< [Pa]
};

std::vector<Strip> cut_strips(const Snapshot& s, SectionAxis axis, double value) {
  constexpr int samples = 6;  // per element, so that the strips' ends come out round
  const int n = axis == SectionAxis::x ? 0 : 1, u = 1 - n;
  const double period = axis == SectionAxis::x ? s.cell_length : s.cell_width;
  std::vector<Strip> strips;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber) {
    Strip strip{.fiber = fiber, .u = {}, .z = {}, .half_width = {}, .stress = {}};
    const auto close = [&] {
      if (strip.u.size() > 1) strips.push_back(strip);
      strip = {.fiber = fiber, .u = {}, .z = {}, .half_width = {}, .stress = {}};
    };
    for (std::size_t node = first_node(s, fiber); node + 1 < end_node(s, fiber); ++node) {
      const Vec3 element = s.x[node + 1] - s.x[node];
      if (std::abs(element[n]) * weave::max_section_aspect >= element.norm()) {
        close();
        continue;
      }
      for (int i = 0; i <= samples; ++i) {
        const double part = static_cast<double>(i) / samples;
        const Vec3 x = s.x[node] + part * element;
        double distance = x[n] - value;
        if (period > 0) distance -= period * std::round(distance / period);
        const double square = s.radius[fiber] * s.radius[fiber] - distance * distance;
        if (square <= 0) {
          close();
          continue;
        }
        strip.u.push_back(x[u]);
        strip.z.push_back(x.z());
        strip.half_width.push_back(std::sqrt(square));
        strip.stress.push_back(s.stress(fiber, node) + part * (s.stress(fiber, node + 1) - s.stress(fiber, node)));
      }
    }
    close();
  }
  return strips;
}

struct StripEdges {
  std::vector<Point> upper, lower;
};

StripEdges edges_of(const Page& page, const Strip& strip, double shift) {
  StripEdges edges;
  for (std::size_t i = 0; i < strip.u.size(); ++i) {
    const std::size_t before = i == 0 ? 0 : i - 1, after = std::min(i + 1, strip.u.size() - 1);
    const double du = strip.u[after] - strip.u[before], dz = strip.z[after] - strip.z[before];
    const double length = std::max(std::hypot(du, dz), 1e-30), w = strip.half_width[i] / length;
    edges.upper.push_back(page.frame.at((strip.u[i] + shift - w * dz) * mm, (strip.z[i] + w * du) * mm));
    edges.lower.push_back(page.frame.at((strip.u[i] + shift + w * dz) * mm, (strip.z[i] - w * du) * mm));
  }
  return edges;
}

void draw_strip(Canvas& canvas, const Scene& scene, const Page& page, const Strip& strip, double shift) {
  const auto [upper, lower] = edges_of(page, strip, shift);
  if (!scene.by_stress) {
    std::vector<Point> whole = upper;
    whole.insert(whole.end(), lower.rbegin(), lower.rend());
    canvas.polygon(whole, scene.yarn(strip.fiber));
  }
  for (std::size_t i = 0; scene.by_stress && i + 1 < upper.size(); ++i) {
    const std::vector<Point> piece = {upper[i], upper[i + 1], lower[i + 1], lower[i]};
    const Color fill = scene.color(strip.fiber, strip.stress[i]);
    canvas.polygon(piece, fill);
    canvas.outline(piece, fill, scene.unit);  // closes the seams between the pieces
  }
  const Color edge = mix(scene.yarn(strip.fiber), {0, 0, 0}, 0.45);
  canvas.line(upper, edge, scene.unit);
  canvas.line(lower, edge, scene.unit);
}

std::vector<Point> convex_hull(std::vector<Point> points) {
  std::sort(points.begin(), points.end(), [](Point a, Point b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  const auto turn = [](Point o, Point a, Point b) { return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x); };
  std::vector<Point> hull;
  for (const bool back : {false, true}) {
    const std::size_t start = hull.size();
    for (const Point& p : points) {
      while (hull.size() >= start + 2 && turn(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    if (!back) std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// Points on the rim of an ellipse, u and z.
std::vector<Point> rim(const SectionCircle& circle) {
  std::vector<Point> points;
  for (int i = 0; i < 24; ++i) {
    const double turn = 2 * std::numbers::pi * i / 24;
    const double a = circle.aspect * circle.radius * std::cos(turn), b = circle.radius * std::sin(turn);
    points.push_back({circle.u + a * std::cos(circle.angle) - b * std::sin(circle.angle),
                      circle.z + a * std::sin(circle.angle) + b * std::cos(circle.angle)});
  }
  return points;
}

/// Convex outlines of the yarns whose fibers all cross the plane just once.
std::map<int, std::vector<Point>> yarn_outlines(const Snapshot& s, const std::vector<SectionCircle>& circles) {
  std::map<int, int> fibers, crossings;
  std::map<int, std::vector<Point>> points;
  for (const int yarn : s.yarn) ++fibers[yarn];
  for (const SectionCircle& circle : circles) {
    ++crossings[circle.yarn];
    const std::vector<Point> more = rim(circle);
    points[circle.yarn].insert(points[circle.yarn].end(), more.begin(), more.end());
  }
  std::map<int, std::vector<Point>> outlines;
  for (const auto& [yarn, count] : crossings)
    if (count == fibers[yarn] && count > 1) outlines[yarn] = convex_hull(points[yarn]);
  return outlines;
}

/// What a plane cuts.
struct Cut {
  std::vector<SectionCircle> circles;
  std::vector<Strip> strips;
  std::map<int, std::vector<Point>> outlines;  ///< of yarns
  Range z, across;                             ///< of all of it [m]; z with a margin
  Range u;                                     ///< to show: whole periods, as many as make a picture wider than high [m]
  double period = 0;                           ///< of u [m]; 0: none
};

Cut cut_by(const Scene& scene, const SectionPlane& plane, bool with_outlines = true) {
  const Snapshot& s = scene.snapshot;
  Cut cut;
  cut.circles = cut_section(s, plane.axis, plane.value);
  std::erase_if(cut.circles, [](const SectionCircle& c) { return c.aspect >= weave::max_section_aspect; });  // drawn as strips
  cut.strips = cut_strips(s, plane.axis, plane.value);
  if (with_outlines) cut.outlines = yarn_outlines(s, cut.circles);

  Range& z = cut.z;
  for (const SectionCircle& c : cut.circles) {
    z.add(c.z - c.aspect * c.radius);
    z.add(c.z + c.aspect * c.radius);
    cut.across.add(c.u);
  }
  for (const Strip& strip : cut.strips)
    for (std::size_t i = 0; i < strip.u.size(); ++i) {
      z.add(strip.z[i] - strip.half_width[i]);
      z.add(strip.z[i] + strip.half_width[i]);
      cut.across.add(strip.u[i]);
    }
  if (!std::isfinite(z.low)) z = {-0.1 * s.cell_width, 0.1 * s.cell_width};
  const double margin = 0.08 * z.length();
  z = {z.low - margin, z.high + margin};

  cut.period = section_period(s, plane.axis);
  const double start = plane.axis == SectionAxis::x ? weft_start(scene) : s.x_min;
  const int periods = cut.period > 0 ? std::clamp(static_cast<int>(std::ceil(1.8 * z.length() / cut.period)), 1, 3) : 1;
  cut.u = cut.period > 0 ? Range{start, start + periods * cut.period} : Range{s.x_min, s.x_max};
  return cut;
}

/// First and last periodic image that may be seen.
std::pair<int, int> images_shown(const Cut& cut) {
  if (!(cut.period > 0)) return {0, 0};
  return {static_cast<int>(std::floor((cut.u.low - cut.across.high) / cut.period)) - 1,
          static_cast<int>(std::ceil((cut.u.high - cut.across.low) / cut.period)) + 1};
}

void draw_cut(Canvas& canvas, const Scene& scene, const Page& page, const Cut& cut, const std::vector<YarnLines>* lines = nullptr) {
  const double period = cut.period;
  canvas.clip(page.frame.top_left, page.frame.width, page.frame.height);
  const auto [from, to] = images_shown(cut);
  for (int image = from; image <= to; ++image)
    for (const Strip& strip : cut.strips) draw_strip(canvas, scene, page, strip, image * period);
  for (int image = from; image <= to; ++image) {
    const double shift = image * period;
    for (const auto& [yarn, outline] : cut.outlines) {
      std::vector<Point> points;
      for (const Point& p : outline) points.push_back(page.frame.at((p.x + shift) * mm, p.y * mm));
      const Color color = yarn_color(yarn < scene.warps ? yarn : yarn - scene.warps, yarn >= scene.warps);
      canvas.polygon(points, color, 0.16);
      canvas.outline(points, mix(color, {0, 0, 0}, 0.15), 1.2 * scene.unit);
    }
    for (const SectionCircle& c : cut.circles)
      canvas.ellipse(page.frame.at((c.u + shift) * mm, c.z * mm), c.aspect * c.radius * page.scale, c.radius * page.scale, -c.angle,
                     scene.color(c.fiber, c.stress), mix(scene.yarn(c.fiber), {0, 0, 0}, 0.45), scene.unit);
  }
  for (int image = from; lines && image <= to; ++image) {
    const double shift = image * period;
    for (const YarnLines& yarn : *lines) {
      const Color color = mix(yarn_color(yarn.weft ? yarn.yarn - scene.warps : yarn.yarn, yarn.weft), {0, 0, 0}, 0.55);
      for (std::size_t i = 0; i + 1 < yarn.ends.size(); i += 2) {
        const auto at = [&](const std::array<double, 2>& end) { return page.frame.at((end[0] + shift) * mm, end[1] * mm); };
        canvas.line({at(yarn.ends[i]), at(yarn.ends[i + 1])}, color, 2 * scene.unit);
      }
    }
  }
  for (double at = cut.u.low + period; period > 0 && at < cut.u.high - 0.5 * period; at += period)
    canvas.line({page.frame.at(at * mm, page.frame.v_min), page.frame.at(at * mm, page.frame.v_max)}, faint_ink, scene.unit, true);
  canvas.unclip();
}

/// Outlines of yarns and fibers in one color.
void draw_cut_outlines(Canvas& canvas, const Page& page, const Cut& cut, Color color) {
  const auto [from, to] = images_shown(cut);
  const Color thin = mix(color, white, 0.35);
  for (int image = from; image <= to; ++image) {
    const double shift = image * cut.period;
    const auto on_page = [&](std::vector<Point> points) {
      for (Point& p : points) p = page.frame.at((p.x + shift) * mm, p.y * mm);
      return points;
    };
    for (const Strip& strip : cut.strips) {
      const auto [upper, lower] = edges_of(page, strip, shift);
      canvas.line(upper, thin, 1);
      canvas.line(lower, thin, 1);
    }
    for (const SectionCircle& c : cut.circles) canvas.outline(on_page(rim(c)), thin, 1);
    for (const auto& [yarn, outline] : cut.outlines) canvas.outline(on_page(outline), color, 2);
  }
}

/// Mean coordinate of each warp or weft within the cloth, by yarn number.
std::map<int, double> mean_positions(const Snapshot& s, bool weft) {
  std::map<int, std::pair<double, int>> sums;
  for (std::size_t fiber = 0; fiber < s.fibers(); ++fiber) {
    if ((s.weft[fiber] != 0) != weft) continue;
    auto& [sum, count] = sums[s.yarn[fiber]];
    for (std::size_t node = first_node(s, fiber); node < end_node(s, fiber); ++node) {
      const Vec3& x = s.x[node];
      if (!weft && s.x_max > s.x_min && (x.x() < s.x_min || x.x() > s.x_max)) continue;
      sum += x[weft ? 0 : 1];
      ++count;
    }
  }
  std::map<int, double> means;
  for (const auto& [yarn, sum] : sums)
    if (sum.second > 0) means[yarn] = sum.first / sum.second;
  return means;
}

/// Means of the groups that positions fall into, sorted; a gap wider than `gap` separates two groups.
std::vector<double> group_means(const std::map<int, double>& positions, double gap) {
  std::vector<double> sorted, means;
  for (const auto& [yarn, position] : positions) sorted.push_back(position);
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t first = 0, i = 1; i <= sorted.size(); ++i)
    if (i == sorted.size() || sorted[i] - sorted[i - 1] > gap) {
      means.push_back(std::accumulate(&sorted[first], &sorted[first] + (i - first), 0.0) / static_cast<double>(i - first));
      first = i;
    }
  return means;
}

std::vector<double> warp_section_positions(const Scene& scene) {
  const std::map<int, double> means = mean_positions(scene.snapshot, false);
  const double radius = *std::max_element(scene.snapshot.radius.begin(), scene.snapshot.radius.end());
  if (!scene.spec) return group_means(means, radius);
  std::vector<double> positions;
  int warp = 0;
  for (const weave::WarpSection& section : scene.spec->sections) {
    double sum = 0;
    int count = 0;
    for (const int end = warp + static_cast<int>(section.matrix.cols()); warp < end; ++warp)
      if (const auto mean = means.find(warp); mean != means.end()) {
        sum += mean->second;
        ++count;
      }
    if (count > 0) positions.push_back(sum / count);
  }
  return positions;
}

/// Middles of the weft columns along x.
std::vector<double> column_positions(const Scene& scene) {
  const std::map<int, double> means = mean_positions(scene.snapshot, true);
  const double radius = *std::max_element(scene.snapshot.radius.begin(), scene.snapshot.radius.end());
  if (!scene.spec) return group_means(means, 3 * radius);
  std::map<int, std::pair<double, int>> columns;
  for (const auto& [yarn, x] : means) {
    auto& [sum, count] = columns[(yarn - scene.warps) / scene.spec->layers];
    sum += x;
    ++count;
  }
  std::vector<double> positions;
  for (const auto& [column, sum] : columns) positions.push_back(sum.first / sum.second);
  std::sort(positions.begin(), positions.end());
  return positions;
}

/// The plane normal to an axis that shows a cell best.
std::optional<SectionPlane> first_plane(const Scene& scene, SectionAxis axis) {
  for (SectionPlane& plane : section_planes(scene))
    if (plane.axis == axis) return std::move(plane);
  return std::nullopt;
}

}  // namespace

void draw_section(const Scene& scene, const SectionPlane& plane, const std::filesystem::path& file, const std::vector<YarnLines>* lines) {
  const Cut cut = cut_by(scene, plane, lines == nullptr);
  const Page page = lay_out(scene, cut.u, cut.z);
  Canvas canvas(file, scene.width_px, page.height_px);
  draw_cut(canvas, scene, page, cut, lines);
  const bool normal_to_x = plane.axis == SectionAxis::x;
  const std::string title = fmt::format("Section at {} = {} mm", normal_to_x ? "x" : "y", tick_label(plane.value * mm, 1e-3));
  draw_surroundings(canvas, scene, page, plane.meaning.empty() ? title : title + ", " + plane.meaning,
                    normal_to_x ? "y, weft direction [mm]" : "x, warp direction [mm]", "z [mm]");
  canvas.finish();
}

std::vector<SectionPlane> section_planes(const Scene& scene, const std::vector<double>& at_x, const std::vector<double>& at_y) {
  std::vector<SectionPlane> planes;
  for (const double x : at_x) planes.push_back({SectionAxis::x, x, ""});
  for (const double y : at_y) planes.push_back({SectionAxis::y, y, ""});
  if (!planes.empty()) return planes;
  const std::vector<double> columns = column_positions(scene), sections = warp_section_positions(scene);
  if (!columns.empty()) {
    const double last = columns.back();
    const double before = columns.size() > 1 ? columns[columns.size() - 2] : last - scene.snapshot.cell_length;
    planes.push_back({SectionAxis::x, last, "through the last weft column"});
    if (before < last) planes.push_back({SectionAxis::x, (before + last) / 2, "between weft columns"});
  }
  for (std::size_t i = 0; i < sections.size(); ++i)
    planes.push_back({SectionAxis::y, sections[i], fmt::format("along the warps of section {}", i + 1)});
  return planes;
}

void draw_section_with_lines(const weave::ResultsFile& results, SectionAxis axis,
                             const std::function<std::vector<YarnLines>(double)>& lines, const std::filesystem::path& file) {
  const Scene scene = make_scene(results);
  const std::optional<SectionPlane> plane = first_plane(scene, axis);
  if (!plane) throw std::runtime_error(file.string() + ": there are no yarns to cut");
  const std::vector<YarnLines> drawn = lines(plane->value);
  draw_section(scene, {axis, plane->value, plane->meaning + ", with the yarns' surfaces"}, file, &drawn);
}

void draw_section_panels(const std::vector<CellPanel>& panels, SectionAxis axis, const std::string& title,
                         const std::filesystem::path& file) {
  struct Panel {
    std::string meaning;
    weave::ResultsFile results;
    std::optional<Scene> scene;
    Cut cut;
  };
  std::vector<Panel> cuts(panels.size());
  double u_length = 0, z_length = 0;
  for (std::size_t i = 0; i < panels.size(); ++i) {
    Panel& panel = cuts[i];
    panel.results = weave::read_results(panels[i].results);
    panel.scene.emplace(make_scene(panel.results));
    const std::optional<SectionPlane> plane = first_plane(*panel.scene, axis);
    if (!plane) throw std::runtime_error(panels[i].results.string() + ": has no yarns to cut");
    panel.meaning = plane->meaning;
    panel.cut = cut_by(*panel.scene, *plane);
    u_length = std::max(u_length, panel.cut.u.length());
    z_length = std::max(z_length, panel.cut.z.length());
  }
  const PanelGrid grid = lay_out_panels(panels.size(), u_length, z_length);
  Canvas canvas(file, grid.width_px, grid.height_px);
  grid.draw_heading(canvas, title,
                    (axis == SectionAxis::x ? "Section normal to the warp direction, " : "Section normal to the weft direction, ") +
                        cuts.front().meaning);
  for (int i = 0; i < grid.count; ++i) {
    const Panel& panel = cuts[static_cast<std::size_t>(i)];
    const Page page = grid.begin_panel(canvas, i, panels[static_cast<std::size_t>(i)].label, panel.cut.u, panel.cut.z);
    draw_cut(canvas, *panel.scene, page, panel.cut);
    canvas.frame(page.frame.top_left, page.frame.width, page.frame.height, ink, 1.2);
  }
  grid.draw_scale(canvas);
  canvas.finish();
}

std::vector<std::filesystem::path> draw_section_overlays(const std::vector<SectionLayer>& layers, const std::string& case_toml,
                                                         const std::filesystem::path& folder) {
  std::vector<weave::ResultsFile> results;
  for (const SectionLayer& layer : layers) results.push_back({layer.snapshot, {}, case_toml, ""});
  std::vector<Scene> scenes;
  for (const weave::ResultsFile& r : results) scenes.push_back(make_scene(r));
  std::vector<std::filesystem::path> written;
  std::map<SectionAxis, int> count;
  for (const SectionPlane& plane : section_planes(scenes.front())) {
    std::vector<Cut> cuts;
    Range z;
    for (const Scene& scene : scenes) {
      Cut& cut = cuts.emplace_back(cut_by(scene, plane));
      cut.u = cuts.front().u;
      z.add(cut.z.low);
      z.add(cut.z.high);
    }
    const bool normal_to_x = plane.axis == SectionAxis::x;
    written.push_back(folder / fmt::format("overlay_{}_{}.png", normal_to_x ? "x" : "y", ++count[plane.axis]));
    const Page page = lay_out(scenes.front(), cuts.front().u, z);
    Canvas canvas(written.back(), scenes.front().width_px, page.height_px);
    canvas.clip(page.frame.top_left, page.frame.width, page.frame.height);
    for (std::size_t i = 0; i < cuts.size(); ++i) draw_cut_outlines(canvas, page, cuts[i], state_color(i));
    canvas.unclip();
    draw_axes(canvas, page.frame, normal_to_x ? "y, weft direction [mm]" : "x, warp direction [mm]", "z [mm]", 1, false);
    draw_scale_bar(canvas, page, 1);
    canvas.text({110, 24}, fmt::format("Section normal to the {} direction, {}", normal_to_x ? "warp" : "weft", plane.meaning),
                {.size = 21, .color = ink, .bold = true});
    double left = 110;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      const TextStyle style{15, ink};
      canvas.rectangle({left, 51}, 22, 6, state_color(i));
      canvas.text({left + 30, 54}, layers[i].label, style);
      left += 56 + canvas.text_width(layers[i].label, style);
    }
    canvas.finish();
  }
  return written;
}

}  // namespace heddle
