#include "scenes/yarn_surfaces.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace scenes {

relax::SurfaceMesh box_surface(const Vec3& low, const Vec3& high) {
  relax::SurfaceMesh box;
  for (int corner = 0; corner < 8; ++corner)
    box.points.emplace_back((corner & 1) != 0 ? high.x() : low.x(), (corner & 2) != 0 ? high.y() : low.y(),
                            (corner & 4) != 0 ? high.z() : low.z());
  box.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                   {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return box;
}

relax::SurfaceMesh tube_surface(const TubeShape& t, const YarnPath& path) {
  relax::SurfaceMesh tube;
  const auto n = static_cast<std::uint32_t>(t.sides);
  const auto rings = static_cast<std::uint32_t>(t.rings);
  const auto point = [&](double along, double u, double z) { return t.along == 0 ? Vec3(along, u, z) : Vec3(u, along, z); };
  for (std::uint32_t r = 0; r <= rings; ++r) {
    const double place = t.start + t.period * (r % rings) / rings;
    const Eigen::Vector2d center = path(place);
    const double along = r == rings ? t.start + t.period : place;
    for (std::uint32_t i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      tube.points.push_back(point(along, center.x() + t.half_width * std::cos(angle), center.y() + t.half_height * std::sin(angle)));
    }
  }
  // (along, lateral, z) is right-handed for a yarn along x only.
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (t.along == 0)
      tube.triangles.push_back({a, b, c});
    else
      tube.triangles.push_back({a, c, b});
  };
  for (std::uint32_t r = 0; r < rings; ++r)
    for (std::uint32_t i = 0; i < n; ++i) {
      const std::uint32_t a = r * n + i, b = r * n + (i + 1) % n;
      add(a, b, a + n);
      add(b, b + n, a + n);
    }
  for (std::uint32_t i = 1; i + 1 < n; ++i) {
    add(0, i + 1, i);
    add(rings * n, rings * n + i, rings * n + i + 1);
  }
  return tube;
}

double polygon_area(const TubeShape& t) {
  return 0.5 * t.sides * std::sin(2 * std::numbers::pi / t.sides) * t.half_width * t.half_height;
}

relax::YarnEnvelope envelope(int yarn, bool weft, relax::SurfaceMesh surface) {
  relax::YarnEnvelope e;
  e.yarn = yarn;
  e.weft = weft;
  e.surface = std::move(surface);
  return e;
}

weave::Snapshot one_yarn(double cell_length, double cell_width, bool weft, const YarnPath& path,
                         const std::vector<Eigen::Vector2d>& offsets, double radius, double area, int elements) {
  weave::Snapshot s;
  s.cell_length = s.x_max = cell_length;
  s.cell_width = cell_width;
  s.offset = {0};
  const double period = weft ? cell_width : cell_length;
  for (std::size_t f = 0; f < offsets.size(); ++f) {
    for (int i = 0; i <= elements; ++i) {
      const double along = period * i / elements;
      const Eigen::Vector2d center = path(period * (i % elements) / elements) + offsets[f];
      s.x.push_back(weft ? Vec3(center.x(), along, center.y()) : Vec3(along, center.x(), center.y()));
      s.tension.push_back(0);
      s.arc.push_back(along);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
    s.yarn.push_back(0);
    s.fiber.push_back(static_cast<int>(f));
    s.weft.push_back(weft ? 1 : 0);
    s.radius.push_back(radius);
    s.area.push_back(area);
  }
  return s;
}

std::vector<Eigen::Vector2d> grid_offsets(double width, double height, int columns, int rows) {
  std::vector<Eigen::Vector2d> offsets;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c) offsets.emplace_back(width * ((c + 0.5) / columns - 0.5), height * ((r + 0.5) / rows - 0.5));
  return offsets;
}

relax::VolumeMesh yarn_block(const std::array<int, 3>& voxels, const Vec3& size, const Vec3& direction, double volume_fraction) {
  relax::VolumeMesh m = relax::box_mesh(Vec3::Zero(), size, voxels);
  m.yarns = {0};
  m.yarn.assign(m.elements(), 0);
  m.direction.assign(m.elements(), direction.normalized());
  m.yarn_tangent = m.direction;
  m.volume_fraction.assign(m.elements(), volume_fraction);
  return m;
}

}  // namespace scenes
