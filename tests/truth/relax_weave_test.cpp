#include <gtest/gtest.h>

#include "relax/minimize.hpp"
#include "relax/topology_start.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;

constexpr double d = 1e-4;  ///< yarn diameter [m]

TEST(relax_weave, tighter_than_jamming_ends_with_what_blocks_it) {
  // Below (sqrt 3)/2 D, Peirce's jamming, the yarns have no room for their arcs: axes bend more sharply than their distance, and closest
  // points jump along them. That is no minimum, but has to be said, and not to stop the program.
  for (const double element_length : {0.25, 0.4}) {
    const auto [cell, x] = relax::cell_from_topology(plain_weave({.fibers = 1, .pitch = 1.7 * d}), {1e-3, 1e-3, element_length});
    relax::MinimizeOptions options;
    options.sampling.between_yarns = 0.0625;
    const relax::MinimizeResult r = relax::minimize(cell, relax::unknowns_at(cell, x), options);
    EXPECT_FALSE(r.certificate.converged);
    EXPECT_FALSE(r.certificate.blocked_by.empty());
    EXPECT_TRUE(r.q.allFinite());
  }
}

}  // namespace
