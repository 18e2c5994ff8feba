#include "relax/woven_start.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "relax/energy.hpp"
#include "weave/loom.hpp"
#include "yarn_fibers.hpp"

namespace relax {
namespace {

struct Range {
  std::size_t begin, end;  ///< nodes in the snapshot
  [[nodiscard]] std::size_t last() const { return end - 1; }
};

Range nodes_of(const weave::Snapshot& s, std::size_t f) {
  return {static_cast<std::size_t>(s.offset[f]), static_cast<std::size_t>(s.offset[f + 1])};
}

/// Fibers in which the fibers begin ... end - 1, those of one yarn, go on.
void pair_across_faces(const weave::Snapshot& s, std::size_t begin, std::size_t end, const Vec3& period, std::vector<std::uint32_t>& next) {
  std::vector<Vec3> starts, ends;
  for (std::size_t f = begin; f < end; ++f) {
    starts.push_back(s.x[nodes_of(s, f).begin]);
    ends.push_back(s.x[nodes_of(s, f).last()]);
  }
  const std::vector<std::size_t> partner = fibers_that_go_on(starts, ends, period);
  for (std::size_t i = 0; i < partner.size(); ++i) next[begin + i] = static_cast<std::uint32_t>(begin + partner[i]);
}

/// From where a warp fiber should end to where it does: where it goes on, a period later.
Vec3 mismatch_of(const weave::Snapshot& s, std::size_t f, const std::vector<std::uint32_t>& next, const Vec3& period) {
  return s.x[nodes_of(s, f).last()] - s.x[nodes_of(s, next[f]).begin] - period;
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
  const weave::Snapshot woven = weave::on_axis(nodes);
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
  const Vec3 along_x(cell.length_x, 0, 0), along_y(0, cell.length_y, 0), origin(woven.x_min, 0, 0);
  std::vector<std::uint32_t> next(woven.fibers());
  for (std::size_t begin = 0; begin < woven.fibers();) {
    std::size_t end = begin + 1;
    while (end < woven.fibers() && woven.yarn[end] == woven.yarn[begin]) ++end;
    if (woven.yarn[begin] < 0 || woven.yarn[begin] >= warps + c.picks_per_cell() ||
        (woven.weft[begin] != 0) != (woven.yarn[begin] >= warps)) {
      throw std::invalid_argument("a start from a woven state needs a unit cell of its own case");
    }
    for (std::size_t f = begin; f < end; ++f) next[f] = static_cast<std::uint32_t>(f);
    if (!woven.weft[begin]) pair_across_faces(woven, begin, end, along_x, next);
    begin = end;
  }
  // As the cloth leads down to the breast beam, the cell leans: it is sheared upright, warps and wefts alike.
  Vec3 lean = Vec3::Zero();
  int count = 0;
  for (std::size_t f = 0; f < woven.fibers(); ++f) {
    if (woven.weft[f]) continue;
    lean += mismatch_of(woven, f, next, along_x);
    ++count;
  }
  if (count > 0) lean /= count;
  std::vector<double> strain;
  for (std::size_t f = 0; f < woven.fibers(); ++f) {
    const bool weft = woven.weft[f] != 0;
    const int yarn = woven.yarn[f];
    const int type = weft ? layout.weft_type[static_cast<std::size_t>(c.layer_of_pick(yarn - warps))]
                          : layout.warps[static_cast<std::size_t>(yarn)].type;
    const Range range = nodes_of(woven, f);
    const Vec3 mismatch = weft ? mismatch_of(woven, f, next, along_y) : Vec3(mismatch_of(woven, f, next, along_x) - lean);
    const double diameter = 2 * cell.types[static_cast<std::size_t>(type)].radius;
    const weave::FiberType& fiber_type = cell.types[static_cast<std::size_t>(type)];
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
    const double gap = mismatch.norm() / diameter;
    start.mismatch.largest = std::max(start.mismatch.largest, gap);
    start.mismatch.mean += gap;
    start.mismatch.moved += next[f] != f;
    start.mismatch.lean = lean.norm() / diameter;
  }
  if (count > 0) start.mismatch.mean /= count;
  close_fibers(cell, next);
  start.x = lay_axes(cell, start.x, strain);
  return start;
}

}  // namespace relax
