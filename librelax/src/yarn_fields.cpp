#include "relax/yarn_fields.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "weave/section.hpp"

namespace relax {
namespace {

constexpr double rows_per_kernel_radius = 8;  // midpoint rule over a smooth kernel: error below 1e-3 of its mass

weave::Snapshot fibers_of_yarn(const weave::Snapshot& s, int yarn) {
  weave::Snapshot part;
  part.cell_width = s.cell_width;
  part.cell_length = s.cell_length;
  part.x_min = s.x_min;
  part.x_max = s.x_max;
  part.offset = {0};
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    if (s.yarn[f] != yarn) continue;
    for (auto node = static_cast<std::size_t>(s.offset[f]); node < static_cast<std::size_t>(s.offset[f + 1]); ++node) {
      part.x.push_back(s.x[node]);
      part.tension.push_back(0);
      part.arc.push_back(0);
    }
    part.offset.push_back(static_cast<std::int64_t>(part.x.size()));
    part.yarn.push_back(yarn);
    part.fiber.push_back(s.fiber[f]);
    part.weft.push_back(s.weft[f]);
    part.radius.push_back(s.radius[f]);
    part.area.push_back(s.area[f]);
  }
  return part;
}

/// Unit tangents at nodes: along the chord of the two neighbors, at a fiber's ends along its bar.
std::vector<Vec3> node_tangents(const weave::Snapshot& s) {
  std::vector<Vec3> tangents(s.x.size());
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    const auto first = static_cast<std::size_t>(s.offset[f]), end = static_cast<std::size_t>(s.offset[f + 1]);
    for (std::size_t i = first; i < end; ++i) tangents[i] = (s.x[std::min(i + 1, end - 1)] - s.x[i > first ? i - 1 : i]).normalized();
  }
  return tangents;
}

/// The outline of a surface in the plane where the coordinate `along` is `value`, as segments ((lateral, z), (lateral, z)). A point in the
/// plane counts as above it, so that the outline is closed.
struct Segment {
  double u_a, z_a, u_b, z_b;
};
std::vector<Segment> outline(const SurfaceMesh& surface, int along, double value) {
  const int lateral = 1 - along;
  std::vector<Segment> segments;
  for (const auto& t : surface.triangles) {
    std::array<Vec3, 2> cut;
    std::size_t cuts = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      // From the lower index, so that both triangles of an edge find the same point.
      const auto [low, high] = std::minmax(t[i], t[(i + 1) % 3]);
      const Vec3 &a = surface.points[low], &b = surface.points[high];
      if ((a[along] >= value) != (b[along] >= value)) cut[cuts++] = a + (value - a[along]) / (b[along] - a[along]) * (b - a);
    }
    if (cuts == 2) segments.push_back({cut[0][lateral], cut[0].z(), cut[1][lateral], cut[1].z()});
  }
  return segments;
}

/// Laterals at which a row at height z enters and leaves the outline, in pairs.
std::vector<double> row_crossings(const std::vector<Segment>& outline, double z) {
  std::vector<double> crossings;
  for (const Segment& s : outline)
    if ((s.z_a >= z) != (s.z_b >= z)) crossings.push_back(s.u_a + (z - s.z_a) / (s.z_b - s.z_a) * (s.u_b - s.u_a));
  std::sort(crossings.begin(), crossings.end());
  return crossings;
}

/// Integral over x from -infinity of (a - b x^2)^2 where that is positive, up to x.
double biweight_integral(double a, double b, double x) {
  const double end = std::sqrt(a / b);
  x = std::clamp(x, -end, end);
  const auto primitive = [&](double y) { return y * (a * a + y * y * b * (-2 * a / 3 + y * y * b / 5)); };
  return primitive(x) - primitive(-end);
}

}  // namespace

