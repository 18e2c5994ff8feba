#include "relax/deck.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <iterator>

#include "relax/version.hpp"

namespace relax {
namespace {

constexpr double mm = 1e3, mega_pascal = 1e-6;
constexpr std::array<const char*, 6> strain_names = {"xx", "yy", "zz", "yz", "xz", "xy"};

class Writer {
 public:
  template <typename... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<Args>(args)...);
    text_ += '\n';
  }
  /// Numbers from 1, sixteen a line.
  void numbers(const std::vector<std::uint32_t>& from_zero) {
    for (std::size_t i = 0; i < from_zero.size(); ++i) {
      fmt::format_to(std::back_inserter(text_), "{}", from_zero[i] + 1);
      text_ += (i + 1) % 16 == 0 || i + 1 == from_zero.size() ? "\n" : ", ";
    }
  }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

void write_mesh(Writer& w, const VolumeMesh& mesh) {
  w.line("*NODE");  // all in one block: some readers keep but the last
  for (std::size_t i = 0; i < mesh.points.size(); ++i) {
    const Vec3 x = mm * mesh.points[i];
    w.line("{}, {:.12e}, {:.12e}, {:.12e}", i + 1, x.x(), x.y(), x.z());
  }
  const std::size_t n = mesh.points.size();
  w.line("{}, 0., 0., 0.\n{}, 0., 0., 0.", n + 1, n + 2);
  w.line("*NSET, NSET=ALL_NODES, GENERATE\n1, {}, 1", n);
  w.line("*NSET, NSET=STRAIN_NORMAL\n{}\n*NSET, NSET=STRAIN_SHEAR\n{}", n + 1, n + 2);
  w.line("*ELEMENT, TYPE=C3D{}, ELSET=ALL_ELEMENTS", nodes_of(mesh.shape));
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    std::string nodes;
    for (const std::uint32_t node : mesh.element(i)) nodes += fmt::format(", {}", node + 1);
    w.line("{}{}", i + 1, nodes);
  }
}

/// Element and node sets of the elements for which `wanted` holds; nothing if there are none.
template <typename Wanted>
void write_sets(Writer& w, const VolumeMesh& mesh, const std::string& name, bool with_nodes, Wanted wanted) {
  std::vector<std::uint32_t> elements, nodes;
  for (std::uint32_t i = 0; i < mesh.elements(); ++i)
    if (wanted(i)) {
      elements.push_back(i);
      const auto of_element = mesh.element(i);
      if (with_nodes) nodes.insert(nodes.end(), of_element.begin(), of_element.end());
    }
  if (elements.empty()) return;
  w.line("*ELSET, ELSET={}", name);
  w.numbers(elements);
  if (!with_nodes) return;
  std::sort(nodes.begin(), nodes.end());
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  w.line("*NSET, NSET=NODES_{}", name);
  w.numbers(nodes);
}

void write_axes(Writer& w, const VolumeMesh& mesh, DeckProgram program) {
  if (program == DeckProgram::abaqus) {
    w.line("*DISTRIBUTION TABLE, NAME=AXES_TABLE\nCOORD3D, COORD3D");
    w.line("*DISTRIBUTION, NAME=FIBER_AXES, LOCATION=ELEMENT, TABLE=AXES_TABLE");
  } else {
    w.line("*DISTRIBUTION, NAME=FIBER_AXES");
  }
  w.line(", 1., 0., 0., 0., 1., 0.");
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    if (mesh.yarn[i] < 0) continue;
    const Vec3 a = mesh.direction[i], b = a.unitOrthogonal();
    w.line("{}, {:.11f}, {:.11f}, {:.11f}, {:.11f}, {:.11f}, {:.11f}", i + 1, a.x(), a.y(), a.z(), b.x(), b.y(), b.z());
  }
  w.line("*ORIENTATION, NAME=FIBER_DIRECTION, SYSTEM=RECTANGULAR\nFIBER_AXES");
  if (program == DeckProgram::abaqus) w.line("3, 0.");
}

