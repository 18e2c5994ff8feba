#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "composite_cell.hpp"
#include "relax/volume_mesh.hpp"

namespace relax {
namespace {

/// Where grid lines pass a surface: center `index` of the grid, shifted by whole periods into low <= value < high.
struct Line {
  int index;
  double value;
};
std::vector<Line> lines_through(double origin, double spacing, int count, double low, double high) {
  const double period = spacing * count;
  std::vector<Line> lines;
  for (int i = 0; i < count; ++i) {
    const double center = origin + (i + 0.5) * spacing;
    for (double image = std::floor((low - center) / period); center + image * period < high; ++image)
      if (center + image * period >= low) lines.push_back({i, center + image * period});
  }
  std::sort(lines.begin(), lines.end(), [](const Line& a, const Line& b) { return a.value < b.value; });
  return lines;
}

/// Part of the lines with low <= value < high: those that a segment from `low` to `high` crosses if an end on a line lies below it.
std::pair<std::size_t, std::size_t> crossed(const std::vector<Line>& lines, double low, double high) {
  const auto below = [&](double value) {
    return static_cast<std::size_t>(
        std::lower_bound(lines.begin(), lines.end(), value, [](const Line& l, double v) { return l.value < v; }) - lines.begin());
  };
  return {below(low), below(high)};
}

/// A directed segment (x, z) in a row: the surface's inside lies to its left, seen toward rising y.
struct RowSegment {
  double x_a, z_a, x_b, z_b;
};

/// Marks the voxels whose centers lie in a yarn or its periodic images.
void mark_inside(const SurfaceMesh& surface, const VolumeMesh& mesh, std::vector<std::uint8_t>& inside) {
  const auto [nx, ny, nz] = mesh.voxels;
  const Vec3 spacing = (mesh.high - mesh.low).cwiseQuotient(Vec3(nx, ny, nz));
  const Bounds b = bounds_of(surface);
  const std::vector<Line> rows = lines_through(mesh.low.y(), spacing.y(), ny, b.low.y(), b.high.y());
  const std::vector<Line> columns = lines_through(mesh.low.x(), spacing.x(), nx, b.low.x(), b.high.x());

  std::vector<std::vector<RowSegment>> segments(rows.size());
  for (const auto& t : surface.triangles) {
    const double y0 = surface.points[t[0]].y(), y1 = surface.points[t[1]].y(), y2 = surface.points[t[2]].y();
    const auto [first, end] = crossed(rows, std::min({y0, y1, y2}), std::max({y0, y1, y2}));
    for (std::size_t r = first; r < end; ++r) {
      const double y = rows[r].value;
      RowSegment s{};
      for (std::size_t i = 0; i < 3; ++i) {
        const std::uint32_t from = t[i], to = t[(i + 1) % 3];
        const bool rises = surface.points[from].y() <= y && surface.points[to].y() > y;
        const bool falls = surface.points[from].y() > y && surface.points[to].y() <= y;
        if (!rises && !falls) continue;
        // From the lower index, so that both triangles of an edge find the same point.
        const Vec3 &p = surface.points[std::min(from, to)], &q = surface.points[std::max(from, to)];
        const Vec3 cut = p + (y - p.y()) / (q.y() - p.y()) * (q - p);
        (rises ? s.x_a : s.x_b) = cut.x();
        (rises ? s.z_a : s.z_b) = cut.z();
      }
      segments[r].push_back(s);
    }
  }

  struct Crossing {
    double z;
    int enters;  ///< +1 or -1
  };
  std::vector<std::vector<Crossing>> column(columns.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (auto& crossings : column) crossings.clear();
    for (const RowSegment& s : segments[r]) {
      const auto [first, end] = crossed(columns, std::min(s.x_a, s.x_b), std::max(s.x_a, s.x_b));
      for (std::size_t c = first; c < end; ++c) {
        const double z = s.z_a + (columns[c].value - s.x_a) / (s.x_b - s.x_a) * (s.z_b - s.z_a);
        column[c].push_back({z, s.x_b > s.x_a ? 1 : -1});
      }
    }
    for (std::size_t c = 0; c < columns.size(); ++c) {
      auto& crossings = column[c];
      std::sort(crossings.begin(), crossings.end(), [](const Crossing& p, const Crossing& q) { return p.z < q.z; });
      int depth = 0;
      for (std::size_t i = 0; i + 1 < crossings.size(); ++i) {
        depth += crossings[i].enters;
        if (depth <= 0) continue;
        const auto first = static_cast<int>(std::ceil((crossings[i].z - mesh.low.z()) / spacing.z() - 0.5));
        const auto end = static_cast<int>(std::ceil((crossings[i + 1].z - mesh.low.z()) / spacing.z() - 0.5));
        for (int k = std::max(first, 0); k < std::min(end, nz); ++k)
          inside[static_cast<std::size_t>(columns[c].index + nx * (rows[r].index + ny * k))] = 1;
      }
    }
  }
}

/// Throws std::invalid_argument for more voxels than are meant by any mesh; the counts' product stays within an int.
std::array<int, 3> expect_few(const std::array<double, 3>& counts) {
  constexpr double most = 1e8;
  const double all = counts[0] * counts[1] * counts[2];
  if (!(all <= most))
    throw std::invalid_argument(fmt::format("voxels: {:.0f} x {:.0f} x {:.0f} would be {:.2g} elements; at most {:.0g} are made", counts[0],
                                            counts[1], counts[2], all, most));
  return {static_cast<int>(counts[0]), static_cast<int>(counts[1]), static_cast<int>(counts[2])};
}

}  // namespace

std::array<int, 3> voxel_counts(const Vec3& size, const VoxelOptions& options) {
  if (options.counts != std::array<int, 3>{0, 0, 0}) {
    for (const int n : options.counts)
      if (n < 1) throw std::invalid_argument("voxels: counts along x, y and z must be at least 1");
    return expect_few({1.0 * options.counts[0], 1.0 * options.counts[1], 1.0 * options.counts[2]});
  }
  const auto count = [](double length, double step) { return std::max(1.0, std::round(length / step)); };
  if (options.size > 0) return expect_few({count(size.x(), options.size), count(size.y(), options.size), count(size.z(), options.size)});
  if (options.elements < 1) throw std::invalid_argument("voxels: the number of elements must be at least 1");
  const double height = std::cbrt(size.prod() / (4.0 * options.elements));
  return expect_few({count(size.x(), 2 * height), count(size.y(), 2 * height), count(size.z(), height)});
}

VolumeMesh box_mesh(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts) {
  VolumeMesh m;
  m.low = low;
  m.high = high;
  m.voxels = counts;
  const auto [nx, ny, nz] = counts;
  const auto coordinate = [&](Eigen::Index axis, int i) {
    const int n = counts[static_cast<std::size_t>(axis)];
    return i == n ? high[axis] : low[axis] + i * ((high - low)[axis] / n);
  };
  for (int k = 0; k <= nz; ++k)
    for (int j = 0; j <= ny; ++j)
      for (int i = 0; i <= nx; ++i) m.points.emplace_back(coordinate(0, i), coordinate(1, j), coordinate(2, k));
  const auto point = [nx = nx, ny = ny](int i, int j, int k) { return static_cast<std::uint32_t>(i + (nx + 1) * (j + (ny + 1) * k)); };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        for (const int up : {k, k + 1})
          for (const std::uint32_t corner : {point(i, j, up), point(i + 1, j, up), point(i + 1, j + 1, up), point(i, j + 1, up)})
            m.nodes.push_back(corner);
  make_all_matrix(m);
  return m;
}

CompositeMesh voxel_mesh(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, const VoxelOptions& options) {
  const CompositeCell cell = composite_cell(snapshot, envelopes, options.resin_margin);
  CompositeMesh result;
  VolumeMesh& m = result.mesh;
  m = box_mesh(cell.low, cell.high, voxel_counts(cell.high - cell.low, options));
  std::vector<std::uint8_t> contested(m.elements(), 0);
  for (const YarnEnvelope* e : cell.yarns) {
    const auto index = static_cast<std::int32_t>(m.yarns.size());
    m.yarns.push_back(e->yarn);
    std::vector<std::uint8_t> inside(m.elements(), 0);
    mark_inside(e->surface, m, inside);
    const YarnDistance distance(*e, cell);
    for (std::size_t i = 0; i < m.elements(); ++i) {
      if (inside[i] == 0) continue;
      const double depth = -distance.from(m.center(i));
      if (m.yarn[i] >= 0) contested[i] = 1;
      if (m.yarn[i] >= 0 && depth >= m.surface_distance[i]) continue;
      m.yarn[i] = index;
      m.surface_distance[i] = depth;
    }
  }
  result.contested = static_cast<std::size_t>(std::count(contested.begin(), contested.end(), 1));
  fill_fields(snapshot, cell, options.fields, result);
  return result;
}

}  // namespace relax
