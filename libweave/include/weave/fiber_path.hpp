#pragma once
#include <optional>
#include <vector>

#include "weave/model.hpp"

namespace weave {

/// Point where a warp fiber passes the plane at `x`, the one nearest to the fiber's held end [m]; empty if it does not reach the plane.
std::optional<Vec3> fiber_at_x(const Model& model, const std::vector<Vec3>& nodes, std::uint32_t fiber, double x);

/// Whether a warp fiber passes over (1) or under (-1) a point, seen along y; 0 if it does not reach the point. The fiber may double back,
/// as a binder does that is beaten up against the fell: what counts is on which side of it the point lies, going along the fiber.
int passes_over(const Model& model, const std::vector<Vec3>& nodes, std::uint32_t fiber, const Vec3& point);

/// Point of a closed (periodic) fiber at `y`, y taken modulo the cell width; the returned y is the fiber's own [m].
Vec3 periodic_fiber_at_y(const Model& model, const std::vector<Vec3>& nodes, std::uint32_t fiber, double y);

}  // namespace weave
