#pragma once
#include <Eigen/Core>

namespace weave {

/// A point or vector in loom axes: x warp, y weft, z thickness.
using Vec3 = Eigen::Vector3d;

}  // namespace weave
