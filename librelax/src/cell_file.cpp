#include "cell_file.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>
#include <utility>

namespace relax {
namespace {

template <class To, class From>
std::vector<To> as(const std::vector<From>& v) {
  return std::vector<To>(v.begin(), v.end());
}

using TypeColumn = double FiberType::*;
constexpr std::array<TypeColumn, 7> type_columns = {&FiberType::radius,
                                                    &FiberType::area,
                                                    &FiberType::youngs_modulus,
                                                    &FiberType::compression_factor,
                                                    &FiberType::transverse_modulus,
                                                    &FiberType::density,
                                                    &FiberType::bending_stiffness};

/// Calls f with the name of each column of a history, a function that reads it from a row, and one that sets it.
template <class F>
void each_column(F&& f) {
  using P = MinimizeProgress;
  f(
      "iteration", [](const P& p) { return static_cast<double>(p.iteration); }, [](P& p, double v) { p.iteration = static_cast<int>(v); });
  f(
      "energy_J", [](const P& p) { return p.energy; }, [](P& p, double v) { p.energy = v; });
  f(
      "gradient_max", [](const P& p) { return p.gradient_max; }, [](P& p, double v) { p.gradient_max = v; });
  f(
      "step_max_m", [](const P& p) { return p.step_max; }, [](P& p, double v) { p.step_max = v; });
  f(
      "damping", [](const P& p) { return p.damping; }, [](P& p, double v) { p.damping = v; });
  f(
      "first_order", [](const P& p) { return static_cast<double>(p.first_order); }, [](P& p, double v) { p.first_order = v != 0; });
  f(
      "factor_kept", [](const P& p) { return static_cast<double>(p.factor_kept); }, [](P& p, double v) { p.factor_kept = v != 0; });
  f(
      "touching", [](const P& p) { return static_cast<double>(p.touching); },
      [](P& p, double v) { p.touching = static_cast<std::size_t>(v); });
  f(
      "wall_s", [](const P& p) { return p.wall; }, [](P& p, double v) { p.wall = v; });
  f(
      "overlap_max", [](const P& p) { return p.overlap_max; }, [](P& p, double v) { p.overlap_max = v; });
  f(
      "factorization_s", [](const P& p) { return p.factorization; }, [](P& p, double v) { p.factorization = v; });
  f(
      "solution_s", [](const P& p) { return p.solution; }, [](P& p, double v) { p.solution = v; });
}

/// Columns that files of older versions lack; what they say is not known then.
const std::set<std::string> later_columns = {"damping", "factor_kept", "overlap_max", "factorization_s", "solution_s"};

}  // namespace

void write_cell(weave::Hdf5File& file, const Cell& cell) {
  file.write("/cell/numbers", std::vector<double>{cell.length_x, cell.length_y, cell.pressure, cell.slack_strain});
  constexpr double given = std::numeric_limits<double>::quiet_NaN();
  file.write("/cell/load_N", std::vector<double>{cell.load_x.value_or(given), cell.load_y.value_or(given)});
  std::vector<double> types;
  for (const FiberType& type : cell.types) {
    for (const TypeColumn column : type_columns) types.push_back(type.*column);
  }
  file.write_rows<double>("/cell/types", types, type_columns.size());
  file.write("/cell/first", cell.first);
  file.write("/cell/weft", cell.weft);
  file.write("/cell/type", as<std::uint32_t>(cell.type));
  file.write("/cell/yarn", cell.yarn);
  file.write("/cell/place", cell.place);
  file.write("/cell/next", cell.next);
  file.write("/cell/tension_N", cell.tension);
  file.write("/cell/rest_length_m", cell.rest_length);
}

Cell read_cell(const weave::Hdf5File& file) {
  Cell cell;
  const std::vector<double> numbers = file.read<double>("/cell/numbers");
  if (numbers.size() != 4) throw std::runtime_error("/cell/numbers: has " + std::to_string(numbers.size()) + " values, must have four");
  cell.length_x = numbers[0];
  cell.length_y = numbers[1];
  cell.pressure = numbers[2];
  cell.slack_strain = numbers[3];
  const std::vector<double> load = file.has("/cell/load_N") ? file.read<double>("/cell/load_N") : std::vector<double>{};
  if (load.size() == 2 && !std::isnan(load[0])) cell.load_x = load[0];
  if (load.size() == 2 && !std::isnan(load[1])) cell.load_y = load[1];
  const weave::Hdf5Array<double> types = file.read_rows<double>("/cell/types");
  if (types.columns != type_columns.size()) throw std::runtime_error("/cell/types: has " + std::to_string(types.columns) + " columns");
  for (std::size_t i = 0; i < types.rows; ++i) {
    FiberType& type = cell.types.emplace_back();
    for (std::size_t k = 0; k < type_columns.size(); ++k) type.*type_columns[k] = types.values[i * types.columns + k];
  }
  finish_types(cell);
  const auto first = file.read<std::uint32_t>("/cell/first");
  const auto weft = file.read<std::uint8_t>("/cell/weft");
  const auto type = file.read<std::uint32_t>("/cell/type");
  const auto yarn = file.read<std::int32_t>("/cell/yarn"), place = file.read<std::int32_t>("/cell/place");
  const auto tension = file.read<double>("/cell/tension_N"), rest_length = file.read<double>("/cell/rest_length_m");
  const std::size_t fibers = weft.size();
  if (first.size() != fibers + 1 || type.size() != fibers || yarn.size() != fibers || place.size() != fibers || tension.size() != fibers ||
      first.back() != rest_length.size()) {
    throw std::runtime_error("/cell: the arrays do not belong together");
  }
  std::vector<Vec3> x;
  for (std::size_t f = 0; f < fibers; ++f) {
    if (first[f] > first[f + 1] || type[f] >= cell.types.size())
      throw std::runtime_error("/cell: fiber " + std::to_string(f) + " is not valid");
    CellFiber fiber;
    fiber.weft = weft[f] != 0;
    fiber.type = static_cast<std::uint16_t>(type[f]);
    fiber.yarn = yarn[f];
    fiber.place = place[f];
    fiber.tension = tension[f];
    fiber.x.resize(first[f + 1] - first[f]);
    fiber.rest_length.assign(rest_length.begin() + first[f], rest_length.begin() + first[f + 1]);
    add_fiber(cell, fiber, x);
  }
  close_fibers(cell, file.read<std::uint32_t>("/cell/next"));
  return cell;
}

void write_history(weave::Hdf5File& file, const std::vector<MinimizeProgress>& history) {
  each_column([&](const char* name, auto&& get, auto&&) {
    std::vector<double> column;
    for (const MinimizeProgress& p : history) column.push_back(get(p));
    file.write(std::string("/history/") + name, column);
  });
}

std::vector<MinimizeProgress> read_history(const weave::Hdf5File& file) {
  std::vector<MinimizeProgress> history;
  each_column([&](const char* name, auto&&, auto&& set) {
    const std::string path = std::string("/history/") + name;
    if (later_columns.contains(name) && !file.has(path)) {
      for (MinimizeProgress& p : history) set(p, std::numeric_limits<double>::quiet_NaN());
      return;
    }
    const auto column = file.read<double>(path);
    history.resize(column.size());
    for (std::size_t i = 0; i < column.size(); ++i) set(history[i], column[i]);
  });
  return history;
}

void write_unknowns(weave::Hdf5File& file, const std::string& path, const Eigen::VectorXd& q) {
  file.write(path, std::span<const double>(q.data(), static_cast<std::size_t>(q.size())));
}

Eigen::VectorXd read_unknowns(const weave::Hdf5File& file, const std::string& path) {
  const auto values = file.read<double>(path);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

}  // namespace relax
