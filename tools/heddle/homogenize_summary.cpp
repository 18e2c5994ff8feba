#include "heddle/homogenize_summary.hpp"

#include <nlohmann/json.hpp>

#include "relax/deck.hpp"
#include "weave/peak_memory.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;
using relax::EngineeringConstants;
using relax::Matrix6;

/// Rows and columns of Voigt's order that are known.
ordered_json matrix_json(const Matrix6& m, const std::vector<int>& order) {
  ordered_json rows = ordered_json::array();
  for (const int i : order) {
    ordered_json row = ordered_json::array();
    for (const int j : order) row.push_back(m(i, j));
    rows.push_back(row);
  }
  return rows;
}

}  // namespace

EngineeringConstants constants_of(const Matrix6& stiffness, const HomogenizeCommandOptions& options) {
  return options.free_z ? relax::plane_engineering_constants(stiffness) : relax::engineering_constants(stiffness);
}

std::vector<Estimate> estimates_of(const relax::Homogenization& r, const HomogenizeCommandOptions& options) {
  if (options.free_z)
    return {{"laminate", "laminate", relax::plane_stress_stiffness(r.laminate), false},
            {"voigt", "Voigt", relax::plane_stress_stiffness(r.bounds.voigt), true}};
  return {{"reuss", "Reuss", r.bounds.reuss, true}, {"laminate", "laminate", r.laminate, false}, {"voigt", "Voigt", r.bounds.voigt, true}};
}

double mesh_error(const SolvedCell& fine, const SolvedCell& coarse) {
  return (coarse.result.stiffness - fine.result.stiffness).norm() / fine.result.stiffness.norm();
}

std::string homogenize_summary(const CompositeInput& input, const relax::Constituents& constituents,
                               const HomogenizeCommandOptions& options, const SolvedCell& fine, const SolvedCell* coarse, double read_wall,
                               double wall) {
  const bool periodic_z = !options.free_z;
  const std::vector<int> order = relax::load_cases(periodic_z);
  const relax::Homogenization& r = fine.result;
  const EngineeringConstants c = constants_of(r.stiffness, options);
  ordered_json j = {{"tool", "homogenize"}};
  j.update(ordered_json::parse(composite_summary(input, fine.cell, constituents, options)));
  j["volume_fraction_bin_width"] = r.bin_width;
  j["elements_capped"] = r.capped;
  j["stiffness_order"] = periodic_z ? "xx, yy, zz, yz, xz, xy" : "xx, yy, xy";
  j["stiffness_Pa"] = matrix_json(r.stiffness, order);
  for (const NamedConstant& n : engineering_constants_named)
    if (periodic_z || n.in_plane) j[n.name] = c.*n.value;
  j["stiffness_asymmetry"] = r.asymmetry;
  for (const Estimate& e : estimates_of(r, options)) {
    j[std::string(e.name) + "_stiffness_Pa"] = matrix_json(e.stiffness, order);
    const EngineeringConstants of_estimate = constants_of(e.stiffness, options);
    for (const NamedConstant& n : engineering_constants_named)
      if (periodic_z || n.in_plane) j[std::string(e.name) + "_" + n.name] = of_estimate.*n.value;
  }
  ordered_json stages = {{"read", read_wall}, {"mesh", fine.mesh_wall}, {"solve", r.solve_wall}};
  if (coarse) {
    const relax::VolumeMesh& mesh = coarse->cell.composite.mesh;
    j["mesh_error"] = mesh_error(fine, *coarse);
    j["mesh_error_elements"] = mesh.elements();
    j["mesh_error_nodes"] = mesh.points.size();
    j["coarse_stiffness_Pa"] = matrix_json(coarse->result.stiffness, order);
    stages["coarse_mesh"] = coarse->mesh_wall;
    stages["coarse_solve"] = coarse->result.solve_wall;
  } else {
    j["mesh_error"] = nullptr;
  }
  j["wall_s"] = wall;
  j["stage_wall_s"] = stages;
  j["peak_memory_bytes"] = weave::peak_memory_bytes();
  return j.dump(2) + "\n";
}

}  // namespace heddle
