#include "relax/mesh_files.hpp"

#include <fmt/format.h>

#include <bit>
#include <cstring>
#include <iterator>

namespace relax {
namespace {

/// Arrays of an appended block, and the elements of the header that name them.
class Appended {
 public:
  template <typename T>
  std::string array(const std::string& name, int components, const std::vector<T>& values) {
    const std::uint64_t size = values.size() * sizeof(T);
    const std::size_t at = data_.size();
    data_.resize(at + sizeof size + size);
    std::memcpy(data_.data() + at, &size, sizeof size);
    if (size > 0) std::memcpy(data_.data() + at + sizeof size, values.data(), size);
    return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" offset=\"{}\"/>\n", type<T>(),
                       name, components, at);
  }
  [[nodiscard]] const std::string& data() const { return data_; }

 private:
  template <typename T>
  static const char* type() {
    if constexpr (std::is_same_v<T, double>) return "Float64";
    if constexpr (std::is_same_v<T, std::int32_t>) return "Int32";
    if constexpr (std::is_same_v<T, std::int64_t>) return "Int64";
    if constexpr (std::is_same_v<T, std::uint8_t>) return "UInt8";
  }
  std::string data_;
};

template <typename Vectors>
std::vector<double> flat(const Vectors& vectors) {
  std::vector<double> values;
  for (const auto& v : vectors) values.insert(values.end(), v.data(), v.data() + v.size());
  return values;
}

}  // namespace

std::string vtu_text(const VolumeMesh& mesh) {
  static_assert(std::endian::native == std::endian::little, "the header says LittleEndian");
  const std::uint8_t vtk_type = mesh.shape == ElementShape::hexahedron ? 12 : mesh.shape == ElementShape::tetrahedron ? 10 : 24;
  const std::vector<std::int64_t> connectivity(mesh.nodes.begin(), mesh.nodes.end());
  std::vector<std::int64_t> offsets;
  std::vector<std::int32_t> number;
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    offsets.push_back(static_cast<std::int64_t>((i + 1) * static_cast<std::size_t>(nodes_of(mesh.shape))));
    number.push_back(mesh.yarn[i] < 0 ? -1 : mesh.yarns[static_cast<std::size_t>(mesh.yarn[i])]);
  }
  Appended arrays;
  std::string text =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n";
  text += fmt::format("<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", mesh.points.size(), mesh.elements());
  text += "<Points>\n" + arrays.array("Points", 3, flat(mesh.points)) + "</Points>\n<Cells>\n";
  text += arrays.array("connectivity", 1, connectivity) + arrays.array("offsets", 1, offsets);
  text += arrays.array("types", 1, std::vector<std::uint8_t>(mesh.elements(), vtk_type)) + "</Cells>\n<CellData>\n";
  text += arrays.array("YarnIndex", 1, mesh.yarn) + arrays.array("YarnTangent", 3, flat(mesh.yarn_tangent));
  text += arrays.array("Location", 2, flat(mesh.location)) + arrays.array("VolumeFraction", 1, mesh.volume_fraction);
  text += arrays.array("SurfaceDistance", 1, mesh.surface_distance) + arrays.array("Orientation", 3, flat(mesh.direction));
  text += arrays.array("Yarn", 1, number);
  text +=
      "</CellData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_" + arrays.data() + "\n</AppendedData>\n</VTKFile>\n";
  return text;
}

std::string gmsh_text(const VolumeMesh& mesh) {
  const int gmsh_type = mesh.shape == ElementShape::hexahedron ? 5 : mesh.shape == ElementShape::tetrahedron ? 4 : 11;
  std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
  const auto add = [&text]<typename... Args>(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
  };
  // Volume and physical tag 1 is the matrix, 2... the yarns.
  const std::size_t volumes = mesh.yarns.size() + 1;
  std::vector<std::vector<std::size_t>> members(volumes);
  for (std::size_t i = 0; i < mesh.elements(); ++i) members[static_cast<std::size_t>(mesh.yarn[i] + 1)].push_back(i);

  add("$PhysicalNames\n{}\n3 1 \"MATRIX\"\n", volumes);
  for (std::size_t y = 0; y < mesh.yarns.size(); ++y) add("3 {} \"YARN_{}\"\n", y + 2, mesh.yarns[y]);
  add("$EndPhysicalNames\n$Entities\n0 0 0 {}\n", volumes);
  for (std::size_t v = 1; v <= volumes; ++v)
    add("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} 1 {} 0\n", v, mesh.low.x(), mesh.low.y(), mesh.low.z(), mesh.high.x(),
        mesh.high.y(), mesh.high.z(), v);
  add("$EndEntities\n$Nodes\n1 {0} 1 {0}\n3 1 0 {0}\n", mesh.points.size());
  for (std::size_t i = 0; i < mesh.points.size(); ++i) add("{}\n", i + 1);
  for (const Vec3& x : mesh.points) add("{:.17g} {:.17g} {:.17g}\n", x.x(), x.y(), x.z());
  std::size_t blocks = 0;
  for (const auto& m : members) blocks += m.empty() ? 0 : 1;
  add("$EndNodes\n$Elements\n{} {} 1 {}\n", blocks, mesh.elements(), mesh.elements());
  for (std::size_t v = 0; v < volumes; ++v) {
    if (members[v].empty()) continue;
    add("3 {} {} {}\n", v + 1, gmsh_type, members[v].size());
    for (const std::size_t i : members[v]) {
      const auto element = mesh.element(i);
      std::vector<std::uint32_t> n(element.begin(), element.end());
      if (mesh.shape == ElementShape::tetrahedron_10) std::swap(n[8], n[9]);  // Gmsh has the middles of 3-4 and 2-4 in this order
      add("{}", i + 1);
      for (const std::uint32_t node : n) add(" {}", node + 1);
      text += '\n';
    }
  }
  text += "$EndElements\n";
  return text;
}

}  // namespace relax