YarnFields::YarnFields(const weave::Snapshot& snapshot, int yarn, const SurfaceMesh& surface, const FieldOptions& options) {
  if (!(snapshot.cell_length > 0) || !(snapshot.cell_width > 0))
    throw std::invalid_argument("fields of a yarn: the snapshot is of no periodic cell");
  if (!(options.kernel_radius > 0)) throw std::invalid_argument("fields of a yarn: the kernel's radius must be > 0");
  const weave::Snapshot fibers = fibers_of_yarn(snapshot, yarn);
  if (fibers.fibers() == 0) throw std::invalid_argument("fields of a yarn: the snapshot has no fibers of yarn " + std::to_string(yarn));
  const bool weft = fibers.weft.front() != 0;
  along_ = weft ? 1 : 0;
  lateral_ = 1 - along_;
  period_ = weft ? snapshot.cell_width : snapshot.cell_length;
  lateral_period_ = weft ? snapshot.cell_length : snapshot.cell_width;

  double radius_sum = 0;
  for (std::size_t f = 0; f < fibers.fibers(); ++f) {
    radius_sum += fibers.radius[f];
    for (auto i = static_cast<std::size_t>(fibers.offset[f]); i + 1 < static_cast<std::size_t>(fibers.offset[f + 1]); ++i)
      fiber_volume_ += fibers.area[f] * (fibers.x[i + 1] - fibers.x[i]).norm();
  }
  const double diameter = 2 * radius_sum / static_cast<double>(fibers.fibers());
  radius_ = options.kernel_radius * diameter;

  Vec3 low = surface.points.front(), high = low;
  for (const Vec3& x : surface.points) {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  start_ = low[along_];
  lowest_ = low.z();
  row_height_ = radius_ / rows_per_kernel_radius;
  const auto rows = static_cast<int>(std::ceil((high.z() - low.z()) / row_height_));
  const auto count = static_cast<std::size_t>(std::max(4.0, std::ceil(2 * period_ / diameter)));
  spacing_ = period_ / static_cast<double>(count);

  const std::vector<Vec3> tangents = node_tangents(fibers);
  stations_.resize(count);
  for (std::size_t k = 0; k < count; ++k) {
    const double value = start_ + (static_cast<double>(k) + 0.5) * spacing_;
    const std::vector<weave::SectionCircle> circles =
        weave::cut_section(fibers, weft ? weave::SectionAxis::y : weave::SectionAxis::x, value);
    if (circles.empty())
      throw std::invalid_argument("fields of a yarn: no fiber of yarn " + std::to_string(yarn) + " crosses a plane of its period");
    double mean = 0;
    for (const weave::SectionCircle& c : circles) mean += c.u / static_cast<double>(circles.size());
    const double shift = std::round((0.5 * (low[lateral_] + high[lateral_]) - mean) / lateral_period_) * lateral_period_;

    Station& station = stations_[k];
    const std::vector<Segment> section = outline(surface, along_, value);
    for (int r = 0; r < rows; ++r) station.rows.push_back(row_crossings(section, lowest_ + (r + 0.5) * row_height_));
    double area_sum = 0, u_sum = 0, z_sum = 0;
    for (const weave::SectionCircle& c : circles) {
      const double a = fibers.x[c.node][along_], b = fibers.x[c.node + 1][along_];
      const double periods = std::round((value - 0.5 * (a + b)) / period_);
      const double part = std::clamp((value - periods * period_ - a) / (b - a), 0.0, 1.0);
      Crossing crossing;
      crossing.tangent = ((1 - part) * tangents[c.node] + part * tangents[c.node + 1]).normalized();
      if (crossing.tangent[along_] < 0) crossing.tangent = -crossing.tangent;
      crossing.u = c.u + shift;
      crossing.z = c.z;
      crossing.area = fibers.area[c.fiber] / std::max(crossing.tangent[along_], 1 / weave::max_section_aspect);
      station.crossings.push_back(crossing);
      area_sum += crossing.area;
      u_sum += crossing.area * crossing.u;
      z_sum += crossing.area * crossing.z;
      station.slope_u += crossing.area * crossing.tangent[lateral_] / crossing.tangent[along_];
      station.slope_z += crossing.area * crossing.tangent.z() / crossing.tangent[along_];
    }
    station.slope_u /= area_sum;
    station.slope_z /= area_sum;
    station.centroid[along_] = value;
    station.centroid[lateral_] = u_sum / area_sum;
    station.centroid.z() = z_sum / area_sum;

    double integral = 0;
    for (std::size_t r = 0; r < station.rows.size(); ++r) {
      const double z = lowest_ + (static_cast<double>(r) + 0.5) * row_height_;
      const std::vector<double>& ends = station.rows[r];
      for (std::size_t i = 0; i + 1 < ends.size(); i += 2) {
        const int steps = std::max(1, static_cast<int>(std::ceil((ends[i + 1] - ends[i]) / (2 * row_height_))));
        const double step = (ends[i + 1] - ends[i]) / steps;
        for (int j = 0; j < steps; ++j) integral += estimate(station, 0, ends[i] + (j + 0.5) * step, z).fraction * step * row_height_;
      }
    }
    if (integral > 0) station.scale = area_sum / integral;
  }
}

double YarnFields::kernel_mass(const Station& station, double u, double z) const {
  const auto count = static_cast<int>(station.rows.size());
  const int first = std::max(0, static_cast<int>(std::floor((z - radius_ - lowest_) / row_height_)));
  const int end = std::min(count, static_cast<int>(std::ceil((z + radius_ - lowest_) / row_height_)) + 1);
  double mass = 0;
  for (int r = first; r < end; ++r) {
    const double dz = (lowest_ + (r + 0.5) * row_height_ - z) / radius_;
    if (std::abs(dz) >= 1) continue;
    const std::vector<double>& ends = station.rows[static_cast<std::size_t>(r)];
    for (std::size_t i = 0; i + 1 < ends.size(); i += 2)
      mass += biweight_integral(1 - dz * dz, 1, (ends[i + 1] - u) / radius_) - biweight_integral(1 - dz * dz, 1, (ends[i] - u) / radius_);
  }
  return mass * 3 / std::numbers::pi / rows_per_kernel_radius;
}

YarnFields::Estimate YarnFields::estimate(const Station& station, double offset, double u, double z) const {
  Estimate sum;
  double nearest = 1e300;
  Vec3 nearest_tangent = Vec3::UnitX();
  for (const Crossing& c : station.crossings) {
    const double du = c.u + offset * c.tangent[lateral_] / c.tangent[along_] - u;
    const double dz = c.z + offset * c.tangent.z() / c.tangent[along_] - z;
    const double r2 = (du * du + dz * dz) / (radius_ * radius_);
    if (r2 < nearest) {
      nearest = r2;
      nearest_tangent = c.tangent;
    }
    if (r2 >= 1) continue;
    const double weight = c.area * (1 - r2) * (1 - r2);
    sum.fraction += weight;
    sum.direction += weight * c.tangent;
  }
  if (sum.fraction <= 0) sum.direction = nearest_tangent;
  sum.direction.normalize();
  constexpr double least_mass = 0.05;  // of a point outside the section; one in a corner of it has 0.25
  const double mass = std::max(least_mass, kernel_mass(station, u - offset * station.slope_u, z - offset * station.slope_z));
  sum.fraction *= station.scale * 3 / (std::numbers::pi * radius_ * radius_ * mass);
  return sum;
}

YarnFields::Value YarnFields::at(const Vec3& point) const {
  const auto count = static_cast<std::ptrdiff_t>(stations_.size());
  const double place = (point[along_] - start_) / spacing_ - 0.5;
  const auto before = static_cast<std::ptrdiff_t>(std::floor(place));
  const double part = place - static_cast<double>(before);
  const auto station = [&](std::ptrdiff_t k) -> const Station& {
    return stations_[static_cast<std::size_t>(((k % count) + count) % count)];
  };
  const Station &a = station(before), &b = station(before + 1);

  Vec3 path = (b.centroid - a.centroid);
  path[along_] = spacing_;
  const Vec3 centroid = a.centroid + part * path;  // but for the coordinate along the yarn
  const double u = point[lateral_] - std::round((point[lateral_] - centroid[lateral_]) / lateral_period_) * lateral_period_;
  const Estimate from_a = estimate(a, part * spacing_, u, point.z()), from_b = estimate(b, (part - 1) * spacing_, u, point.z());

  Value value;
  value.volume_fraction = (1 - part) * from_a.fraction + part * from_b.fraction;
  value.direction = ((1 - part) * from_a.direction + part * from_b.direction).normalized();
  Vec3 wide = station(before + 2).centroid - station(before - 1).centroid;  // chords of three stations: smoother than one
  wide[along_] = 3 * spacing_;
  value.yarn_tangent = wide.normalized();
  const Vec3 up = (Vec3::UnitZ() - value.yarn_tangent.z() * value.yarn_tangent).normalized();
  Vec3 relative = Vec3::Zero();
  relative[lateral_] = u - centroid[lateral_];
  relative.z() = point.z() - centroid.z();
  value.location = {relative.dot(value.yarn_tangent.cross(up)), relative.dot(up)};
  return value;
}

}  // namespace relax
