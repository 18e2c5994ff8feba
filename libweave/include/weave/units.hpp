#pragma once
#include <string>
#include <string_view>

namespace weave {

/// What a quantity of a case measures.
enum class Dimension {
  number,             ///< dimensionless
  length,             ///< [m]
  per_length,         ///< [1/m]
  linear_density,     ///< [kg/m]
  density,            ///< [kg/m^3]
  pressure,           ///< also a modulus [Pa]
  force,              ///< [N]
  bending_stiffness,  ///< [N m^2]
  speed,              ///< [m/s]
  time,               ///< [s]
  per_time,           ///< [1/s]
};

/// SI value of a quantity written as number and unit: "3 N", "17.78 mm", "8.5 1/in", "86.9 GPa", "66.7 tex", "600 denier". Linear density
/// may be given as "yield", yards per pound: 125 yield = 0.45359237/(125 * 0.9144) kg/m.
/// Throws std::invalid_argument saying what was expected when the number, the unit or its dimension is wrong, or the value is not finite.
double parse_quantity(std::string_view text, Dimension expected);

/// SI unit of a dimension, e.g. "kg/m"; empty for a number.
std::string_view si_unit(Dimension dimension);

/// What a dimension expects of the user, e.g. "a length (m, mm, um, cm, in, ft, yd)".
std::string describe(Dimension dimension);

}  // namespace weave
