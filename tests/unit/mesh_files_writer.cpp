// Writes small meshes that mesh_files_test.py knows, of hexahedra or of one tetrahedron of 4 or 10 nodes: heddle_mesh_files_writer 8|4|10
// VTU MSH
#include <string>

#include "relax/mesh_files.hpp"
#include "weave/results.hpp"

relax::VolumeMesh mesh_of(const std::string& nodes) {
  relax::VolumeMesh mesh;
  if (nodes == "8") return relax::box_mesh({0.5, 0, 0}, {2, 1, 0.5}, {3, 2, 2});
  mesh.high = {1, 1, 1};
  mesh.shape = relax::ElementShape::tetrahedron;
  mesh.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.nodes = {0, 1, 2, 3};
  relax::make_all_matrix(mesh);
  return nodes == "4" ? mesh : relax::with_middle_nodes(mesh);
}

int main(int argc, char** argv) {
  if (argc != 4) return 1;
  relax::VolumeMesh mesh = mesh_of(argv[1]);
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
  weave::write_text_file(argv[2], relax::vtu_text(mesh));
  weave::write_text_file(argv[3], relax::gmsh_text(mesh));
}
