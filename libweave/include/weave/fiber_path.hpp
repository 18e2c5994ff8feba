#pragma once
#include <optional>
#include <vector>

#include "weave/model.hpp"

namespace weave {

/// Point where a warp fiber passes the plane at `x`, the one nearest to the fiber's held end [m]; empty if it does not reach the plane.
std::optional<Vec3> fiber_at_x(const Model& model, const std::vector<Vec3>& nodes, std::uint32_t fiber, double x);

/// Point of a closed (periodic) fiber at `y`, y taken modulo the cell width; the returned y is the fiber's own [m].
Vec3 periodic_fiber_at_y(const Model& model, const std::vector<Vec3>& nodes, std::uint32_t fiber, double y);

}  // namespace weave
