#include "relax/homogenize.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>

#include "scenes/with_calculix.hpp"
#include "scenes/yarn_surfaces.hpp"
#include "weave/results.hpp"

namespace relax {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

// CalculiX prints the compliance with seven digits. Its inverse loses the more of them the worse its condition, which off the fibers' axis
// is near 100.
constexpr double printed = 1e-6, inverted = 5e-6;

const TransverseIsotropic aramid_like{120e9, 6e9, 3e9, 0.35, 0.4};

Constituents constituents() {
  return {"fiber", "epoxy", aramid_like, 3.5e9, 0.35, Micromechanics::chamis};
}

class Homogenize : public WithCalculix {
 protected:
  Homogenization solve(const VolumeMesh& mesh, const Constituents& c, bool periodic_z = true) {
    HomogenizeOptions options;
    options.periodic_z = periodic_z;
    const Homogenization result = homogenize(mesh, c, options, folder, "cell");
    expect_no_complaint("cell.log");
    return result;
  }
  /// CalculiX ends well also after warnings, as of sets or orientations that it does not use.
  void expect_no_complaint(const std::string& log) const {
    std::ifstream stream(folder / log);
    ASSERT_TRUE(stream);
    for (std::string line; std::getline(stream, line);)
      EXPECT_TRUE(line.find("*WARNING") == std::string::npos && line.find("*ERROR") == std::string::npos) << log << ": " << line;
  }
  static void expect_near(const Matrix6& value, const Matrix6& truth, double share) {
    EXPECT_LT((value - truth).cwiseAbs().maxCoeff(), share * truth.cwiseAbs().maxCoeff()) << value << "\n\nbut should be\n" << truth;
  }
};

/// Cell with a square yarn along x of half its height and width, its material that of the local fraction 0.6.
VolumeMesh square_yarn(const std::array<int, 3>& voxels) {
  VolumeMesh mesh = scenes::yarn_block(voxels, {1e-3, 1e-3, 1e-3}, Vec3::UnitX(), 0.6);
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const Vec3 center = 1e3 * mesh.center(i);
    if (std::abs(center.y() - 0.5) > 0.25 || std::abs(center.z() - 0.5) > 0.25) mesh.yarn[i] = -1;
  }
  return mesh;
}

TEST_F(Homogenize, OneMaterialGivesItselfBack) {
  Constituents c = constituents();
  c.fiber = isotropic(c.matrix_e, c.matrix_nu);
  const Homogenization r = solve(square_yarn({4, 4, 4}), c);
  const Matrix6 truth = stiffness(c.fiber, Vec3::UnitX());
  expect_near(r.stiffness, truth, printed);
  expect_near(r.bounds.voigt, truth, 1e-12);
  expect_near(r.bounds.reuss, truth, 1e-12);
  EXPECT_LT(r.asymmetry, printed);
}

// Axis 1 of the orientations must be the fibers', and turn as theirs does.
TEST_F(Homogenize, OffAxisFibers) {
  const double c30 = std::cos(std::numbers::pi / 6), s30 = 0.5;
  for (const Vec3& axis : {Vec3(c30, s30, 0), Vec3(c30, 0, s30), Vec3(0.3, 0.8, -0.52).normalized()}) {
    const Homogenization r = solve(scenes::yarn_block({2, 2, 2}, {1.5e-3, 1e-3, 0.3e-3}, axis, 0.6), constituents());
    expect_near(r.stiffness, stiffness(impregnated_yarn(constituents(), 0.6), axis), inverted);
  }
}

/// Tetrahedra of a straight yarn along x in matrix, its material that of the local fraction 0.6.
VolumeMesh straight_yarn_of_tetrahedra() {
  constexpr double mm = 1e-3;
  const scenes::YarnPath straight = [](double) { return Eigen::Vector2d(0.5 * mm, 0); };
  const YarnEnvelope yarn = scenes::envelope(0, false, scenes::tube_surface({0, 0, 1 * mm, 0.3 * mm, 0.2 * mm, 6, 12}, straight));
  const weave::Snapshot fibers =
      scenes::one_yarn(1 * mm, 1 * mm, false, straight, scenes::grid_offsets(0.4 * mm, 0.2 * mm, 2, 2), 0.05 * mm, 0.01 * mm * mm, 8);
  VolumeMesh mesh = tet_mesh(fibers, {yarn}, {.resin_margin = 0.1 * mm}).mesh;
  std::fill(mesh.volume_fraction.begin(), mesh.volume_fraction.end(), 0.6);
  return mesh;
}

