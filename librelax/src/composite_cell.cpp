#include "composite_cell.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "relax/surface_file.hpp"

namespace relax {
namespace {

std::vector<std::array<Vec3, 3>> side_of(const YarnEnvelope& yarn) {
  std::vector<std::array<Vec3, 3>> triangles;
  const std::vector<Vec3>& x = yarn.surface.points;
  for (const auto& t : side_triangles(yarn.surface, ends_of(yarn))) triangles.push_back({x[t[0]], x[t[1]], x[t[2]]});
  return triangles;
}

Vec3 middle_of(const Bounds& bounds) {
  return 0.5 * (bounds.low + bounds.high);
}

}  // namespace

Bounds bounds_of(const SurfaceMesh& surface) {
  Bounds b{surface.points.front(), surface.points.front()};
  for (const Vec3& x : surface.points) {
    b.low = b.low.cwiseMin(x);
    b.high = b.high.cwiseMax(x);
  }
  return b;
}

bool YarnEnds::at(const Vec3& x, double end) const {
  return std::abs(x[along] - end) < near;
}

YarnEnds ends_of(const YarnEnvelope& yarn) {
  const Bounds b = bounds_of(yarn.surface);
  const int along = yarn.weft ? 1 : 0;
  return {along, b.low[along], b.high[along], 1e-9 * (b.high - b.low)[along]};
}

std::vector<std::array<std::uint32_t, 3>> side_triangles(const SurfaceMesh& surface, const YarnEnds& ends) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto& t : surface.triangles) {
    const auto cap = [&](double end) {
      return std::all_of(t.begin(), t.end(), [&](std::uint32_t p) { return ends.at(surface.points[p], end); });
    };
    if (!cap(ends.low) && !cap(ends.high)) triangles.push_back(t);
  }
  return triangles;
}

CompositeCell composite_cell(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, double resin_margin) {
  if (envelopes.empty()) throw std::invalid_argument("composite mesh: no yarn envelopes");
  if (!(snapshot.cell_length > 0) || !(snapshot.cell_width > 0))
    throw std::invalid_argument("composite mesh: the snapshot is of no periodic cell");
  if (!(resin_margin >= 0)) throw std::invalid_argument("composite mesh: the resin margin must be >= 0");
  CompositeCell cell{{snapshot.x_min, 0, 1e300}, {snapshot.x_min + snapshot.cell_length, snapshot.cell_width, -1e300}, {}};
  for (const YarnEnvelope& e : envelopes) cell.yarns.push_back(&e);
  std::sort(cell.yarns.begin(), cell.yarns.end(), [](const YarnEnvelope* a, const YarnEnvelope* b) { return a->yarn < b->yarn; });
  for (std::size_t i = 0; i < cell.yarns.size(); ++i) {
    const YarnEnvelope& e = *cell.yarns[i];
    if (i > 0 && cell.yarns[i - 1]->yarn == e.yarn)
      throw std::invalid_argument("composite mesh: yarn " + std::to_string(e.yarn) + " has two envelopes");
    const Bounds b = bounds_of(e.surface);
    const int along = e.weft ? 1 : 0;
    const double period = (cell.high - cell.low)[along], length = (b.high - b.low)[along];
    if (std::abs(length - period) > 1e-6 * period)
      throw std::invalid_argument("composite mesh: the envelope of yarn " + std::to_string(e.yarn) + " is " + std::to_string(1e3 * length) +
                                  " mm long, but its period is " + std::to_string(1e3 * period) + " mm");
    cell.low.z() = std::min(cell.low.z(), b.low.z() - resin_margin);
    cell.high.z() = std::max(cell.high.z(), b.high.z() + resin_margin);
  }
  return cell;
}

YarnDistance::YarnDistance(const YarnEnvelope& yarn, const CompositeCell& cell)
    : along_(yarn.weft ? 1 : 0),
      middle_(middle_of(bounds_of(yarn.surface))),
      period_((cell.high - cell.low)[along_]),
      lateral_period_((cell.high - cell.low)[1 - along_]),
      side_(side_of(yarn)) {}

double YarnDistance::from(const Vec3& point) const {
  // The image of the point nearest to the middle of the surface, and those around it.
  Vec3 p = point;
  for (const auto& [axis, period] : {std::pair{along_, period_}, std::pair{1 - along_, lateral_period_}})
    p[axis] -= std::round((p[axis] - middle_[axis]) / period) * period;
  double best = 1e300;
  for (const double across : {0.0, -lateral_period_, lateral_period_})
    for (const double along : {0.0, -period_, period_}) {
      Vec3 image = p;
      image[along_] += along;
      image[1 - along_] += across;
      best = std::min(best, side_.from(image, best));
    }
  return best;
}

void fill_fields(const weave::Snapshot& snapshot, const CompositeCell& cell, const FieldOptions& options, CompositeMesh& composite) {
  VolumeMesh& m = composite.mesh;
  for (std::size_t y = 0; y < cell.yarns.size(); ++y) {
    const YarnFields fields(snapshot, cell.yarns[y]->yarn, cell.yarns[y]->surface, options);
    YarnVolume volume;
    volume.yarn = cell.yarns[y]->yarn;
    volume.envelope = enclosed_volume(cell.yarns[y]->surface);
    volume.fibers = fields.fiber_volume();
    double counted = 0;
    for (std::size_t i = 0; i < m.elements(); ++i) {
      if (m.yarn[i] != static_cast<std::int32_t>(y)) continue;
      const YarnFields::Value value = fields.at(m.center(i));
      m.direction[i] = value.direction;
      m.yarn_tangent[i] = value.yarn_tangent;
      m.location[i] = value.location;
      m.volume_fraction[i] = value.volume_fraction;
      volume.elements += m.volume(i);
      counted += value.volume_fraction * m.volume(i);
    }
    if (counted > 0) volume.fraction_scale = volume.fibers / counted;
    for (std::size_t i = 0; i < m.elements(); ++i)
      if (m.yarn[i] == static_cast<std::int32_t>(y)) m.volume_fraction[i] *= volume.fraction_scale;
    composite.volumes.push_back(volume);
  }
}

}  // namespace relax
