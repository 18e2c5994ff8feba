#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "relax/envelope.hpp"
#include "weave/snapshot.hpp"

namespace relax {

struct FieldOptions {
  double kernel_radius = 2;  ///< fibers within it count at a point [diameters of the yarn's fibers]
};

/// Direction and local volume fraction of the fibers anywhere in one yarn of a periodic cell.
///
/// At stations along the yarn its fibers cross a plane normal to the period at points c_i, with solid areas a_i = A_i / |t_i . n|. The
/// local fraction is the kernel estimate
///   phi(p) = s sum_i a_i K(|p - c_i|) / M(p),   M(p) = integral of K(|x - p|) over the yarn's section,
/// with the biweight kernel K(r) = 3 (1 - r^2/h^2)^2 / (pi h^2), r < h. Dividing by the part of the kernel that lies within the section
/// keeps it free of bias at the section's edge (Jones, Stat. Comput. 3 (1993) 135); the factor s, near 1, of each station makes phi
/// integrate over its section to the fibers' solid area, and so over the yarn to their volume. The direction is the mean of the fibers'
/// tangents with the weights a_i K. Between two stations both estimates are made, fibers and section carried to the point's plane along the
/// tangents, and interpolated. M is integrated exactly across the section and by the midpoint rule over its height.
class YarnFields {
 public:
  /// `surface`: the yarn's, over one period; periodic images of fibers and surface may lie a lateral period apart. Throws
  /// std::invalid_argument if the snapshot is of no periodic cell, or has no fibers of that yarn.
  YarnFields(const weave::Snapshot& snapshot, int yarn, const SurfaceMesh& surface, const FieldOptions& options = {});

  struct Value {
    Vec3 direction;          ///< of the fibers, unit, toward rising x (warps) or y (wefts)
    double volume_fraction;  ///< solid fiber volume per volume; 0 where no fiber is near
    Vec3 yarn_tangent;       ///< of the path through the centroids of the sections, unit
    Eigen::Vector2d
        location;  ///< from that path: along side = tangent x up, and along up, which is normal to the tangent in its vertical plane [m]
  };
  /// At a point in the yarn or any of its periodic images [m].
  [[nodiscard]] Value at(const Vec3& point) const;

  [[nodiscard]] double fiber_volume() const { return fiber_volume_; }  ///< solid, over one period [m^3]

 private:
  struct Crossing {
    double u, z;  ///< in the station's plane [m]
    double area;  ///< a_i [m^2]
    Vec3 tangent;
  };
  struct Station {
    std::vector<Crossing> crossings;
    Vec3 centroid;
    double slope_u = 0, slope_z = 0;        ///< mean of the fibers'
    double scale = 1;                       ///< s
    std::vector<std::vector<double>> rows;  ///< laterals at which the row at each height enters and leaves the section, in pairs
  };
  struct Estimate {
    double fraction = 0;
    Vec3 direction = Vec3::Zero();
  };
  [[nodiscard]] Estimate estimate(const Station& station, double offset, double u, double z) const;
  [[nodiscard]] double kernel_mass(const Station& station, double u, double z) const;

  int along_ = 0, lateral_ = 1;  ///< coordinates
  double period_ = 0, lateral_period_ = 0, start_ = 0, spacing_ = 0, radius_ = 0, fiber_volume_ = 0;
  double lowest_ = 0, row_height_ = 0;  ///< of the rows of the sections
  std::vector<Station> stations_;
};

}  // namespace relax
