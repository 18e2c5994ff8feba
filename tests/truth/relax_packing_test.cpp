#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "relax/minimize.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

constexpr double d = 1e-4;                       ///< fiber diameter [m]
constexpr int rows = 4, in_a_row = 6;            ///< of a bundle that fills a cell as wide as the fibers of a row
const double height_of_a_row = std::sqrt(0.75);  ///< of the hexagonal packing [d]

struct Bundle {
  relax::Cell cell = empty_cell(4 * d, in_a_row* d);
  std::vector<Vec3> x;
};

/// A loose, disordered bundle: rows 1.6 times as far apart as in the hexagonal packing, each fiber up to 0.3 d beside its place.
Bundle loose_bundle(double pressure, std::uint64_t seed) {
  Bundle bundle;
  bundle.cell.pressure = pressure;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> beside(-0.3, 0.3);
  for (int row = 0; row < rows; ++row) {
    for (int k = 0; k < in_a_row; ++k) {
      const double y = k + 0.5 * (row % 2) + beside(random), z = 1.6 * height_of_a_row * row + beside(random);
      relax::add_fiber(bundle.cell, straight_fiber(bundle.cell, false, {0, y * d, z * d}, 4, row * in_a_row + k, 1e-3), bundle.x);
    }
  }
  return bundle;
}

/// Overlap at which two fibers push one another apart by a force per length [m], by bisection.
double overlap_under(const relax::Cell& cell, double force) {
  double low = 0, high = 0.5 * d;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (cell.pair_law(0, 1).line_force(middle) > force ? high : low) = middle;
  }
  return low;
}

TEST(relax_packing, bundle_under_pressure_packs_as_a_hexagon_does) {
  for (const double pressure : {1e4, 1e6}) {
    for (const std::uint64_t seed : {1, 2}) {
      SCOPED_TRACE(testing::Message() << pressure << " Pa, seed " << seed);
      const Bundle bundle = loose_bundle(pressure, seed);
      const relax::MinimizeResult r = relax::minimize(bundle.cell, relax::unknowns_at(bundle.cell, bundle.x));
      ASSERT_TRUE(r.certificate.converged) << r.certificate.blocked_by;
      const relax::Unknowns unknowns(bundle.cell);
      const double thickness = r.q[unknowns.platens + 1] - r.q[unknowns.platens];
      // A fiber bears pressure x d per length. It passes that on to two fibers of the next row, half a diameter to either side; with a
      // platen it overlaps by half of what it would with its mirror image.
      const double load = pressure * d;
      double distance = d;
      for (int i = 0; i < 50; ++i) distance = d - overlap_under(bundle.cell, 0.5 * load / std::sqrt(1 - std::pow(0.5 * d / distance, 2)));
      const double expected = d - overlap_under(bundle.cell, load) + (rows - 1) * std::sqrt(distance * distance - 0.25 * d * d);
      EXPECT_NEAR(thickness / expected, 1, 1e-7);  // a Newton step of 1e-8 d is allowed per unknown
      EXPECT_NEAR(r.contacts.overlap_max, 1 - distance / d, 1e-7);
      // Circles of the least distance of two axes as their diameter do not overlap, and fill no more than this of any plane (Thue 1910).
      const double filled = rows * std::numbers::pi / 4 * in_a_row * d * d / (bundle.cell.length_y * thickness);
      EXPECT_LE(filled * std::pow(1 - r.contacts.overlap_max, 2), std::numbers::pi / std::sqrt(12.0));
    }
  }
}

}  // namespace