TEST_F(Homogenize, TetrahedraOfOneMaterialGiveItBack) {
  Constituents c = constituents();
  c.fiber = isotropic(c.matrix_e, c.matrix_nu);
  const VolumeMesh corners = straight_yarn_of_tetrahedra();
  for (const VolumeMesh& mesh : {corners, with_middle_nodes(corners)}) {
    const Homogenization r = solve(mesh, c);
    expect_near(r.stiffness, stiffness(c.fiber, Vec3::UnitX()), printed);
    expect_near(r.bounds.voigt, stiffness(c.fiber, Vec3::UnitX()), 1e-12);
  }
}

// Where the two parts contract alike, a pull along the yarn leaves them in uniaxial stress: the rule of mixtures holds exactly.
TEST_F(Homogenize, TetrahedraOfAStraightYarnFollowTheRuleOfMixtures) {
  Constituents c = constituents();
  c.fiber.nu12 = c.matrix_nu;
  const VolumeMesh corners = straight_yarn_of_tetrahedra();
  double yarn = 0;
  for (std::size_t i = 0; i < corners.elements(); ++i)
    if (corners.yarn[i] == 0) yarn += corners.volume(i);
  yarn /= (corners.high - corners.low).prod();
  const double truth = yarn * impregnated_yarn(c, 0.6).e1 + (1 - yarn) * c.matrix_e;
  for (const VolumeMesh& mesh : {corners, with_middle_nodes(corners)})
    EXPECT_NEAR(engineering_constants(solve(mesh, c).stiffness).ex, truth, inverted * truth);
}

// Slabs: strains in the plane and stresses out of it are the same in all layers, so that the cell's stiffness is that of averages (Postma
// 1955).
TEST_F(Homogenize, LayersAreALaminate) {
  VolumeMesh mesh = scenes::yarn_block({2, 2, 4}, {1.5e-3, 1e-3, 0.4e-3}, Vec3::UnitX(), 0.7);
  const Vec3 oblique = Vec3(std::cos(0.5), std::sin(0.5), 0);
  const std::vector<Layer> layers = {{stiffness(impregnated_yarn(constituents(), 0.7), Vec3::UnitX()), 0.25},
                                     {stiffness(isotropic(3.5e9, 0.35), Vec3::UnitX()), 0.25},
                                     {stiffness(impregnated_yarn(constituents(), 0.7), Vec3::UnitY()), 0.25},
                                     {stiffness(impregnated_yarn(constituents(), 0.5), oblique), 0.25}};
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const std::size_t layer = i / 4;
    if (layer == 1) mesh.yarn[i] = -1;
    if (layer == 2) mesh.direction[i] = Vec3::UnitY();
    if (layer == 3) {
      mesh.direction[i] = oblique;
      mesh.volume_fraction[i] = 0.5;
    }
  }
  expect_near(solve(mesh, constituents()).stiffness, laminate_stiffness(layers), printed);
}

// Straight warps under straight wefts are the laminate that the estimate takes a woven cell for, whatever lies above them.
TEST_F(Homogenize, StraightYarnsAreTheLaminateEstimate) {
  VolumeMesh mesh = scenes::yarn_block({2, 2, 5}, {1.5e-3, 1e-3, 0.5e-3}, Vec3::UnitX(), 0.7);
  mesh.yarns = {0, 1};
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const std::size_t layer = i / 4;
    if (layer >= 3) mesh.yarn[i] = -1;
    if (layer != 2) continue;
    mesh.yarn[i] = 1;
    mesh.direction[i] = mesh.yarn_tangent[i] = Vec3::UnitY();
    mesh.volume_fraction[i] = 0.5;
  }
  const Homogenization r = solve(mesh, constituents());
  expect_near(r.stiffness, r.laminate, printed);
}

// Top and bottom free: plane stress.
TEST_F(Homogenize, FreeSidesArePlaneStress) {
  const Vec3 axis = Vec3(0.8, 0.6, 0);
  const Homogenization r = solve(scenes::yarn_block({2, 2, 2}, {1e-3, 1e-3, 0.2e-3}, axis, 0.6), constituents(), false);
  expect_near(r.stiffness, plane_stress_stiffness(stiffness(impregnated_yarn(constituents(), 0.6), axis)), inverted);
}

