#include "heddle/homogenize_command.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "heddle/homogenize_summary.hpp"
#include "relax/deck.hpp"
#include "relax/mesh_files.hpp"

namespace heddle {
namespace {

using relax::EngineeringConstants;

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
SolvedCell solve_fine(const CompositeInput& input, const relax::Constituents& constituents, const HomogenizeCommandOptions& options,
                      const std::filesystem::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  HomogenizeCommandOptions fine = options;
  fine.quadratic = options.tetrahedra;
  SolvedCell solved;
  solved.cell = mesh_cell(input, fine);
  solved.mesh_wall = seconds_since(start);
  std::filesystem::create_directories(folder);       // now that there is a mesh
  std::filesystem::remove(folder / "summary.json");  // it comes last: no old one stands beside new files
  solved.result = solve(solved.cell.composite.mesh, input, constituents, options, folder, "calculix");
  return solved;
}

/// On voxels half as large again, or on the same tetrahedra without these nodes.
SolvedCell solve_coarse(const CompositeInput& input, const relax::Constituents& constituents, const HomogenizeCommandOptions& options,
                        const relax::VolumeMesh& fine, const std::filesystem::path& folder) {
  const auto start = std::chrono::steady_clock::now();
  SolvedCell solved;
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

void print_result(const relax::Homogenization& r, const HomogenizeCommandOptions& options) {
  const bool periodic_z = !options.free_z;
  const std::vector<int> order = relax::load_cases(periodic_z);
  const std::vector<Estimate> estimates = estimates_of(r, options);
  constexpr std::array<const char*, 6> names = {"xx", "yy", "zz", "yz", "xz", "xy"};
  fmt::print("  stiffness [GPa]{}\n       ", periodic_z ? "" : " of the layer in plane stress, without bending");
  for (const int j : order) fmt::print("{:>9}", names[static_cast<std::size_t>(j)]);
  for (const int i : order) {
    fmt::print("\n    {} ", names[static_cast<std::size_t>(i)]);
    for (const int j : order) fmt::print("{:9.4f}", 1e-9 * r.stiffness(i, j));
  }
  fmt::print("\n{:23}", "");
  for (const Estimate& e : estimates) fmt::print("{:>10}", e.label);
  fmt::print("\n");
  for (const NamedConstant& n : engineering_constants_named) {
    if (!periodic_z && !n.in_plane) continue;
    const double factor = n.modulus ? 1e-9 : 1;
    fmt::print("    {:5} {:9.4f} {:3}", n.label, factor * (constants_of(r.stiffness, options).*n.value), n.modulus ? "GPa" : "");
    for (const Estimate& e : estimates)
      fmt::print("{:>10}", n.modulus || !e.bound ? fmt::format("{:.4f}", factor * (constants_of(e.stiffness, options).*n.value)) : "");
    fmt::print("\n");
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

  const SolvedCell fine = solve_fine(input, constituents, options, output);
  const relax::VolumeMesh& mesh = fine.cell.composite.mesh;
  print_composite(input, fine.cell, constituents);
  const bool periodic_z = !options.free_z;
  const relax::Homogenization& r = fine.result;
  const EngineeringConstants c = constants_of(r.stiffness, options);
  print_result(r, options);
  fmt::print("  solved in {:.1f} s, unsymmetric by {:.1e} before it was made symmetric\n", r.solve_wall, r.asymmetry);

  std::optional<SolvedCell> coarse;
  if (options.mesh_error) {
    coarse = solve_coarse(input, constituents, options, mesh, output);
    const relax::VolumeMesh& coarse_mesh = coarse->cell.composite.mesh;
    const EngineeringConstants of_coarse = constants_of(coarse->result.stiffness, options);
    fmt::print("  on {} elements of {} nodes the stiffness differs by {:.2f} % (norm of the matrix);", coarse_mesh.elements(),
               relax::nodes_of(coarse_mesh.shape), 1e2 * mesh_error(fine, *coarse));
    for (const NamedConstant& n : engineering_constants_named)
      if (n.modulus && (periodic_z || n.in_plane)) fmt::print(" {} {:+.2f} %", n.label, 1e2 * (of_coarse.*n.value / (c.*n.value) - 1));
    fmt::print("\n");
  }
  weave::write_text_file(output / "mesh.vtu", relax::vtu_text(mesh));
  weave::write_text_file(output / "summary.json", homogenize_summary(input, constituents, options, fine, coarse ? &*coarse : nullptr,
                                                                     read_wall, seconds_since(start)));
  fmt::print("  results in {}\n", output.string());
  return 0;
}

}  // namespace heddle
