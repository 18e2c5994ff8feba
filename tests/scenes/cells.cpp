#include "scenes/cells.hpp"

#include <fmt/format.h>

#include "relax/topology_start.hpp"

namespace scenes {

using weave::Vec3;

weave::Case plain_weave(const PlainWeave& w) {
  // Fibers of 0.1 mm in diameter, filaments filling 0.82 of it.
  const double linear_density = 2000 * w.fibers * 0.82 * 7.853981633974483e-9;
  std::string sections;
  const int warps = 2 * w.repeat_y, columns = 2 * w.repeat_x;
  for (int i = 0; i < warps; ++i) {
    std::string rows;
    for (int k = 0; k < columns; ++k) rows += fmt::format("{}\"{}\"", k ? ", " : "", (i + k) % 2 ? "-" : "+");
    sections += fmt::format("[[section]]\nyarn = \"y\"\ndent = {}\nmatrix = [{}]\n", i, rows);
  }
  const std::string text =
      fmt::format(R"(name = "plain"
title = "plain weave"
[fabric]
layers = 1
columns = {}
cells = 1
[yarns.y]
linear_density = "{:.17g} kg/m"
density = "2000 kg/m^3"
youngs_modulus = "{:.17g} Pa"
transverse_modulus = "{:.17g} Pa"
fibers = {}
{}
[weft]
yarn = "y"
[loom]
length = "20 mm"
height_ratio = 0.7
dent_width = "{:.17g} m"
tension = "1 N"
reed_bar_radius = "0.02 mm"
[beat_up]
top_speed = "4 m/s"
[shedding]
time = "2 ms"
[take_up]
length = "{:.17g} m"
)",
                  columns, linear_density, w.youngs_modulus, w.transverse_modulus, w.fibers, sections, w.pitch, w.pitch);
  return weave::parse_case(text, "plain_weave");
}

PosedCell plain_weave_cell(const PlainWeave& weave, double tension, double element_length) {
  auto [cell, x] = relax::cell_from_topology(plain_weave(weave), {tension, tension, element_length});
  return {std::move(cell), std::move(x)};
}

relax::Cell empty_cell(double length_x, double length_y, double youngs_modulus, double transverse_modulus) {
  relax::Cell cell;
  cell.length_x = length_x;
  cell.length_y = length_y;
  cell.types.push_back({5e-5, 0.82 * 7.853981633974483e-9, youngs_modulus, 1e-4, transverse_modulus, 2000, 0});
  relax::finish_types(cell);
  return cell;
}

relax::CellFiber straight_fiber(const relax::Cell& cell, bool weft, const Vec3& through, int nodes, int yarn, double tension) {
  relax::CellFiber fiber;
  fiber.weft = weft;
  fiber.yarn = yarn;
  fiber.tension = tension;
  const Vec3 step = (weft ? Vec3(0, cell.length_y, 0) : Vec3(cell.length_x, 0, 0)) / nodes;
  for (int k = 0; k < nodes; ++k) fiber.x.push_back(through + k * step);
  fiber.rest_length.assign(static_cast<std::size_t>(nodes), step.norm());
  return fiber;
}

void shake(Eigen::VectorXd& q, double size, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  for (double& u : q) u += size * normal(random);
}

}  // namespace scenes
