// Writes a small mesh that mesh_files_test.py knows: heddle_mesh_files_writer VTU MSH
#include "relax/mesh_files.hpp"
#include "weave/results.hpp"

int main(int argc, char** argv) {
  if (argc != 3) return 1;
  relax::VolumeMesh mesh = relax::box_mesh({0.5, 0, 0}, {2, 1, 0.5}, {3, 2, 2});
  mesh.yarns = {4, 9};
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const auto number = static_cast<double>(i);
    mesh.yarn[i] = static_cast<std::int32_t>(i % 3) - 1;
    if (mesh.yarn[i] < 0) continue;
    mesh.direction[i] = {number, 0.5, 0.25};
    mesh.yarn_tangent[i] = {0, number, 1};
    mesh.location[i] = {number, -number};
    mesh.volume_fraction[i] = 0.01 * number;
    mesh.surface_distance[i] = -0.001 * number;
  }
  weave::write_text_file(argv[1], relax::vtu_text(mesh));
  weave::write_text_file(argv[2], relax::gmsh_text(mesh));
}
