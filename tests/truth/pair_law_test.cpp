#include <gtest/gtest.h>

#include <cmath>

#include "weave/contact_law.hpp"

namespace {

using weave::PairLaw;

/// Composite Simpson rule.
double integral(auto&& f, double from, double to, int intervals) {
  const double h = (to - from) / intervals;
  double sum = f(from) + f(to);
  for (int i = 1; i < intervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(from + i * h);
  return sum * h / 3;
}

const PairLaw law = PairLaw::of(4e-5, 7e-5, 0.8e9, 2e9);

TEST(pair_law, line_force_is_that_of_yang_2015) {
  const double r = 2 * 4e-5 * 7e-5 / 11e-5, e = 2 / (1 / 0.8e9 + 1 / 2e9);
  for (const double overlap : {1e-9, 1e-6, 2e-5}) {
    const double expected = 4 * e * std::sqrt(r * overlap * overlap * overlap) / (3 * (11e-5 - overlap));
    EXPECT_NEAR(law.line_force(overlap) / expected, 1, 1e-14);  // round-off
    // k_n = E_T A_c / (l_c l_e), A_c / l_e = 2 sqrt(R delta)
    EXPECT_NEAR(law.line_stiffness(overlap) / (e * 2 * std::sqrt(r * overlap) / (11e-5 - overlap)), 1, 1e-14);
  }
}

TEST(pair_law, energies_are_the_integrals_of_the_forces) {
  for (const double ratio : {1e-7, 1e-5, 0.99e-4, 1.01e-4, 0.99e-3, 1.01e-3, 0.01, 0.049, 0.051, 0.1, 0.3, 0.6}) {
    const double overlap = ratio * law.reach;
    // By u = sqrt(delta) the integrand is smooth.
    const double line = integral([](double u) { return 2 * u * law.line_force(u * u); }, 0, std::sqrt(overlap), 2000);
    EXPECT_NEAR(law.line_energy(overlap) / line, 1, 1e-10) << ratio;  // round-off of either
  }
}

}  // namespace
