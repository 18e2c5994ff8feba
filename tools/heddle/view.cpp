#include "heddle/view.hpp"

#include <fmt/format.h>

#include <optional>
#include <stdexcept>

#include "heddle/curves.hpp"
#include "heddle/outside_views.hpp"
#include "heddle/section_views.hpp"
#include "relax/relaxed_file.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

void check(const ViewOptions& options) {
  const auto expect = [](bool fine, const std::string& message) {
    if (!fine) throw std::runtime_error(message);
  };
  expect(options.format == "png" || options.format == "svg" || options.format == "pdf",
         "format = " + options.format + ": must be png, svg or pdf");
  expect(options.color == "yarn" || options.color == "stress", "color = " + options.color + ": must be yarn or stress");
  expect(options.width_px >= 400 && options.width_px <= 16000, fmt::format("width = {}: must be 400 to 16000 px", options.width_px));
}

}  // namespace

std::vector<std::filesystem::path> view(const ViewOptions& options) {
  check(options);
  const bool is_folder = std::filesystem::is_directory(options.results);
  const std::filesystem::path relaxed = options.results / "relax.vtkhdf", woven = options.results / "weave.vtkhdf";
  const std::filesystem::path main_file = !is_folder ? options.results : std::filesystem::exists(relaxed) ? relaxed : woven;
  const std::filesystem::path cell_file = options.results / "cell.vtkhdf";
  const bool has_cell = is_folder && std::filesystem::exists(cell_file);
  const weave::ResultsFile main = weave::read_results(main_file);
  std::optional<weave::ResultsFile> cell;
  if (has_cell) cell = weave::read_results(cell_file);
  std::filesystem::create_directories(options.output);

  const PageStyle style{options.color == "stress", options.width_px};
  std::vector<std::filesystem::path> written;
  const auto next = [&](const std::string& name) {
    written.push_back(options.output / (name + "." + options.format));
    return written.back();
  };
  if (cell && main.snapshot.fibers() > 0) draw_side_view(make_scene(main, style), next("loom_side"), "Loom, side view");
  const weave::ResultsFile& shown = cell ? *cell : main;
  if (shown.snapshot.fibers() > 0) {
    const Scene scene = make_scene(shown, style);
    draw_side_view(scene, next("side"), shown.snapshot.cell_length > 0 ? "Unit cell, side view" : "Side view");
    draw_top_view(scene, next("top"));
    for (const SectionPlane& plane : section_planes(scene, options.sections_x, options.sections_y))
      draw_section(scene, plane,
                   next(fmt::format("section_{}_{:.3f}mm", plane.axis == weave::SectionAxis::x ? "x" : "y", plane.value * mm)));
  }
  draw_curves(main.history, options, written);
  if (relax::is_relaxed(main_file)) draw_convergence(relax::read_relaxed(main_file).history, options, written);
  return written;
}

}  // namespace heddle
