#include "heddle/homogenize_command.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "relax/homogenize.hpp"
#include "relax/mesh_files.hpp"
#include "weave/peak_memory.hpp"

namespace heddle {
namespace {

using relax::EngineeringConstants;
using relax::Matrix6;

/// Rows and columns of Voigt's order that are known.
nlohmann::ordered_json matrix_json(const Matrix6& m, const std::vector<int>& order) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const int i : order) {
    nlohmann::ordered_json row = nlohmann::ordered_json::array();
    for (const int j : order) row.push_back(m(i, j));
    rows.push_back(row);
  }
  return rows;
}

struct NamedConstant {
  const char *name, *label;
  double EngineeringConstants::*value;
  bool modulus, in_plane;
};
constexpr std::array<NamedConstant, 9> constants = {{
    {"ex_Pa", "Ex", &EngineeringConstants::ex, true, true},
    {"ey_Pa", "Ey", &EngineeringConstants::ey, true, true},
    {"ez_Pa", "Ez", &EngineeringConstants::ez, true, false},
    {"gxy_Pa", "Gxy", &EngineeringConstants::gxy, true, true},
    {"gyz_Pa", "Gyz", &EngineeringConstants::gyz, true, false},
    {"gxz_Pa", "Gxz", &EngineeringConstants::gxz, true, false},
    {"nu_xy", "nu_xy", &EngineeringConstants::nu_xy, false, true},
    {"nu_xz", "nu_xz", &EngineeringConstants::nu_xz, false, false},
    {"nu_yz", "nu_yz", &EngineeringConstants::nu_yz, false, false},
}};

/// A mesh, and what CalculiX makes of it.
struct Solved {
  MeshedCell cell;
  relax::Homogenization result;
  double mesh_wall = 0;  ///< [s]
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

relax::Homogenization solve(const relax::VolumeMesh& mesh, const CompositeInput& input, const relax::Constituents& constituents,
                            const HomogenizeCommandOptions& options, const std::filesystem::path& folder, const std::string& name) {
  relax::HomogenizeOptions o;
  o.ccx = options.ccx;
  o.periodic_z = !options.free_z;
  o.bins = options.bins;
  o.title = input.case_name + ", unit cell";
  return relax::homogenize(mesh, constituents, o, folder, name);
}

/// On voxels, or on tetrahedra with nodes at the middles of their edges.
Solved solve_fine(const CompositeInput& input, const relax::Constituents& constituents, const HomogenizeCommandOptions& options,
                  const std::filesystem::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  HomogenizeCommandOptions fine = options;
  fine.quadratic = options.tetrahedra;
  Solved solved;
  solved.cell = mesh_cell(input, fine);
  solved.mesh_wall = seconds_since(start);
  solved.result = solve(solved.cell.composite.mesh, input, constituents, options, folder, "calculix");
  return solved;
}

/// On voxels half as large again, or on the same tetrahedra without these nodes.
Solved solve_coarse(const CompositeInput& input, const relax::Constituents& constituents, const HomogenizeCommandOptions& options,
                    const relax::VolumeMesh& fine, const std::filesystem::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  Solved solved;
  if (options.tetrahedra) {
    solved.cell.composite.mesh = relax::without_middle_nodes(fine);
  } else {
    HomogenizeCommandOptions coarse = options;
    coarse.voxels.clear();
    for (const int count : fine.voxels) coarse.voxels.push_back(std::max(1, static_cast<int>(std::lround(count / 1.5))));
    solved.cell = mesh_cell(input, coarse);
  }
  solved.mesh_wall = seconds_since(start);
  solved.result = solve(solved.cell.composite.mesh, input, constituents, options, folder, "calculix_coarse");
  return solved;
}

void print_result(const relax::Homogenization& r, const std::vector<int>& order, const EngineeringConstants& c,
                  const EngineeringConstants& reuss, const EngineeringConstants& voigt, bool periodic_z) {
  constexpr std::array<const char*, 6> names = {"xx", "yy", "zz", "yz", "xz", "xy"};
  fmt::print("  stiffness [GPa]{}\n       ", periodic_z ? "" : " of the layer in plane stress, without bending");
  for (const int j : order) fmt::print("{:>9}", names[static_cast<std::size_t>(j)]);
  for (const int i : order) {
    fmt::print("\n    {} ", names[static_cast<std::size_t>(i)]);
    for (const int j : order) fmt::print("{:9.4f}", 1e-9 * r.stiffness(i, j));
  }
  fmt::print("\n                          {}    Voigt\n", periodic_z ? "   Reuss" : "        ");
  for (const NamedConstant& n : constants) {
    if (!periodic_z && !n.in_plane) continue;
    if (n.modulus)
      fmt::print("    {:5} {:9.4f} GPa      {} {:8.4f}\n", n.label, 1e-9 * (c.*n.value),
                 periodic_z ? fmt::format("{:8.4f}", 1e-9 * (reuss.*n.value)) : std::string(8, ' '), 1e-9 * (voigt.*n.value));
    else
      fmt::print("    {:5} {:9.4f}\n", n.label, c.*n.value);
  }
}

}  // namespace

