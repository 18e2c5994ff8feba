#include "composite_input.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <stdexcept>

#include "relax/surface_file.hpp"
#include "relax/version.hpp"
#include "weave/case.hpp"

namespace heddle {
namespace {

nlohmann::json read_json(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw std::runtime_error(file.string() + ": cannot be opened; the folder must be one that `heddle envelope` wrote");
  try {
    return nlohmann::json::parse(stream);
  } catch (const nlohmann::json::parse_error& e) {
    throw std::runtime_error(file.string() + ": not JSON: " + e.what());
  }
}

/// Files yarn_<number>.off of a folder by number.
std::map<int, std::filesystem::path> envelope_files(const std::filesystem::path& folder) {
  std::map<int, std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string(), prefix = "yarn_", suffix = ".off";
    if (!name.starts_with(prefix) || !name.ends_with(suffix)) continue;
    const std::string digits = name.substr(prefix.size(), name.size() - prefix.size() - suffix.size());
    int number = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
    if (error == std::errc() && end == digits.data() + digits.size() && number >= 0) files[number] = entry.path();
  }
  return files;
}

/// The source as the summary has it, or beside the folder.
std::filesystem::path source_file(const std::filesystem::path& folder, const std::filesystem::path& source) {
  if (source.is_absolute() || std::filesystem::exists(source)) return source;
  return folder / source;
}

double solid_fraction(const relax::VoxelMesh& v) {
  double fibers = 0;
  for (const relax::YarnVolume& y : v.volumes) fibers += y.fibers;
  return fibers / (v.mesh.high - v.mesh.low).prod();
}

nlohmann::ordered_json constants_json(const relax::TransverseIsotropic& m) {
  return {{"e1_Pa", m.e1}, {"e2_Pa", m.e2}, {"g12_Pa", m.g12}, {"nu12", m.nu12}, {"nu23", m.nu23}};
}

}  // namespace

