#include "relax/woven_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fit_faces.hpp"
#include "relax/energy.hpp"
#include "weave/loom.hpp"

namespace relax {
namespace {

struct Range {
  std::size_t begin, end;  ///< nodes in the snapshot
  [[nodiscard]] std::size_t last() const { return end - 1; }
};

Range nodes_of(const weave::Snapshot& s, std::size_t f) {
  return {static_cast<std::size_t>(s.offset[f]), static_cast<std::size_t>(s.offset[f + 1])};
}

/// Points evenly spread over a fiber's rest length, each moved by its share of -mismatch, and the tension midway between them.
struct Resampled {
  std::vector<Vec3> x;          ///< the last one is where the fiber goes on
  std::vector<double> tension;  ///< from each point to the next [N]
};

Resampled resample(const weave::Snapshot& s, const Range& range, const Vec3& mismatch, double spacing) {
  const double length = s.arc[range.last()] - s.arc[range.begin];
  const int count = std::max(3, static_cast<int>(std::lround(length / spacing)));
  Resampled fiber;
  std::size_t p = range.begin;
  for (int half = 0; half <= 2 * count; ++half) {
    const double share = 0.5 * half / count, arc = s.arc[range.begin] + share * length;
    while (p + 2 < range.end && s.arc[p + 1] < arc) ++p;
    const double u = (arc - s.arc[p]) / (s.arc[p + 1] - s.arc[p]);
    if (half % 2 == 0) {
      fiber.x.push_back(s.x[p] + u * (s.x[p + 1] - s.x[p]) - share * mismatch);
    } else {
      fiber.tension.push_back(s.tension[p] + u * (s.tension[p + 1] - s.tension[p]));
    }
  }
  return fiber;
}

}  // namespace

WovenStart cell_from_woven(const weave::Case& c, const weave::Snapshot& nodes, const WovenOptions& options) {
  const weave::Snapshot as_cut = weave::on_axis(nodes), woven = fit_faces(as_cut);
  const weave::LoomLayout layout = weave::lay_out(c);
  const auto warps = static_cast<int>(layout.warps.size());
  if (!(woven.cell_length > 0)) throw std::invalid_argument("a start from a woven state needs a unit cell, not a whole loom");
  WovenStart start;
  Cell& cell = start.cell;
  cell.length_x = woven.x_max - woven.x_min;
  cell.length_y = woven.cell_width;
  for (const std::string& name : layout.type_names) {
    const weave::YarnType& y = c.yarns.at(name);
    cell.types.push_back({y.fiber_radius(), y.fiber_area(), y.youngs_modulus, y.compression_factor, y.transverse_modulus, y.density,
                          y.bending_stiffness / y.fibers});
  }
  finish_types(cell);
  const Vec3 origin(woven.x_min, 0, 0);
  for (std::size_t f = 0; f < woven.fibers(); ++f) {
    if (woven.yarn[f] < 0 || woven.yarn[f] >= warps + c.picks_per_cell() || (woven.weft[f] != 0) != (woven.yarn[f] >= warps))
      throw std::invalid_argument("a start from a woven state needs a unit cell of its own case");
  }
  // As the cloth leads down to the breast beam, the cell leans: it is sheared upright, warps and wefts alike.
  const std::vector<std::size_t> next = fibers_across_faces(as_cut);
  const Vec3 lean = lean_of(as_cut, next);
  const auto warp_fibers = std::count(woven.weft.begin(), woven.weft.end(), 0);
  std::vector<double> strain;
  for (std::size_t f = 0; f < woven.fibers(); ++f) {
    const bool weft = woven.weft[f] != 0;
    const int yarn = woven.yarn[f];
    const int type = weft ? layout.weft_type[static_cast<std::size_t>(c.layer_of_pick(yarn - warps))]
                          : layout.warps[static_cast<std::size_t>(yarn)].type;
    const Range range = nodes_of(woven, f);
    const Vec3 slant = weft ? Vec3::Zero() : lean;
    const Vec3 mismatch = mismatch_across_faces(woven, f, next[f]) - slant;
    const double diameter = 2 * cell.types[static_cast<std::size_t>(type)].radius;
    const weave::FiberType& fiber_type = cell.types[static_cast<std::size_t>(type)];
    if (std::abs(woven.radius[f] - fiber_type.radius) > 1e-9 * fiber_type.radius)
      throw std::invalid_argument(fmt::format(
          "{} yarn {} was woven of fibers {:.5g} um thick, but those of the case are {:.5g} um: a woven cell keeps its number of "
          "fibers a yarn, their linear density and packing",
          weft ? "weft" : "warp", yarn, 2e6 * woven.radius[f], 2e6 * fiber_type.radius));
    Resampled path = resample(woven, range, mismatch, options.element_length * diameter);
    for (Vec3& x : path.x) {
      x -= origin;
      x -= x.x() / cell.length_x * lean;
    }
    CellFiber fiber;
    for (const double tension : path.tension) strain.push_back(strain_under(fiber_type, tension, cell.slack_strain));
    fiber.rest_length.assign(path.tension.size(), options.element_length * diameter);  // until the axes are laid
    path.x.pop_back();
    fiber.x = std::move(path.x);
    fiber.weft = weft;
    fiber.type = static_cast<std::uint16_t>(type);
    fiber.yarn = yarn;
    fiber.place = woven.fiber[f];
    const auto in_yarn = static_cast<double>(std::count(woven.yarn.begin(), woven.yarn.end(), yarn));
    fiber.tension = (weft ? options.weft_tension : options.warp_tension) / in_yarn;
    add_fiber(cell, fiber, start.x);
    if (weft) continue;
    const double gap = (mismatch_across_faces(as_cut, f, next[f]) - slant).norm() / diameter;
    start.mismatch.largest = std::max(start.mismatch.largest, gap);
    start.mismatch.mean += gap;
    start.mismatch.moved += next[f] != f;
    start.mismatch.lean = lean.norm() / diameter;
  }
  if (warp_fibers > 0) start.mismatch.mean /= static_cast<double>(warp_fibers);
  close_fibers(cell, {next.begin(), next.end()});
  start.x = lay_axes(cell, start.x, strain);
  return start;
}

}  // namespace relax
