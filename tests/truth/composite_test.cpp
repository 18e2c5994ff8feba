#include "relax/composite.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "scenes/yarn_surfaces.hpp"

namespace relax {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

const TransverseIsotropic carbon{225e9, 15e9, 15e9, 0.2, 1.0 / 14};

Constituents constituents(const TransverseIsotropic& fiber, Micromechanics rule) {
  return {"fiber", "epoxy", fiber, 3.5e9, 0.35, rule};
}

/// Whether two materials' constants agree to a share of 1e-12: round-off of a few operations.
void expect_same(const TransverseIsotropic& a, const TransverseIsotropic& b) {
  EXPECT_NEAR(a.e1 / b.e1, 1, 1e-12);
  EXPECT_NEAR(a.e2 / b.e2, 1, 1e-12);
  EXPECT_NEAR(a.g12 / b.g12, 1, 1e-12);
  EXPECT_NEAR(a.nu12 / b.nu12, 1, 1e-12);
  EXPECT_NEAR(a.nu23 / b.nu23, 1, 1e-11);
}

TEST(Composite, OneMaterialStaysItself) {
  const TransverseIsotropic epoxy = isotropic(3.5e9, 0.35);
  for (const Micromechanics rule : {Micromechanics::chamis, Micromechanics::mori_tanaka})
    for (const double fraction : {0.0, 0.3, 0.9}) expect_same(impregnated_yarn(constituents(epoxy, rule), fraction), epoxy);
}

TEST(Composite, EndsOfTheFraction) {
  for (const Micromechanics rule : {Micromechanics::chamis, Micromechanics::mori_tanaka}) {
    expect_same(impregnated_yarn(constituents(carbon, rule), 0), isotropic(3.5e9, 0.35));
    expect_same(impregnated_yarn(constituents(carbon, rule), 1), carbon);
  }
}

// Hill's connections (J. Mech. Phys. Solids 12 (1964) 199) hold for any composite of aligned fibers that is transversely isotropic.
TEST(Composite, MoriTanakaKeepsHillsConnections) {
  const double fraction = 0.6;
  const auto moduli = [](const TransverseIsotropic& m) {
    const Matrix6 c = stiffness(m, Vec3::UnitX());
    return Vec3(0.5 * (c(1, 1) + c(1, 2)), c(0, 1), c(0, 0));  // k, l, n
  };
  const Vec3 f = moduli(carbon), m = moduli(isotropic(3.5e9, 0.35)),
             c = moduli(impregnated_yarn(constituents(carbon, Micromechanics::mori_tanaka), fraction));
  const double slope = (f[0] - m[0]) / (f[1] - m[1]);
  EXPECT_NEAR((c[0] - m[0]) / (c[1] - m[1]), slope, 1e-9 * std::abs(slope));
  EXPECT_NEAR((c[1] - fraction * f[1] - (1 - fraction) * m[1]) / (c[2] - fraction * f[2] - (1 - fraction) * m[2]), slope,
              1e-6 * std::abs(slope));
}

// c_ijkl n_i m_j n_k m_l of the rotated material, against the tensor of the five constants (Spencer 1972) written out.
TEST(Composite, StiffnessTurnsAsATensor) {
  const Matrix6 c = stiffness(carbon, Vec3::UnitX());
  const double lambda = c(1, 2), mu_t = c(3, 3), mu_l = c(5, 5), alpha = c(0, 1) - lambda,
               beta = c(0, 0) - lambda - 2 * alpha - 4 * mu_l + 2 * mu_t;
  const Vec3 a = Vec3(0.8, 0.5, -0.33).normalized();
  const Matrix6 turned = stiffness(carbon, a);
  const auto delta = [](int i, int j) { return i == j ? 1.0 : 0.0; };
  constexpr int pair[6][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) {
      const int i = pair[row][0], j = pair[row][1], k = pair[column][0], l = pair[column][1];
      const double value =
          lambda * delta(i, j) * delta(k, l) + mu_t * (delta(i, k) * delta(j, l) + delta(i, l) * delta(j, k)) +
          alpha * (delta(i, j) * a[k] * a[l] + delta(k, l) * a[i] * a[j]) +
          (mu_l - mu_t) * (a[i] * a[k] * delta(j, l) + a[i] * a[l] * delta(j, k) + a[j] * a[k] * delta(i, l) + a[j] * a[l] * delta(i, k)) +
          beta * a[i] * a[j] * a[k] * a[l];
      EXPECT_NEAR(turned(row, column), value, 1e-12 * c(0, 0)) << row << ", " << column;
    }
}

TEST(Composite, EngineeringConstantsOfAKnownMaterial) {
  const EngineeringConstants c = engineering_constants(stiffness(carbon, Vec3::UnitX()));
  EXPECT_NEAR(c.ex, 225e9, 1);
  EXPECT_NEAR(c.ez, 15e9, 1);
  EXPECT_NEAR(c.gxz, 15e9, 1);
  EXPECT_NEAR(c.gyz, 7e9, 1);
  EXPECT_NEAR(c.nu_xy, 0.2, 1e-12);
  EXPECT_NEAR(c.nu_yz, 1.0 / 14, 1e-12);
  const EngineeringConstants plane = plane_engineering_constants(plane_stress_stiffness(stiffness(carbon, Vec3::UnitX())));
  EXPECT_NEAR(plane.ex, 225e9, 1);
  EXPECT_NEAR(plane.ey, 15e9, 1);
  EXPECT_NEAR(plane.gxy, 15e9, 1);
  EXPECT_NEAR(plane.nu_xy, 0.2, 1e-12);
}

TEST(Composite, BinsAndBounds) {
  VolumeMesh mesh = scenes::yarn_block({4, 4, 4}, Vec3::Ones(), Vec3::UnitX(), 0);
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    mesh.volume_fraction[i] = 0.4 + 0.3 * static_cast<double>(i) / 63;
    if (i % 4 == 3) mesh.yarn[i] = -1;
    if (i % 4 == 1) mesh.direction[i] = Vec3::UnitY();
  }
  const Constituents c = constituents(carbon, Micromechanics::chamis);
  const MaterialBins bins = bin_materials(mesh, c, 5);
  ASSERT_EQ(bins.material.size(), 5U);
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    if (mesh.yarn[i] < 0) {
      EXPECT_EQ(bins.bin[i], -1);
    } else {
      EXPECT_LE(std::abs(bins.volume_fraction[static_cast<std::size_t>(bins.bin[i])] - mesh.volume_fraction[i]), bins.width);
    }
  }
  const StiffnessBounds bounds = stiffness_bounds(mesh, c, bins);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(bounds.voigt - bounds.reuss).eigenvalues().minCoeff(), 0);

  mesh.volume_fraction[0] = 0.95;
  EXPECT_EQ(bin_materials(mesh, c, 5).capped, 1U);
  EXPECT_THAT([&] { bin_materials(mesh, c, 0); }, ThrowsMessage<std::invalid_argument>(HasSubstr("at least 1")));
  Constituents bad = c;
  bad.matrix_nu = 0.5;
  EXPECT_THAT([&] { bin_materials(mesh, bad, 5); }, ThrowsMessage<std::invalid_argument>(HasSubstr("matrix epoxy: nu12")));
}

}  // namespace
}  // namespace relax