CompositeInput read_composite_input(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    throw std::runtime_error(folder.string() + ": not a folder; give one that `heddle envelope` wrote");
  const std::filesystem::path summary_file = folder / "summary.json";
  const nlohmann::json summary = read_json(summary_file);
  if (!summary.is_object() || !summary.contains("source") || !summary["source"].is_string())
    throw std::runtime_error(summary_file.string() + ": has no key \"source\", the file of the cell that the envelopes were made of");
  const std::map<int, std::filesystem::path> files = envelope_files(folder);
  if (files.empty()) throw std::runtime_error(folder.string() + ": has no yarn_<number>.off");

  CompositeInput input;
  const std::filesystem::path source = source_file(folder, summary["source"].get<std::string>());
  input.source = weave::read_results(source);
  input.case_name =
      input.source.case_toml.empty() ? source.stem().string() : weave::parse_case(input.source.case_toml, source.string()).name;
  const weave::Snapshot& cell = input.source.snapshot;
  if (!(cell.cell_length > 0)) throw std::runtime_error(source.string() + ": is of no unit cell");
  std::map<int, bool> wefts;
  for (std::size_t f = 0; f < cell.fibers(); ++f) wefts[cell.yarn[f]] = cell.weft[f] != 0;
  for (const auto& [yarn, weft] : wefts)
    if (!files.contains(yarn))
      throw std::runtime_error(folder.string() + ": yarn " + std::to_string(yarn) + " of " + source.string() + " has no envelope");
  for (const auto& [yarn, file] : files) {
    if (!wefts.contains(yarn)) throw std::runtime_error(file.string() + ": " + source.string() + " has no yarn " + std::to_string(yarn));
    relax::YarnEnvelope envelope;
    envelope.yarn = yarn;
    envelope.weft = wefts[yarn];
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

relax::Constituents constituents_of(const CompositeOptions& o) {
  relax::Constituents c;
  const auto& known = relax::known_fibers();
  const auto fiber = std::find_if(known.begin(), known.end(), [&](const relax::KnownFiber& f) { return f.name == o.fiber; });
  if (fiber == known.end()) {
    std::string names;
    for (const relax::KnownFiber& f : known) names += std::string(names.empty() ? "" : ", ") + f.name;
    throw std::invalid_argument("--fiber " + o.fiber + ": known are " + names);
  }
  c.fiber_name = fiber->name;
  c.fiber = fiber->constants;
  const auto change = [&](double value, double least, double& constant) {
    if (value <= least) return;
    constant = value;
    c.fiber_name = std::string(fiber->name) + ", changed";
  };
  change(o.fiber_e1, 0, c.fiber.e1);
  change(o.fiber_e2, 0, c.fiber.e2);
  change(o.fiber_g12, 0, c.fiber.g12);
  change(o.fiber_nu12, -1, c.fiber.nu12);
  change(o.fiber_nu23, -1, c.fiber.nu23);
  c.matrix_name = "epoxy";
  c.matrix_e = o.matrix_e;
  c.matrix_nu = o.matrix_nu;
  if (o.rule != "chamis" && o.rule != "mori_tanaka") throw std::invalid_argument("--rule " + o.rule + ": must be chamis or mori_tanaka");
  c.rule = o.rule == "chamis" ? relax::Micromechanics::chamis : relax::Micromechanics::mori_tanaka;
  relax::check_constants(c.fiber, "fiber " + c.fiber_name);
  relax::check_constants(relax::isotropic(c.matrix_e, c.matrix_nu), "matrix " + c.matrix_name);
  return c;
}

std::string composite_summary(const CompositeInput& input, const relax::VoxelMesh& v, const relax::Constituents& c,
                              const CompositeOptions& o) {
  using nlohmann::ordered_json;
  const relax::VolumeMesh& m = v.mesh;
  const Eigen::Vector3d size = m.high - m.low;
  ordered_json j;
  j["case"] = input.case_name;
  j["version"] = relax::version();
  j["envelopes"] = o.input.string();
  j["elements"] = m.elements();
  j["voxels"] = m.voxels;
  j["cell_m"] = {size.x(), size.y(), size.z()};
  j["voxel_m"] = {size.x() / m.voxels[0], size.y() / m.voxels[1], size.z() / m.voxels[2]};
  j["periodic_z"] = !o.free_z;
  j["resin_margin_m"] = o.resin_margin;
  j["fiber_volume_fraction"] = solid_fraction(v);
  double yarn_voxels = 0, largest = 0;
  for (std::size_t i = 0; i < m.elements(); ++i) {
    yarn_voxels += m.yarn[i] >= 0 ? 1 : 0;
    largest = std::max(largest, m.volume_fraction[i]);
  }
  j["yarn_volume_fraction"] = yarn_voxels / static_cast<double>(m.elements());
  j["local_volume_fraction_largest"] = largest;
  j["elements_in_two_envelopes"] = v.contested;
  j["yarns"] = ordered_json::array();
  for (const relax::YarnVolume& y : v.volumes)
    j["yarns"].push_back({{"yarn", y.yarn},
                          {"envelope_m3", y.envelope},
                          {"voxels_m3", y.voxels},
                          {"fibers_m3", y.fibers},
                          {"local_fractions_scaled_by", y.fraction_scale}});
  j["fiber"] = constants_json(c.fiber);
  j["fiber"]["name"] = c.fiber_name;
  j["matrix"] = {{"name", c.matrix_name}, {"e_Pa", c.matrix_e}, {"nu", c.matrix_nu}};
  j["micromechanics"] = o.rule;
  j["volume_fraction_bins"] = o.bins;
  return j.dump();
}

void print_composite(const CompositeInput& input, const relax::VoxelMesh& v, const relax::Constituents& c) {
  const relax::VolumeMesh& m = v.mesh;
  const Eigen::Vector3d size = 1e3 * (m.high - m.low);
  double envelopes = 0, voxels = 0;
  for (const relax::YarnVolume& y : v.volumes) {
    envelopes += y.envelope;
    voxels += y.voxels;
  }
  fmt::print("{}: {} x {} x {} = {} elements in {:.4g} x {:.4g} x {:.4g} mm, {} yarns\n", input.case_name, m.voxels[0], m.voxels[1],
             m.voxels[2], m.elements(), size.x(), size.y(), size.z(), m.yarns.size());
  fmt::print("  fiber volume fraction {:.4f}, yarns {:.4f} of the cell (their envelopes {:.4f}), {} elements within two envelopes\n",
             solid_fraction(v), voxels / (m.high - m.low).prod(), envelopes / (m.high - m.low).prod(), v.contested);
  fmt::print("  fiber {}: E1 {:.4g} E2 {:.4g} G12 {:.4g} GPa, nu12 {:.3g} nu23 {:.3g}; matrix {}: E {:.4g} GPa, nu {:.3g}; {}\n",
             c.fiber_name, 1e-9 * c.fiber.e1, 1e-9 * c.fiber.e2, 1e-9 * c.fiber.g12, c.fiber.nu12, c.fiber.nu23, c.matrix_name,
             1e-9 * c.matrix_e, c.matrix_nu, c.rule == relax::Micromechanics::chamis ? "Chamis' rule" : "Mori-Tanaka");
}

}  // namespace heddle