int homogenize_command(const HomogenizeCommandOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  relax::find_ccx(options.ccx);
  const CompositeInput input = read_composite_input(options.input);
  const relax::Constituents constituents = constituents_of(options, input.source_case);
  const double read_wall = seconds_since(start);
  const std::filesystem::path output = options.output.empty() ? options.input / "homogenized" : options.output;
  std::filesystem::create_directories(output);

  const Solved fine = solve_fine(input, constituents, options, output);
  const relax::VolumeMesh& mesh = fine.cell.composite.mesh;
  print_composite(input, fine.cell, constituents);
  const bool periodic_z = !options.free_z;
  const std::vector<int> order = relax::load_cases(periodic_z);
  const auto engineering = [&](const Matrix6& m) {
    return periodic_z ? relax::engineering_constants(m) : relax::plane_engineering_constants(m);
  };
  const relax::Homogenization& r = fine.result;
  const Matrix6 voigt = periodic_z ? r.bounds.voigt : relax::plane_stress_stiffness(r.bounds.voigt);
  const EngineeringConstants c = engineering(r.stiffness), c_voigt = engineering(voigt), c_reuss = engineering(r.bounds.reuss);
  print_result(r, order, c, c_reuss, c_voigt, periodic_z);
  fmt::print("  solved in {:.1f} s, unsymmetric by {:.1e} before it was made symmetric\n", r.solve_wall, r.asymmetry);

  nlohmann::ordered_json j = {{"tool", "homogenize"}};
  j.update(nlohmann::ordered_json::parse(composite_summary(input, fine.cell, constituents, options)));
  j["volume_fraction_bin_width"] = r.bin_width;
  j["elements_capped"] = r.capped;
  j["stiffness_order"] = periodic_z ? "xx, yy, zz, yz, xz, xy" : "xx, yy, xy";
  j["stiffness_Pa"] = matrix_json(r.stiffness, order);
  for (const NamedConstant& n : constants)
    if (periodic_z || n.in_plane) j[n.name] = c.*n.value;
  j["stiffness_asymmetry"] = r.asymmetry;
  j["voigt_stiffness_Pa"] = matrix_json(voigt, order);
  if (periodic_z) j["reuss_stiffness_Pa"] = matrix_json(r.bounds.reuss, order);
  nlohmann::ordered_json stages = {{"read", read_wall}, {"mesh", fine.mesh_wall}, {"solve", r.solve_wall}};
  if (options.mesh_error) {
    const Solved coarse = solve_coarse(input, constituents, options, mesh, output);
    const relax::VolumeMesh& coarse_mesh = coarse.cell.composite.mesh;
    const double error = (coarse.result.stiffness - r.stiffness).norm() / r.stiffness.norm();
    const EngineeringConstants of_coarse = engineering(coarse.result.stiffness);
    j["mesh_error"] = error;
    j["mesh_error_elements"] = coarse_mesh.elements();
    j["mesh_error_nodes"] = coarse_mesh.points.size();
    j["coarse_stiffness_Pa"] = matrix_json(coarse.result.stiffness, order);
    stages["coarse_mesh"] = coarse.mesh_wall;
    stages["coarse_solve"] = coarse.result.solve_wall;
    fmt::print("  on {} elements of {} nodes the stiffness differs by {:.2f} % (norm of the matrix);", coarse_mesh.elements(),
               relax::nodes_of(coarse_mesh.shape), 1e2 * error);
    for (const NamedConstant& n : constants)
      if (n.modulus && (periodic_z || n.in_plane)) fmt::print(" {} {:+.2f} %", n.label, 1e2 * (of_coarse.*n.value / (c.*n.value) - 1));
    fmt::print("\n");
  } else {
    j["mesh_error"] = nullptr;
  }
  j["wall_s"] = seconds_since(start);
  j["stage_wall_s"] = stages;
  j["peak_memory_bytes"] = weave::peak_memory_bytes();
  weave::write_text_file(output / "mesh.vtu", relax::vtu_text(mesh));
  weave::write_text_file(output / "summary.json", j.dump(2) + "\n");
  fmt::print("  results in {}\n", output.string());
  return 0;
}

}  // namespace heddle
