#include "weave/bar_tensions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <cmath>
#include <vector>

using weave::Vec3;

namespace {

/// A taut chain of bars on an arc, its nodes of different masses and in motion; closed or open.
struct Chain {
  explicit Chain(bool is_closed) : closed(is_closed) {
    for (int p = 0; p <= bars; ++p) {
      inverse_mass.push_back(1e6 * (1 + 0.3 * (p % 3)));
      v.emplace_back(0.2 * std::sin(2.0 * p), 0.1 * std::cos(3.0 * p), -0.3 * std::sin(1.0 * p));
    }
    if (closed) {
      v.back() = v.front();
      inverse_mass.back() = 0;  // the image has no mass of its own
    } else {
      inverse_mass.front() = 0;  // held
      v.front().setZero();
    }
    for (int s = 0; s < bars; ++s) {
      const double angle = 0.25 * s;
      tangent.emplace_back(std::cos(angle), std::sin(angle), 0);
      rest_length.push_back(1e-3 * (1 + 0.1 * (s % 2)));
      length.push_back(rest_length.back() * (1 + 1e-3));
      inverse_length.push_back(1 / length.back());
    }
  }
  [[nodiscard]] weave::BarChain view() const {
    return {closed, stiffness, 1e-4, tangent, length, rest_length, inverse_length, inverse_mass, v};
  }
  [[nodiscard]] int own(int p) const { return closed && p == bars ? 0 : p; }

  static constexpr int bars = 7;
  static constexpr double stiffness = 5e3;
  bool closed;
  std::vector<double> inverse_mass, rest_length, length, inverse_length;
  std::vector<Vec3> v, tangent;
};

class BarTensionsTest : public testing::TestWithParam<bool> {};

}  // namespace

// The tridiagonal solve, with its corner where the chain is closed, against a dense one of (1/(dt h k) + J M^-1 J^T) lambda = rhs.
TEST_P(BarTensionsTest, AreThoseOfADenseSolve) {
  const Chain c(GetParam());
  const double dt = 1e-6, kick = 0.9e-6;
  const int n = Chain::bars;
  Eigen::MatrixXd j = Eigen::MatrixXd::Zero(n, 3 * (n + 1));
  Eigen::VectorXd inverse_mass(3 * (n + 1)), v(3 * (n + 1)), right(n);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int p = 0; p <= n; ++p) {
    inverse_mass.segment<3>(3 * p).setConstant(c.inverse_mass[p]);
    v.segment<3>(3 * p) = c.v[p];
  }
  for (int s = 0; s < n; ++s) {
    j.block<1, 3>(s, 3 * s) -= c.tangent[s].transpose();
    j.block<1, 3>(s, 3 * c.own(s + 1)) += c.tangent[s].transpose();
    const Vec3 u = c.v[s + 1] - c.v[s];
    const double rate = u.dot(c.tangent[s]);
    right[s] = rate + (c.length[s] - c.rest_length[s]) / dt + 0.5 * dt * (u.squaredNorm() - rate * rate) / c.length[s];
    a(s, s) = c.rest_length[s] / (dt * kick * Chain::stiffness);
  }
  a += j * inverse_mass.asDiagonal() * j.transpose();
  const Eigen::VectorXd lambda = a.ldlt().solve(right);
  ASSERT_GT(lambda.minCoeff(), 0) << "the chain is meant to be taut";

  std::vector<Vec3> change(n + 1, Vec3::Zero());
  std::vector<double> tension(n);
  weave::BarTensions(n + 1).pull(c.view(), dt, kick, change, tension);
  const Eigen::VectorXd after = -(inverse_mass.asDiagonal() * (j.transpose() * lambda));
  for (int s = 0; s < n; ++s) EXPECT_NEAR(tension[s] * kick, lambda[s], 1e-12 * lambda.maxCoeff()) << s;
  for (int p = 0; p < n; ++p) EXPECT_LT((change[p] - after.segment<3>(3 * p)).norm(), 1e-12 * after.norm()) << p;
  if (c.closed) {
    EXPECT_EQ(change[n], change[0]);
  } else {
    EXPECT_EQ(change[0], Vec3(Vec3::Zero()));
  }
}

INSTANTIATE_TEST_SUITE_P(OpenAndClosed, BarTensionsTest, testing::Bool());
