#include "heddle/composite_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "heddle/edge_length.hpp"
#include "relax/surface_file.hpp"
#include "relax/version.hpp"

namespace heddle {
namespace {

double cell_volume(const relax::CompositeMesh& c) {
  return (c.mesh.high - c.mesh.low).prod();
}

double solid_fraction(const relax::CompositeMesh& c) {
  double fibers = 0;
  for (const relax::YarnVolume& y : c.volumes) fibers += y.fibers;
  return fibers / cell_volume(c);
}

double yarn_fraction(const relax::CompositeMesh& c) {
  double yarns = 0;
  for (const relax::YarnVolume& y : c.volumes) yarns += y.elements;
  return yarns / cell_volume(c);
}

nlohmann::ordered_json constants_json(const relax::TransverseIsotropic& m) {
  return {{"e1_Pa", m.e1}, {"e2_Pa", m.e2}, {"g12_Pa", m.g12}, {"nu12", m.nu12}, {"nu23", m.nu23}};
}

/// In meters; fiber diameters are the mean of the cell's.
double edge_length_of(const std::string& text, const weave::Snapshot& cell) {
  const EdgeLength length = parse_edge_length(text);
  if (!length.in_diameters) return length.value;
  const double radius = std::accumulate(cell.radius.begin(), cell.radius.end(), 0.0) / static_cast<double>(cell.radius.size());
  return length.value * 2 * radius;
}

/// The material that a case gives to its yarns; "e_glass" where it gives none.
std::string material_of_yarns(const weave::Case& c) {
  std::vector<std::string> used = c.weft.yarn_of_layer;
  for (const weave::WarpSection& section : c.sections) used.push_back(section.yarn);
  const std::string first = used.empty() ? "" : c.yarns.at(used.front()).material;
  for (const std::string& name : used) {
    const std::string& material = c.yarns.at(name).material;
    if (material == first) continue;
    const auto text = [](const std::string& m) { return m.empty() ? std::string("no material") : "material \"" + m + "\""; };
    throw std::invalid_argument(
        fmt::format("case {}: yarn {} has {} and yarn {} {}: the yarns of a composite must be of one material; choose it with --fiber",
                    c.name, used.front(), text(first), name, text(material)));
  }
  return first.empty() ? "e_glass" : first;
}

}  // namespace

CompositeInput read_composite_input(const std::filesystem::path& folder) {
  const std::filesystem::path fibers = folder / "fibers.vtkhdf";
  if (!std::filesystem::exists(fibers))
    throw std::runtime_error(fibers.string() + ": is not there; give a folder that `heddle envelope` wrote");
  CompositeInput input;
  input.source = weave::read_results(fibers);
  if (!input.source.case_toml.empty()) input.source_case = weave::parse_case(input.source.case_toml, fibers.string());
  input.case_name = input.source.case_toml.empty() ? folder.stem().string() : input.source_case.name;
  const weave::Snapshot& cell = input.source.snapshot;
  std::map<int, bool> wefts;
  for (std::size_t f = 0; f < cell.fibers(); ++f) wefts[cell.yarn[f]] = cell.weft[f] != 0;
  for (const auto& [yarn, weft] : wefts) {
    const std::filesystem::path file = folder / fmt::format("{}_{}.off", weft ? "weft" : "warp", yarn);
    if (!std::filesystem::exists(file))
      throw std::runtime_error(file.string() + ": is not there; `heddle envelope` writes it with --formats off");
    relax::YarnEnvelope envelope;
    envelope.yarn = yarn;
    envelope.weft = weft;
    envelope.surface = relax::read_closed_off(file);
    input.envelopes.push_back(std::move(envelope));
  }
  return input;
}

relax::VoxelOptions voxel_options(const CompositeOptions& o) {
  relax::VoxelOptions voxels;
  if (!o.voxels.empty()) voxels.counts = {o.voxels.at(0), o.voxels.at(1), o.voxels.at(2)};
  voxels.size = o.voxel_size;
  voxels.elements = o.elements;
  voxels.resin_margin = o.resin_margin;
  voxels.fields.kernel_radius = o.kernel_radius;
  return voxels;
}

MeshedCell mesh_cell(const CompositeInput& input, const CompositeOptions& o) {
  if (!o.tetrahedra) return {relax::voxel_mesh(input.source.snapshot, input.envelopes, voxel_options(o)), {}};
  relax::TetOptions tetrahedra;
  if (!o.edge_length.empty()) tetrahedra.edge_length = edge_length_of(o.edge_length, input.source.snapshot);
  tetrahedra.resin_margin = o.resin_margin;
  tetrahedra.fields.kernel_radius = o.kernel_radius;
  MeshedCell meshed;
  meshed.tetrahedra.emplace();
  meshed.composite = relax::tet_mesh(input.source.snapshot, input.envelopes, tetrahedra, &*meshed.tetrahedra);
  if (o.quadratic) meshed.composite.mesh = relax::with_middle_nodes(meshed.composite.mesh);
  return meshed;
}

relax::Constituents constituents_of(const CompositeOptions& o, const weave::Case& source_case) {
  relax::Constituents c;
  c.fiber_name = !o.fiber.empty() ? o.fiber : material_of_yarns(source_case);
  const auto& known = weave::known_fibers();
  const auto fiber = std::find_if(known.begin(), known.end(), [&](const weave::KnownFiber& f) { return f.name == c.fiber_name; });
  if (source_case.materials.contains(c.fiber_name)) {  // a case's own goes before one that is known
    c.fiber = source_case.materials.at(c.fiber_name);
  } else if (fiber != known.end()) {
    c.fiber = fiber->constants;
  } else {
    std::string names;
    for (const weave::KnownFiber& f : known) names += std::string(names.empty() ? "" : ", ") + f.name;
    for (const auto& [name, constants] : source_case.materials) names += ", and of the case " + name;
    throw std::invalid_argument("--fiber " + o.fiber + ": known are " + names);
  }
  const auto change = [&](double value, double least, double& constant) {
    if (value <= least) return;
    constant = value;
    if (!c.fiber_name.ends_with(", changed")) c.fiber_name += ", changed";
  };
  change(o.fiber_e1, 0, c.fiber.e1);
  change(o.fiber_e2, 0, c.fiber.e2);
  change(o.fiber_g12, 0, c.fiber.g12);
  change(o.fiber_nu12, -1, c.fiber.nu12);
  change(o.fiber_nu23, -1, c.fiber.nu23);
  c.matrix_name = "epoxy";
  const weave::MatrixSpec matrix = source_case.matrix_material.value_or(weave::MatrixSpec{3.45e9, 0.35});
  c.matrix_e = o.matrix_e > 0 ? o.matrix_e : matrix.e;
  c.matrix_nu = o.matrix_nu > -1 ? o.matrix_nu : matrix.nu;
  if (o.rule != "chamis" && o.rule != "mori_tanaka") throw std::invalid_argument("--rule " + o.rule + ": must be chamis or mori_tanaka");
  c.rule = o.rule == "chamis" ? relax::Micromechanics::chamis : relax::Micromechanics::mori_tanaka;
  relax::check_constants(c.fiber, "fiber " + c.fiber_name);
  relax::check_constants(relax::isotropic(c.matrix_e, c.matrix_nu), "matrix " + c.matrix_name);
  return c;
}

std::string composite_summary(const CompositeInput& input, const MeshedCell& meshed, const relax::Constituents& c,
                              const CompositeOptions& o) {
  using nlohmann::ordered_json;
  const relax::CompositeMesh& v = meshed.composite;
  const relax::VolumeMesh& m = v.mesh;
  const Eigen::Vector3d size = m.high - m.low;
  ordered_json j;
  j["case"] = input.case_name;
  j["version"] = relax::version();
  j["envelopes"] = o.input.string();
  j["elements"] = m.elements();
  j["element_shape"] = meshed.tetrahedra ? "tetrahedron" : "hexahedron";
  j["nodes_per_element"] = relax::nodes_of(m.shape);
  j["nodes"] = m.points.size();
  j["cell_m"] = {size.x(), size.y(), size.z()};
  if (const auto& t = meshed.tetrahedra) {
    j["edge_length_m"] = t->edge_length;
    j["surface_triangles"] = t->surface_triangles;
    j["dihedral_min_rad"] = t->dihedral_min;
    j["dihedral_max_rad"] = t->dihedral_max;
    j["flat_elements_share"] = t->flat_share;
  } else {
    j["voxels"] = m.voxels;
    j["voxel_m"] = {size.x() / m.voxels[0], size.y() / m.voxels[1], size.z() / m.voxels[2]};
    j["elements_in_two_envelopes"] = v.contested;
  }
  j["periodic_z"] = !o.free_z;
  j["resin_margin_m"] = meshed.tetrahedra ? meshed.tetrahedra->resin_margin : o.resin_margin;
  j["fiber_volume_fraction"] = solid_fraction(v);
  j["yarn_volume_fraction"] = yarn_fraction(v);
  j["local_volume_fraction_largest"] = *std::max_element(m.volume_fraction.begin(), m.volume_fraction.end());
  j["yarns"] = ordered_json::array();
  for (const relax::YarnVolume& y : v.volumes)
    j["yarns"].push_back({{"yarn", y.yarn},
                          {"envelope_m3", y.envelope},
                          {"elements_m3", y.elements},
                          {"fibers_m3", y.fibers},
                          {"local_fractions_scaled_by", y.fraction_scale}});
  j["fiber"] = constants_json(c.fiber);
  j["fiber"]["name"] = c.fiber_name;
  j["matrix"] = {{"name", c.matrix_name}, {"e_Pa", c.matrix_e}, {"nu", c.matrix_nu}};
  j["micromechanics"] = o.rule;
  j["volume_fraction_bins"] = o.bins;
  return j.dump();
}

void print_composite(const CompositeInput& input, const MeshedCell& meshed, const relax::Constituents& c) {
  const relax::CompositeMesh& v = meshed.composite;
  const relax::VolumeMesh& m = v.mesh;
  const Eigen::Vector3d size = 1e3 * (m.high - m.low);
  double envelopes = 0;
  for (const relax::YarnVolume& y : v.volumes) envelopes += y.envelope;
  const std::string counts = meshed.tetrahedra ? "tetrahedra" : fmt::format("= {} x {} x {} voxels", m.voxels[0], m.voxels[1], m.voxels[2]);
  fmt::print("{}: {} {} in {:.4g} x {:.4g} x {:.4g} mm, {} yarns\n", input.case_name, m.elements(), counts, size.x(), size.y(), size.z(),
             m.yarns.size());
  fmt::print("  fiber volume fraction {:.4f}, yarns {:.4f} of the cell (their envelopes {:.4f})", solid_fraction(v), yarn_fraction(v),
             envelopes / cell_volume(v));
  if (const auto& t = meshed.tetrahedra) {
    constexpr double degree = std::numbers::pi / 180;
    fmt::print(
        "\n  dihedral angles {:.2g} to {:.4g} degrees, below 5 in {:.2f} % of the elements; {} triangles of the surfaces are faces\n",
        t->dihedral_min / degree, t->dihedral_max / degree, 1e2 * t->flat_share, t->surface_triangles);
  } else {
    fmt::print(", {} elements within two envelopes\n", v.contested);
  }
  fmt::print("  fiber {}: E1 {:.4g} E2 {:.4g} G12 {:.4g} GPa, nu12 {:.3g} nu23 {:.3g}; matrix {}: E {:.4g} GPa, nu {:.3g}; {}\n",
             c.fiber_name, 1e-9 * c.fiber.e1, 1e-9 * c.fiber.e2, 1e-9 * c.fiber.g12, c.fiber.nu12, c.fiber.nu23, c.matrix_name,
             1e-9 * c.matrix_e, c.matrix_nu, c.rule == relax::Micromechanics::chamis ? "Chamis' rule" : "Mori-Tanaka");
}

}  // namespace heddle
