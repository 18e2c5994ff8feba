#pragma once
#include <array>
#include <string>
#include <vector>

#include "heddle/homogenize_command.hpp"
#include "relax/homogenize.hpp"

namespace heddle {

/// An engineering constant by its key in a summary and its name to read.
struct NamedConstant {
  const char *name, *label;
  double relax::EngineeringConstants::*value;
  bool modulus, in_plane;
};
inline constexpr std::array<NamedConstant, 9> engineering_constants_named = {{
    {"ex_Pa", "Ex", &relax::EngineeringConstants::ex, true, true},
    {"ey_Pa", "Ey", &relax::EngineeringConstants::ey, true, true},
    {"ez_Pa", "Ez", &relax::EngineeringConstants::ez, true, false},
    {"gxy_Pa", "Gxy", &relax::EngineeringConstants::gxy, true, true},
    {"gyz_Pa", "Gyz", &relax::EngineeringConstants::gyz, true, false},
    {"gxz_Pa", "Gxz", &relax::EngineeringConstants::gxz, true, false},
    {"nu_xy", "nu_xy", &relax::EngineeringConstants::nu_xy, false, true},
    {"nu_xz", "nu_xz", &relax::EngineeringConstants::nu_xz, false, false},
    {"nu_yz", "nu_yz", &relax::EngineeringConstants::nu_yz, false, false},
}};

/// A mesh, and what CalculiX makes of it.
struct SolvedCell {
  MeshedCell cell;
  relax::Homogenization result;
  double mesh_wall = 0;  ///< [s]
};

/// Constants of a stiffness, of the layer in plane stress where the sides normal to z are free.
relax::EngineeringConstants constants_of(const relax::Matrix6& stiffness, const HomogenizeCommandOptions& options);

/// What a stiffness is set beside.
struct Estimate {
  const char *name, *label;
  relax::Matrix6 stiffness;  ///< in the sense of constants_of [Pa]
  bool bound;                ///< of moduli; no Poisson's ratio
};
/// The bounds with the laminate between them; with free sides Reuss' is none of the layer's moduli in plane stress.
std::vector<Estimate> estimates_of(const relax::Homogenization& result, const HomogenizeCommandOptions& options);
/// Change of the stiffness from the fine to the coarse mesh, over its norm.
double mesh_error(const SolvedCell& fine, const SolvedCell& coarse);

/// The summary as JSON text, keys with units. coarse: the same on a coarser mesh; null: not solved. Wall times in s.
std::string homogenize_summary(const CompositeInput& input, const relax::Constituents& constituents,
                               const HomogenizeCommandOptions& options, const SolvedCell& fine, const SolvedCell* coarse, double read_wall,
                               double wall);

}  // namespace heddle
