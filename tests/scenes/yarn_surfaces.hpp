#pragma once
#include <Eigen/Core>
#include <functional>

#include "relax/envelope.hpp"
#include "relax/volume_mesh.hpp"
#include "weave/snapshot.hpp"

/// Yarn surfaces and fibers by formula, shared by the tests of volume meshes.
namespace scenes {

using weave::Vec3;

/// Path of a yarn's center over its period: lateral and height at a place along it [m].
using YarnPath = std::function<Eigen::Vector2d(double)>;

/// Twelve triangles.
relax::SurfaceMesh box_surface(const Vec3& low, const Vec3& high);

/// A prism of an elliptic polygon with `sides` sides, whose rings lie in planes normal to `along` (0 or 1) with their centers on the path,
/// from `start` on over `period`. Its volume is the polygon's area times the period.
struct TubeShape {
  int along = 0;
  double start = 0, period = 1, half_width = 0.2, half_height = 0.1;  ///< [m]
  int rings = 32, sides = 24;
};
relax::SurfaceMesh tube_surface(const TubeShape& shape, const YarnPath& path);
double polygon_area(const TubeShape& shape);

relax::YarnEnvelope envelope(int yarn, bool weft, relax::SurfaceMesh surface);

/// A cell with one yarn, number 0, of fibers side by side at offsets (lateral, height) from the path; poly-lines of `elements` bars.
weave::Snapshot one_yarn(double cell_length, double cell_width, bool weft, const YarnPath& path,
                         const std::vector<Eigen::Vector2d>& offsets, double radius, double area, int elements);

/// Offsets on a grid of `columns` x `rows` cells that fill a rectangle of that width and height, at their middles.
std::vector<Eigen::Vector2d> grid_offsets(double width, double height, int columns, int rows);

/// A block of yarn 0 alone, with fibers along `direction` at the local volume fraction.
relax::VolumeMesh yarn_block(const std::array<int, 3>& voxels, const Vec3& size, const Vec3& direction, double volume_fraction);

}  // namespace scenes
