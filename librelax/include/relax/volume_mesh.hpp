#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "relax/envelope.hpp"
#include "relax/yarn_fields.hpp"
#include "weave/snapshot.hpp"

namespace relax {

/// Elements of a periodic unit cell of a composite, yarns in matrix, with what each is made of.
struct VolumeMesh {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< of the cell [m]
  std::array<int, 3> voxels{0, 0, 0};            ///< elements along x, y, z; their numbers rise along x first, then y, then z
  std::vector<int> yarns;                        ///< numbers of the yarns, as in weave::Snapshot, rising

  std::vector<Vec3> points;                         ///< [m]
  std::vector<std::array<std::uint32_t, 8>> hexes;  ///< corners: four below counterclockwise seen from above, then the four above them

  // per element
  std::vector<std::int32_t> yarn;         ///< index into `yarns`, -1: matrix
  std::vector<Vec3> direction;            ///< of the fibers, unit; zero in matrix, as are those that follow
  std::vector<Vec3> yarn_tangent;         ///< of the yarn's path, unit
  std::vector<Eigen::Vector2d> location;  ///< as in YarnFields::Value [m]
  std::vector<double> volume_fraction;    ///< local, of the solid fibers
  std::vector<double> surface_distance;   ///< of the element's center from the yarn's surface, negative inside [m]

  [[nodiscard]] std::size_t elements() const { return hexes.size(); }
  [[nodiscard]] double element_volume() const { return (high - low).prod() / static_cast<double>(elements()); }
};

struct VoxelOptions {
  std::array<int, 3> counts{0, 0, 0};  ///< along x, y, z; zeros: from `size` or `elements`
  double size = 0;                     ///< edge of a voxel, about, rounded so that whole ones fill the cell [m]; 0: from `elements`
  int elements = 12000;                ///< about so many, twice as long along x and y as they are high
  double resin_margin = 0;             ///< matrix above the highest and below the lowest envelope [m]
  FieldOptions fields = {};
};

/// What became of each yarn in a voxel mesh.
struct YarnVolume {
  int yarn = 0;
  double envelope = 0;        ///< volume that the surface bounds [m^3]
  double voxels = 0;          ///< volume of the yarn's elements [m^3]
  double fibers = 0;          ///< solid volume of its fibers [m^3]
  double fraction_scale = 1;  ///< by which the local fractions were multiplied, so that they add up to `fibers`
};

struct VoxelMesh {
  VolumeMesh mesh;
  std::vector<YarnVolume> volumes;  ///< as mesh.yarns
  std::size_t contested = 0;        ///< elements within more than one envelope
};

/// Counts along x, y and z for a box of the given size [m] by the options.
std::array<int, 3> voxel_counts(const Vec3& size, const VoxelOptions& options);

/// Hexahedra of one size that fill the cell x_min ... x_min + cell_length, 0 ... cell_width, lowest ... highest envelope. An element
/// belongs to the yarn whose envelope, or a periodic image of it, holds its center; to the one in which it lies deepest where there are
/// several (as in TexGen), and of equally deep ones to that of the lower number. Columns of centers are intersected with the surfaces, row
/// by row; a center that lies on a surface counts as lying a little farther along x, y and z, so that a column always leaves a closed
/// surface as often as it enters. Local fiber volume fractions are YarnFields', scaled yarn by yarn so that they add up to the fibers'
/// volume. Throws std::invalid_argument for no envelopes, a yarn twice or unknown to the snapshot, counts below 1, or an envelope that does
/// not span its period.
VoxelMesh voxel_mesh(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, const VoxelOptions& options = {});

/// Points and hexahedra of a box, all matrix.
VolumeMesh box_mesh(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts);

}  // namespace relax