void write_materials(Writer& w, const Constituents& c, const MaterialBins& bins) {
  const bool has_matrix = std::any_of(bins.bin.begin(), bins.bin.end(), [](std::int32_t b) { return b < 0; });
  if (has_matrix) {
    w.line("*MATERIAL, NAME=RESIN\n*ELASTIC\n{:.9e}, {:.9f}", c.matrix_e * mega_pascal, c.matrix_nu);
    w.line("*SOLID SECTION, ELSET=MATRIX, MATERIAL=RESIN");
  }
  for (std::size_t b = 0; b < bins.material.size(); ++b) {
    const TransverseIsotropic& m = bins.material[b];
    w.line("** local fiber volume fraction {:.4f}", bins.volume_fraction[b]);
    w.line("*MATERIAL, NAME=YARN_FRACTION_{}\n*ELASTIC, TYPE=ENGINEERING CONSTANTS", b + 1);
    w.line("{0:.9e}, {1:.9e}, {1:.9e}, {2:.9f}, {2:.9f}, {3:.9f}, {4:.9e}, {4:.9e}\n{5:.9e}", m.e1 * mega_pascal, m.e2 * mega_pascal,
           m.nu12, m.nu23, m.g12 * mega_pascal, m.g23() * mega_pascal);
    w.line("*SOLID SECTION, ELSET=FRACTION_{0}, MATERIAL=YARN_FRACTION_{0}, ORIENTATION=FIBER_DIRECTION", b + 1);
  }
}

void write_equations(Writer& w, const VolumeMesh& mesh, const PeriodicSets& sets) {
  const std::size_t normal = mesh.points.size() + 1, shear = normal + 1;
  const Vec3 period = mm * (mesh.high - mesh.low);
  w.line("*EQUATION");
  for (const PeriodicPair& pair : sets.pairs) {
    for (int component = 0; component < 3; ++component) {
      std::vector<std::string> terms = {fmt::format("{}, {}, 1.", pair.point + 1, component + 1),
                                        fmt::format("{}, {}, -1.", pair.image + 1, component + 1)};
      for (int axis = component; axis < 3; ++axis) {
        if (!pair.across[static_cast<std::size_t>(axis)]) continue;
        // Shears by the axis that they leave out: yz, xz, xy are the first, second and third component of their node.
        terms.push_back(axis == component ? fmt::format("{}, {}, {:.12e}", normal, axis + 1, -period[axis])
                                          : fmt::format("{}, {}, {:.12e}", shear, 4 - component - axis, -period[axis]));
      }
      w.line("{}", terms.size());
      constexpr std::size_t terms_per_line = 4;
      for (std::size_t t = 0; t < terms.size(); t += terms_per_line)
        w.line("{}", fmt::join(terms.begin() + static_cast<std::ptrdiff_t>(t),
                               terms.begin() + static_cast<std::ptrdiff_t>(std::min(t + terms_per_line, terms.size())), ", "));
    }
  }
}

void write_step(Writer& w, const VolumeMesh& mesh, int strain, const DeckOptions& o) {
  const std::size_t normal = mesh.points.size() + 1;
  w.line("** macroscopic strain {} = 1", strain_names[static_cast<std::size_t>(strain)]);
  if (o.program == DeckProgram::abaqus) {
    w.line("*STEP, NAME=STRAIN_{}, PERTURBATION\n*STATIC", strain_names[static_cast<std::size_t>(strain)]);
  } else {
    w.line("*STEP\n*STATIC");
  }
  w.line("*BOUNDARY");
  for (const int c : load_cases(o.periodic_z)) {
    const std::size_t node = c < 3 ? normal : normal + 1;
    w.line("{0}, {1}, {1}, {2}.", node, c % 3 + 1, c == strain ? 1 : 0);
  }
  if (o.program == DeckProgram::abaqus) {
    w.line("*OUTPUT, FIELD\n*NODE OUTPUT\nU\n*ELEMENT OUTPUT\nS, E");
    w.line("** reaction / cell volume = mean stress\n*NODE PRINT, NSET=STRAIN_NORMAL\nRF\n*NODE PRINT, NSET=STRAIN_SHEAR\nRF");
  } else {
    w.line("*NODE FILE\nU\n*EL FILE\nS, E");
    for (const char axis : {'X', 'Y', 'Z'}) w.line("*NODE PRINT, NSET=HIGH_{}, TOTALS=ONLY\nRF", axis);
  }
  w.line("*END STEP");
}

