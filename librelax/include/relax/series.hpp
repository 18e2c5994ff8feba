#pragma once
#include <optional>
#include <vector>

namespace relax {

struct Extrapolation {
  double value = 0, uncertainty = 0;
};

/// The value for endlessly many fibers a yarn, from values at several counts n: least squares of a + b/n. Its uncertainty is the largest
/// difference to what comes out if any one count is left out, or if the powers n^(-1/2), as of a layer as thick as a fiber, or n^(-3/2)
/// stand in place of 1/n. Nothing for fewer than three counts. Throws std::invalid_argument for vectors of different lengths, counts < 1 or
/// repeated.
std::optional<Extrapolation> extrapolate(const std::vector<int>& counts, const std::vector<double>& values);

}  // namespace relax
