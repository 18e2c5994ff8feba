#pragma once
#include <cstdint>
#include <vector>

#include "relax/cell.hpp"

namespace relax {

/// Moves the fibers of a start at random, so that it can lead to another minimum: each across its period by a constant and one wave a
/// period, by `size` of its diameter at most. Fibers that go on in one another move alike and stay closed. With a `size` below one half no
/// two fibers come to lie on one another that did not overlap before, so that all stay on their sides. The same seed moves them in the same
/// way. Throws std::invalid_argument for a size < 0 or >= 0.5.
void perturb(const Cell& cell, double size, std::uint64_t seed, std::vector<Vec3>& x);

}  // namespace relax
