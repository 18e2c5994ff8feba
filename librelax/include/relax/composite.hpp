#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "relax/volume_mesh.hpp"
#include "weave/material.hpp"

namespace relax {

/// Stiffness or compliance in Voigt's order xx, yy, zz, yz, xz, xy, with engineering shear strains.
using Matrix6 = Eigen::Matrix<double, 6, 6>;

using weave::check_constants;
using weave::isotropic;
using weave::TransverseIsotropic;

/// Stiffness with axis 1 along the unit vector `axis` [Pa].
Matrix6 stiffness(const TransverseIsotropic& material, const Vec3& axis);

enum class Micromechanics {
  chamis,       ///< C. C. Chamis, NASA TM-83320 (1983)
  mori_tanaka,  ///< for aligned round fibers; the composite cylinders of Z. Hashin, J. Appl. Mech. 46 (1979) 543, with his bound of G23 on
                ///< the matrix's side
};

struct Constituents {
  std::string fiber_name, matrix_name;
  TransverseIsotropic fiber;
  double matrix_e = 0, matrix_nu = 0;  ///< [Pa]
  Micromechanics rule = Micromechanics::chamis;
};

/// Constants of a yarn with aligned fibers at the local volume fraction, 0...1.
TransverseIsotropic impregnated_yarn(const Constituents& constituents, double volume_fraction);

/// Materials of a mesh's elements: the matrix, and yarn at a few volume fractions.
struct MaterialBins {
  double width = 0;                           ///< of a bin of local volume fraction
  std::vector<double> volume_fraction;        ///< mean over the bin's elements; empty bins are left out
  std::vector<TransverseIsotropic> material;  ///< of yarn at that fraction
  std::vector<std::int32_t> bin;              ///< per element; -1: matrix
  std::size_t capped = 0;                     ///< elements whose fraction was above `largest_volume_fraction`
};

/// Above it the rules of micromechanics mean nothing: round fibers touch at pi/(2 sqrt 3) = 0.907 at the latest.
inline constexpr double largest_volume_fraction = 0.9;

/// Bins of equal width from the least to the largest local volume fraction. Throws std::invalid_argument for fewer than one bin, or
/// constants that are not those of a material.
MaterialBins bin_materials(const VolumeMesh& mesh, const Constituents& constituents, int bins);

/// Mean stiffness of the elements (Voigt 1889) and the inverse of their mean compliance (Reuss 1929): upper and lower bounds, in the sense
/// of the strain energy (Hill 1952), of the stiffness of the periodic cell [Pa].
struct StiffnessBounds {
  Matrix6 voigt, reuss;
};
StiffnessBounds stiffness_bounds(const VolumeMesh& mesh, const Constituents& constituents, const MaterialBins& bins);

/// A layer of a laminate.
struct Layer {
  Matrix6 stiffness;  ///< in the laminate's axes [Pa]
  double share = 0;   ///< of the thickness
};

/// Stiffness of layers stacked along z: strains in the plane and stresses out of it are the same in all of them (Postma 1955) [Pa].
Matrix6 laminate_stiffness(const std::vector<Layer>& layers);

/// Estimate of a woven cell's stiffness that leaves out the crimp: three layers, the matrix, all warps along x and all wefts along y, as
/// thick as the volume of their elements is, the yarns at the mean of their local volume fraction [Pa].
Matrix6 laminate_stiffness(const VolumeMesh& mesh, const Constituents& constituents);

/// Engineering constants along the cell's axes; those out of the plane are 0 where only the plane's are known.
struct EngineeringConstants {
  double ex = 0, ey = 0, ez = 0, gxy = 0, gyz = 0, gxz = 0;  ///< [Pa]
  double nu_xy = 0, nu_xz = 0, nu_yz = 0;                    ///< nu_xy: - strain y / strain x under a stress along x
};
EngineeringConstants engineering_constants(const Matrix6& stiffness);

/// Of a layer in plane stress, of whose stiffness only the rows and columns of xx, yy and xy count.
EngineeringConstants plane_engineering_constants(const Matrix6& plane_stiffness);

/// Stiffness of a layer in plane stress: that of the rows and columns of xx, yy and xy where the stresses zz, yz, xz vanish; others are 0
/// [Pa].
Matrix6 plane_stress_stiffness(const Matrix6& stiffness);

}  // namespace relax
