#include "heddle/section_plots.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "heddle/plot.hpp"

namespace heddle {
namespace {

constexpr int width_px = 1600;
constexpr std::size_t named_yarns_max = 10;  ///< more fill no line

/// One panel, a line for each yarn. values: of all sections of a yarn.
template <class Values>
Plot panel(const std::vector<const relax::YarnEnvelope*>& yarns, const std::string& v_label, Values values) {
  Plot plot;
  plot.v_label = v_label;
  for (std::size_t i = 0; i < yarns.size(); ++i) {
    Series series{"", yarn_color(static_cast<int>(i), yarns[i]->weft), {}, values(yarns[i]->sections)};
    for (const relax::YarnSection& s : yarns[i]->sections) series.u.push_back(1e3 * s.arc);
    plot.series.push_back(std::move(series));
  }
  return plot;
}

/// One value of each section, in a unit of which `factor` make one of the base.
auto each(double relax::YarnSection::*value, double factor) {
  return [=](const std::vector<relax::YarnSection>& sections) {
    std::vector<double> values;
    for (const relax::YarnSection& s : sections) values.push_back(factor * (s.*value));
    return values;
  };
}

std::vector<double> rotation_in_degrees(const std::vector<relax::YarnSection>& sections) {
  std::vector<double> values = relax::continuous_rotation(sections);
  for (double& v : values) v *= 180 / std::numbers::pi;
  return values;
}

}  // namespace

void draw_section_data(const std::vector<relax::YarnEnvelope>& all, bool weft, const std::filesystem::path& file) {
  std::vector<const relax::YarnEnvelope*> yarns;
  for (const relax::YarnEnvelope& e : all)
    if (e.weft == weft) yarns.push_back(&e);
  if (yarns.empty()) return;
  std::vector<Plot> plots = {panel(yarns, "width [mm]", each(&relax::YarnSection::width, 1e3)),
                             panel(yarns, "height [mm]", each(&relax::YarnSection::height, 1e3)),
                             panel(yarns, "area [mm\u00b2]", each(&relax::YarnSection::area, 1e6)),
                             panel(yarns, "fiber fraction", each(&relax::YarnSection::fiber_volume_fraction, 1)),
                             panel(yarns, "rotation [\u00b0]", rotation_in_degrees)};
  plots.front().title = fmt::format("Sections along the {}", weft ? "wefts" : "warps");
  plots.back().u_label = "along the yarn [mm]";
  for (std::size_t i = 0; i < yarns.size() && yarns.size() <= named_yarns_max; ++i)
    plots.front().series[i].label = fmt::format("{} {}", weft ? "weft" : "warp", yarns[i]->yarn);
  draw_plots(file, plots, std::vector<double>(plots.size(), 340), width_px);
}

}  // namespace heddle
