#include "weave/units.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace weave {
namespace {

constexpr double inch = 0.0254, foot = 0.3048, yard = 0.9144, pound = 0.45359237, standard_gravity = 9.80665;
constexpr double pound_force = pound * standard_gravity;

struct Unit {
  std::string_view name;
  Dimension dimension;
  double multiply;       // to SI
  double divide = 1;     // powers of ten below one are divided by, so that "17.78 mm" rounds once
  bool inverse = false;  // SI value = multiply / (number * divide)
};

// The first of each dimension is the SI unit.
constexpr std::array units = {
    Unit{"m", Dimension::length, 1},
    Unit{"mm", Dimension::length, 1, 1e3},
    Unit{"um", Dimension::length, 1, 1e6},
    Unit{"cm", Dimension::length, 1, 1e2},
    Unit{"in", Dimension::length, inch},
    Unit{"ft", Dimension::length, foot},
    Unit{"yd", Dimension::length, yard},
    Unit{"1/m", Dimension::per_length, 1},
    Unit{"1/mm", Dimension::per_length, 1e3},
    Unit{"1/cm", Dimension::per_length, 1e2},
    Unit{"1/in", Dimension::per_length, 1, inch},
    Unit{"kg/m", Dimension::linear_density, 1},
    Unit{"g/m", Dimension::linear_density, 1, 1e3},
    Unit{"tex", Dimension::linear_density, 1, 1e6},
    Unit{"dtex", Dimension::linear_density, 1, 1e7},
    Unit{"denier", Dimension::linear_density, 1, 9e6},
    Unit{"yield", Dimension::linear_density, pound, yard, true},
    Unit{"kg/m^3", Dimension::density, 1},
    Unit{"g/cm^3", Dimension::density, 1e3},
    Unit{"Pa", Dimension::pressure, 1},
    Unit{"kPa", Dimension::pressure, 1e3},
    Unit{"MPa", Dimension::pressure, 1e6},
    Unit{"GPa", Dimension::pressure, 1e9},
    Unit{"psi", Dimension::pressure, pound_force, inch* inch},
    Unit{"N", Dimension::force, 1},
    Unit{"mN", Dimension::force, 1, 1e3},
    Unit{"cN", Dimension::force, 1, 1e2},
    Unit{"kN", Dimension::force, 1e3},
    Unit{"gf", Dimension::force, standard_gravity, 1e3},
    Unit{"lbf", Dimension::force, pound_force},
    Unit{"N m^2", Dimension::bending_stiffness, 1},
    Unit{"N mm^2", Dimension::bending_stiffness, 1, 1e6},
    Unit{"m/s", Dimension::speed, 1},
    Unit{"mm/s", Dimension::speed, 1, 1e3},
    Unit{"in/s", Dimension::speed, inch},
    Unit{"s", Dimension::time, 1},
    Unit{"ms", Dimension::time, 1, 1e3},
    Unit{"us", Dimension::time, 1, 1e6},
    Unit{"min", Dimension::time, 60},
    Unit{"1/s", Dimension::per_time, 1},
    Unit{"1/ms", Dimension::per_time, 1e3},
};

std::string_view name_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::number:
      return "a number";
    case Dimension::length:
      return "a length";
    case Dimension::per_length:
      return "a number per length";
    case Dimension::linear_density:
      return "a linear density";
    case Dimension::density:
      return "a density";
    case Dimension::pressure:
      return "a pressure or modulus";
    case Dimension::force:
      return "a force";
    case Dimension::bending_stiffness:
      return "a bending stiffness";
    case Dimension::speed:
      return "a speed";
    case Dimension::time:
      return "a time";
    case Dimension::per_time:
      return "a number per time";
  }
  return "a quantity";
}

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

std::string_view si_unit(Dimension dimension) {
  for (const Unit& unit : units) {
    if (unit.dimension == dimension) return unit.name;
  }
  return "";
}

std::string describe(Dimension dimension) {
  std::string names;
  for (const Unit& unit : units) {
    if (unit.dimension == dimension) names += fmt::format("{}{}", names.empty() ? "" : ", ", unit.name);
  }
  return names.empty() ? std::string(name_of(dimension)) : fmt::format("{} ({})", name_of(dimension), names);
}

double parse_quantity(std::string_view text, Dimension expected) {
  const auto fail = [&](std::string_view what) { throw std::invalid_argument(fmt::format("{}; expected {}", what, describe(expected))); };
  std::string_view rest = trimmed(text);
  if (rest.starts_with('+')) rest.remove_prefix(1);
  // from_chars also reads "inf" and "nan", which no quantity may be.
  if (rest.empty() || rest.find_first_of("0123456789") > rest.find_first_not_of("-.")) fail("does not begin with a number");
  double number = 0;
  const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (status == std::errc::result_out_of_range) fail("number out of the range of double precision");
  if (status != std::errc()) fail("does not begin with a number");
  const std::string_view name = trimmed(rest.substr(static_cast<std::size_t>(end - rest.data())));
  if (name.empty()) {
    if (expected != Dimension::number) fail("has no unit");
    return number;
  }
  for (const Unit& unit : units) {
    if (unit.name != name) continue;
    if (unit.dimension != expected) fail(fmt::format("is {}", name_of(unit.dimension)));
    const double value = unit.inverse ? unit.multiply / (number * unit.divide) : number * unit.multiply / unit.divide;
    if (!std::isfinite(value)) fail("is not finite");
    return value;
  }
  fail(fmt::format("unknown unit \"{}\"", name));
  return 0;
}

}  // namespace weave