void write_green_step(Writer& w, const VolumeMesh& mesh, const DeckOptions& o) {
  const std::size_t normal = mesh.points.size() + 1;
  w.line("** displacements of the reference nodes x cell volume = compliance\n*STEP\n*GREEN\n*CLOAD");
  for (const int c : load_cases(o.periodic_z)) w.line("{}, {}, 1.", c < 3 ? normal : normal + 1, c % 3 + 1);
  w.line("*NODE PRINT, NSET=STRAIN_NORMAL\nU\n*NODE PRINT, NSET=STRAIN_SHEAR\nU\n*END STEP");
}

}  // namespace

std::vector<int> load_cases(bool periodic_z) {
  return periodic_z ? std::vector<int>{0, 1, 2, 3, 4, 5} : std::vector<int>{0, 1, 5};
}

std::string deck(const VolumeMesh& mesh, const PeriodicSets& sets, const Constituents& constituents, const MaterialBins& bins,
                 const DeckOptions& options) {
  Writer w;
  w.line("*HEADING\n{}", options.title.empty() ? "Unit cell of a fabric composite" : options.title);
  w.line("** heddle {}; mm, N, MPa", version());
  w.line("** cell volume {:.9e} mm^3", (mesh.high - mesh.low).prod() * mm * mm * mm);
  write_mesh(w, mesh);
  write_sets(w, mesh, "MATRIX", true, [&](std::uint32_t i) { return mesh.yarn[i] < 0; });
  write_sets(w, mesh, "YARNS", false, [&](std::uint32_t i) { return mesh.yarn[i] >= 0; });
  for (std::size_t y = 0; y < mesh.yarns.size(); ++y)
    write_sets(w, mesh, fmt::format("YARN_{}", mesh.yarns[y]), true,
               [&](std::uint32_t i) { return mesh.yarn[i] == static_cast<std::int32_t>(y); });
  for (std::size_t b = 0; b < bins.material.size(); ++b)
    write_sets(w, mesh, fmt::format("FRACTION_{}", b + 1), false,
               [&](std::uint32_t i) { return bins.bin[i] == static_cast<std::int32_t>(b); });
  for (const PointSet& set : sets.sets) {
    w.line("*NSET, NSET={}", set.name);
    w.numbers(set.points);
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    w.line("*NSET, NSET=HIGH_{}", static_cast<char>('X' + axis));
    w.numbers(sets.high[axis]);
  }
  w.line("** {} / {}, {}; bins of volume fraction {:.4g} wide", constituents.fiber_name, constituents.matrix_name,
         constituents.rule == Micromechanics::chamis ? "Chamis 1983" : "Mori-Tanaka", bins.width);
  if (!bins.material.empty()) write_axes(w, mesh, options.program);
  write_materials(w, constituents, bins);
  write_equations(w, mesh, sets);
  w.line("*BOUNDARY\n{}, 1, 3", sets.corner + 1);
  if (options.loads == DeckLoads::green) {
    write_green_step(w, mesh, options);
  } else {
    for (const int strain : load_cases(options.periodic_z)) write_step(w, mesh, strain, options);
  }
  return w.take();
}

}  // namespace relax
