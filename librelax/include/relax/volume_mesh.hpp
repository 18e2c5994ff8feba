#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "relax/envelope.hpp"
#include "relax/yarn_fields.hpp"
#include "weave/snapshot.hpp"

namespace relax {

/// Nodes of an element, in the order of Abaqus and CalculiX.
enum class ElementShape {
  hexahedron,     ///< 8 corners: four below counterclockwise seen from above, then the four above them (C3D8)
  tetrahedron,    ///< 4 corners: the fourth above the first three counterclockwise (C3D4)
  tetrahedron_10  ///< these, then the middles of 1-2, 2-3, 3-1, 1-4, 2-4, 3-4 (C3D10)
};
int nodes_of(ElementShape shape);

/// Elements of a periodic unit cell of a composite, yarns in matrix, with what each is made of.
struct VolumeMesh {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  ///< of the cell [m]
  std::array<int, 3> voxels{0, 0, 0};            ///< hexahedra along x, y, z; their numbers rise along x first, then y, then z
  std::vector<int> yarns;                        ///< numbers of the yarns, as in weave::Snapshot, rising

  std::vector<Vec3> points;  ///< [m]
  ElementShape shape = ElementShape::hexahedron;
  std::vector<std::uint32_t> nodes;  ///< of all elements, one element after the other

  // per element
  std::vector<std::int32_t> yarn;         ///< index into `yarns`, -1: matrix
  std::vector<Vec3> direction;            ///< of the fibers, unit; zero in matrix, as are those that follow
  std::vector<Vec3> yarn_tangent;         ///< of the yarn's path, unit
  std::vector<Eigen::Vector2d> location;  ///< as in YarnFields::Value [m]
  std::vector<double> volume_fraction;    ///< local, of the solid fibers
  std::vector<double> surface_distance;   ///< of the element's center from the yarn's surface, negative inside [m]

  [[nodiscard]] std::size_t elements() const { return nodes.size() / static_cast<std::size_t>(nodes_of(shape)); }
  [[nodiscard]] std::span<const std::uint32_t> element(std::size_t i) const;  ///< its nodes
  [[nodiscard]] Vec3 center(std::size_t i) const;                             ///< [m]
  [[nodiscard]] double volume(std::size_t i) const;                           ///< [m^3]
};

/// Sets all elements to matrix.
void make_all_matrix(VolumeMesh& mesh);

/// What became of each yarn in a mesh.
struct YarnVolume {
  int yarn = 0;
  double envelope = 0;        ///< volume that the surface bounds [m^3]
  double elements = 0;        ///< volume of the yarn's elements [m^3]
  double fibers = 0;          ///< solid volume of its fibers [m^3]
  double fraction_scale = 1;  ///< by which the local fractions were multiplied, so that they add up to `fibers`
};

struct CompositeMesh {
  VolumeMesh mesh;
  std::vector<YarnVolume> volumes;  ///< as mesh.yarns
  std::size_t contested = 0;        ///< voxels within more than one envelope
};

struct VoxelOptions {
  std::array<int, 3> counts{0, 0, 0};  ///< along x, y, z; zeros: from `size` or `elements`
  double size = 0;                     ///< edge of a voxel, about, rounded so that whole ones fill the cell [m]; 0: from `elements`
  int elements = 12000;                ///< about so many, twice as long along x and y as they are high
  double resin_margin = 0;             ///< matrix above the highest and below the lowest envelope [m]
  FieldOptions fields = {};
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
CompositeMesh voxel_mesh(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, const VoxelOptions& options = {});

/// Points and hexahedra of a box, all matrix.
VolumeMesh box_mesh(const Vec3& low, const Vec3& high, const std::array<int, 3>& counts);

struct TetOptions {
  double edge_length = 0;  ///< of the triangles on the cell's sides, and of the largest tetrahedra about twice that [m]; 0: the mean of the
                           ///< surfaces' edges
  double resin_margin = 0;    ///< matrix above the highest and below the lowest envelope [m]; 0: a tenth of the edge length
  double radius_ratio = 1.6;  ///< largest circumradius of a tetrahedron over its shortest edge, where the surfaces allow it
  FieldOptions fields = {};
};

/// How well shaped the tetrahedra are, and what of the surfaces was meshed.
struct TetQuality {
  double resin_margin = 0;                    ///< as used [m]
  double edge_length = 0;                     ///< as used [m]
  double dihedral_min = 0, dihedral_max = 0;  ///< between two sides of an element [rad]
  double flat_share = 0;                      ///< of the elements with a dihedral angle below 5 degrees
  std::size_t surface_triangles = 0;          ///< of the yarns within the cell
};

/// Tetrahedra that fill the cell and conform to the yarns' surfaces: each triangle of an envelope is a face between two elements. Surfaces
/// that pass a side of the cell are cut there, where points very near to it move onto it, and go on at the opposite one; opposite sides are
/// triangulated alike, so that points and faces on them match to the last bit under the cell's translations. What lies between is meshed by
/// TetGen (Si 2015, ACM Trans. Math. Softw. 41:11), which leaves the surfaces as they are. Fields of the elements as in voxel_mesh, at
/// their centers. Throws std::invalid_argument as voxel_mesh does, and for an edge length below a twentieth of the surfaces' or above half
/// the cell; std::runtime_error where surfaces cross or TetGen fails, saying so.
CompositeMesh tet_mesh(const weave::Snapshot& snapshot, const std::vector<YarnEnvelope>& envelopes, const TetOptions& options,
                       TetQuality* quality = nullptr);

/// The same tetrahedra with nodes at the middles of their edges, whose points follow the others.
VolumeMesh with_middle_nodes(const VolumeMesh& tetrahedra);
/// The inverse.
VolumeMesh without_middle_nodes(const VolumeMesh& tetrahedra);

}  // namespace relax