// Hill's connections (J. Mech. Phys. Solids 12 (1964) 199) need only that strains along the fibers and equal ones across can be superposed
// such that the strain is uniform: they hold for a square array, and for elements that can strain uniformly, on any mesh.
TEST_F(Homogenize, FibersAlongOneAxis) {
  const Homogenization r = solve(square_yarn({1, 4, 4}), constituents());
  const double fraction = 0.25;
  const auto moduli = [](const Matrix6& c) { return Vec3(0.5 * (c(1, 1) + c(1, 2)), c(0, 1), c(0, 0)); };
  const Vec3 f = moduli(stiffness(impregnated_yarn(constituents(), 0.6), Vec3::UnitX())),
             m = moduli(stiffness(isotropic(3.5e9, 0.35), Vec3::UnitX())), c = moduli(r.stiffness);
  const double slope = (f[1] - m[1]) / (f[0] - m[0]);
  EXPECT_NEAR(c[1], m[1] + slope * (c[0] - m[0]), printed * c[2]);
  EXPECT_NEAR(c[2], fraction * f[2] + (1 - fraction) * m[2] + slope * (c[1] - fraction * f[1] - (1 - fraction) * m[1]), printed * c[2]);
  EXPECT_NEAR(r.stiffness(1, 1), r.stiffness(2, 2), printed * c[2]);
  // Bounds hold for the strain energy of every strain.
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(r.bounds.voigt - r.stiffness).eigenvalues().minCoeff(), -printed * c[2]);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6>(r.stiffness - r.bounds.reuss).eigenvalues().minCoeff(), -printed * c[2]);
  EXPECT_LT(r.stiffness(1, 1), 0.999 * r.bounds.voigt(1, 1));
  EXPECT_GT(r.stiffness(1, 1), 1.001 * r.bounds.reuss(1, 1));
}

// Opposite faces pull with opposite forces, in every load case.
TEST_F(Homogenize, OppositeFacesAreInEquilibrium) {
  VolumeMesh mesh = square_yarn({3, 4, 4});
  for (std::size_t i = 0; i < mesh.elements(); ++i)
    if (mesh.yarn[i] >= 0 && i % 3 == 1) mesh.direction[i] = Vec3(0.9, 0.3, 0.2).normalized();
  const Constituents c = constituents();
  std::string text = deck(mesh, periodic_sets(mesh, true), c, bin_materials(mesh, c, 1), {});
  for (const char axis : {'X', 'Y', 'Z'}) {
    const std::string request = std::string("*NODE PRINT, NSET=HIGH_") + axis + ", TOTALS=ONLY\nRF\n";
    const std::string faces =
        std::string("*NODE PRINT, NSET=FACE_") + axis + "0, TOTALS=ONLY\nRF\n*NODE PRINT, NSET=FACE_" + axis + "1, TOTALS=ONLY\nRF\n";
    for (std::size_t at = 0; (at = text.find(request, at)) != std::string::npos; at += faces.size())
      text.replace(at, request.size(), faces);
  }
  weave::write_text_file(folder / "faces.inp", text);
  ASSERT_EQ(std::system(("cd '" + folder.string() + "' && ccx -i faces > faces.log 2>&1").c_str()), 0);
  expect_no_complaint("faces.log");
  std::ifstream stream(folder / "faces.dat");
  std::vector<Vec3> forces;
  for (std::string word; stream >> word;) {
    if (word != "time") continue;
    double time = 0;
    Vec3 f;
    ASSERT_TRUE(stream >> time >> f[0] >> f[1] >> f[2]);
    forces.push_back(f);
  }
  ASSERT_EQ(forces.size(), 36U);
  double largest = 0;
  for (const Vec3& f : forces) largest = std::max(largest, f.norm());
  for (std::size_t i = 0; i < forces.size(); i += 2) EXPECT_LT((forces[i] + forces[i + 1]).norm(), printed * largest);
}

TEST_F(Homogenize, AFailureIsNamed) {
  VolumeMesh mesh = square_yarn({2, 2, 2});
  std::swap(mesh.nodes[3 * 8], mesh.nodes[3 * 8 + 6]);
  EXPECT_THAT([&] { solve(mesh, constituents()); }, ThrowsMessage<std::runtime_error>(HasSubstr("cell.log")));
}

TEST(Ccx, MissingProgramIsNamed) {
  EXPECT_THAT([] { find_ccx("no_such_ccx"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("no_such_ccx: CalculiX is not there; install it (Debian: calculix-ccx)")));
  EXPECT_THAT([] { find_ccx("./no_such_ccx"); }, ThrowsMessage<std::runtime_error>(HasSubstr("CalculiX is not there")));
}

}  // namespace
}  // namespace relax
