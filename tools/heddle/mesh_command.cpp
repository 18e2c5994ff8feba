#include "heddle/mesh_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "relax/deck.hpp"
#include "relax/mesh_files.hpp"
#include "weave/peak_memory.hpp"

namespace heddle {

int mesh_command(const CompositeOptions& options) {
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::time_point from, Clock::time_point to) { return std::chrono::duration<double>(to - from).count(); };
  const auto start = Clock::now();
  const CompositeInput input = read_composite_input(options.input);
  const relax::Constituents constituents = constituents_of(options, input.source_case);
  const auto read = Clock::now();
  const MeshedCell cell = mesh_cell(input, options);
  const relax::VolumeMesh& mesh = cell.composite.mesh;
  const relax::MaterialBins bins = relax::bin_materials(mesh, constituents, options.bins);
  const relax::PeriodicSets sets = relax::periodic_sets(mesh, !options.free_z);
  const auto meshed = Clock::now();

  const std::filesystem::path output = options.output.empty() ? options.input / "mesh" : options.output;
  std::filesystem::create_directories(output);
  std::filesystem::remove(output / "summary.json");  // it comes last: no old one stands beside new files
  const std::string title = input.case_name + ", unit cell";
  weave::write_text_file(output / "mesh.vtu", relax::vtu_text(mesh));
  weave::write_text_file(output / "mesh.msh", relax::gmsh_text(mesh));
  for (const auto& [file, program] :
       {std::pair{"abaqus.inp", relax::DeckProgram::abaqus}, std::pair{"calculix.inp", relax::DeckProgram::calculix}})
    weave::write_text_file(output / file,
                           relax::deck(mesh, sets, constituents, bins, {program, relax::DeckLoads::unit_strains, !options.free_z, title}));
  const auto written = Clock::now();

  nlohmann::ordered_json j = {{"tool", "mesh"}};
  j.update(nlohmann::ordered_json::parse(composite_summary(input, cell, constituents, options)));
  j["volume_fraction_bin_width"] = bins.width;
  j["elements_capped"] = bins.capped;
  j["wall_s"] = seconds(start, written);
  j["stage_wall_s"] = {{"read", seconds(start, read)}, {"mesh", seconds(read, meshed)}, {"write", seconds(meshed, written)}};
  j["peak_memory_bytes"] = weave::peak_memory_bytes();
  weave::write_text_file(output / "summary.json", j.dump(2) + "\n");
  print_composite(input, cell, constituents);
  fmt::print("  {} bins of volume fraction, {:.3g} wide; {} elements above {}\n  results in {}\n", bins.material.size(), bins.width,
             bins.capped, relax::largest_volume_fraction, output.string());
  return 0;
}

}  // namespace heddle
