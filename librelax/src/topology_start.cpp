#include "relax/topology_start.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "relax/energy.hpp"
#include "weave/loom.hpp"

namespace relax {
namespace {

constexpr double gap = 0.06;        ///< between fibers [diameters]
constexpr double no_limit = 1e300;  ///< on a yarn's width

/// Heights of weft layers and of warps between them.
struct Stack {
  std::vector<double> weft_z;               ///< per layer, top first [m]
  std::vector<std::vector<double>> warp_z;  ///< per warp and column [m]
};

double height_of(const weave::Case& c, const std::string& yarn) {
  const weave::YarnType& y = c.yarns.at(yarn);
  return weave::bundle_height(y.fibers, y.fiber_radius(), no_limit) * (1 + gap);
}

/// Between two layers is room for as many warps as one section has there in any column.
Stack stack_up(const weave::Case& c, const weave::PositionMatrix& positions) {
  const int layers = c.layers, columns = c.columns;
  double weft_height = 0;
  for (const std::string& name : c.weft.yarn_of_layer) weft_height = std::max(weft_height, height_of(c, name));
  // Rank of each warp among those of its section that pass a column on the same level, from below.
  const auto warps = static_cast<int>(positions.rows());
  Eigen::MatrixXi rank = Eigen::MatrixXi::Zero(warps, columns);
  std::vector<double> room(static_cast<std::size_t>(layers) + 1, 0);
  std::vector<double> height(static_cast<std::size_t>(warps));
  int first = 0;
  for (const weave::WarpSection& section : c.sections) {
    const auto count = static_cast<int>(section.matrix.cols());
    for (int w = first; w < first + count; ++w) height[static_cast<std::size_t>(w)] = height_of(c, section.yarn);
    for (int k = 0; k < columns; ++k) {
      std::vector<int> on_level(static_cast<std::size_t>(layers) + 1, 0);
      for (int w = first + count - 1; w >= first; --w) {  // warps are given top to bottom
        const auto level = static_cast<std::size_t>(positions(w, k));
        rank(w, k) = on_level[level]++;
        room[level] = std::max(room[level], on_level[level] * height[static_cast<std::size_t>(w)]);
      }
    }
    first += count;
  }
  Stack stack;
  std::vector<double> level_low(room.size());
  double z = 0;
  stack.weft_z.resize(static_cast<std::size_t>(layers));
  for (std::size_t level = 0; level < room.size(); ++level) {
    level_low[level] = z;
    z += room[level];
    if (level + 1 == room.size()) break;
    stack.weft_z[static_cast<std::size_t>(layers) - 1 - level] = z + 0.5 * weft_height;
    z += weft_height;
  }
  stack.warp_z.resize(static_cast<std::size_t>(warps));
  for (int w = 0; w < warps; ++w) {
    for (int k = 0; k < columns; ++k) {
      stack.warp_z[static_cast<std::size_t>(w)].push_back(level_low[static_cast<std::size_t>(positions(w, k))] +
                                                          (rank(w, k) + 0.5) * height[static_cast<std::size_t>(w)]);
    }
  }
  return stack;
}

/// Height of a warp at a share of the cell's length, columns in the middle of their parts: half a sine wave from column to column.
double warp_height(const std::vector<double>& z, double share) {
  const auto columns = static_cast<double>(z.size());
  const double at = share * columns - 0.5 + columns;
  const auto before = static_cast<std::size_t>(at);
  const double u = at - static_cast<double>(before);
  const double a = z[before % z.size()], b = z[(before + 1) % z.size()];
  return a + (b - a) * 0.5 * (1 - std::cos(std::numbers::pi * u));
}

}  // namespace

std::pair<Cell, std::vector<Vec3>> cell_from_topology(const weave::Case& c, const TopologyOptions& options) {
  if (!(options.warp_tension >= 0 && options.weft_tension >= 0))
    throw std::invalid_argument("a start from topology needs tensions >= 0 for warp and weft");
  const auto positions = weave::positions_from_weaving_matrix(c.matrix(), c.layers, c.insertion_order);
  if (!positions) throw std::invalid_argument("a start from topology needs a weaving matrix that warp positions describe");
  const weave::LoomLayout layout = weave::lay_out(c);
  const Stack stack = stack_up(c, *positions);
  Cell cell;
  cell.length_x = c.cell_length();
  cell.length_y = c.cell_width();
  for (const std::string& name : layout.type_names) {
    const weave::YarnType& y = c.yarns.at(name);
    cell.types.push_back({y.fiber_radius(), y.fiber_area(), y.youngs_modulus, y.compression_factor, y.transverse_modulus, y.density,
                          y.bending_stiffness / y.fibers});
  }
  finish_types(cell);
  std::vector<Vec3> x;
  const auto add_yarn = [&](bool weft, int type, int yarn, double tension, auto&& center) {
    const FiberType& t = cell.types[static_cast<std::size_t>(type)];
    const int fibers = c.yarns.at(layout.type_names[static_cast<std::size_t>(type)]).fibers;
    const double length = weft ? cell.length_y : cell.length_x;
    const int nodes = std::max(3, static_cast<int>(std::ceil(length / (options.element_length * 2 * t.radius))));
    const auto places = weave::bundle_section(fibers, t.radius, 2 * gap * t.radius, no_limit);
    for (int i = 0; i < fibers; ++i) {
      const Eigen::Vector2d place = places[static_cast<std::size_t>(i)];
      CellFiber fiber;
      for (int k = 0; k < nodes; ++k) {
        const Vec3 at = center(static_cast<double>(k) / nodes);
        fiber.x.push_back(at + (weft ? Vec3(place.x(), 0, place.y()) : Vec3(0, place.x(), place.y())));
      }
      fiber.rest_length.assign(fiber.x.size(), length / nodes);  // until the axes are laid
      fiber.weft = weft;
      fiber.type = static_cast<std::uint16_t>(type);
      fiber.yarn = yarn;
      fiber.place = i;
      fiber.tension = tension / fibers;
      add_fiber(cell, fiber, x);
    }
  };
  const int warps = static_cast<int>(layout.warps.size());
  const double weft_tension = options.weft_tension > 0 ? options.weft_tension : c.loom.tension;
  for (int w = 0; w < warps; ++w) {
    const weave::WarpPlace& warp = layout.warps[static_cast<std::size_t>(w)];
    const double tension = options.warp_tension > 0 ? options.warp_tension : warp.tension;
    add_yarn(false, warp.type, w, tension, [&](double share) {
      return Vec3(share * cell.length_x, warp.y, warp_height(stack.warp_z[static_cast<std::size_t>(w)], share));
    });
  }
  for (int pick = 0; pick < c.picks_per_cell(); ++pick) {
    const auto layer = static_cast<std::size_t>(c.layer_of_pick(pick));
    const double column_x = (pick / c.layers + 0.5) / c.columns * cell.length_x;
    add_yarn(true, layout.weft_type[layer], warps + pick, weft_tension,
             [&](double share) { return Vec3(column_x, share * cell.length_y, stack.weft_z[layer]); });
  }
  x = lay_axes(cell, x, std::vector<double>(cell.nodes(), 0));
  return {std::move(cell), std::move(x)};
}

}  // namespace relax
