// Two ways to make the surfaces of yarns, measured on one relaxed cell: outlines of sections joined along the yarn (relax::make_envelopes),
// and the alpha wrap (Portaneri, Rouxel-Labbe, Hemmer, Cohen-Steiner & Alliez 2022) of the fibers' tubes, clipped by the cell's faces.
//     heddle_envelope_methods FILE
// Prints a row of a Markdown table for each setting. The surface's distance is measured from the same points for all of them: where a ball
// of two fiber diameters touches the fibers.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/clip.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/alpha_wrap_3.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "relax/envelope.hpp"
#include "relax/surface_file.hpp"
#include "rings.hpp"
#include "surface_check.hpp"
#include "surface_distance.hpp"
#include "touch_distance.hpp"
#include "triangle_crossings.hpp"
#include "weave/results.hpp"
#include "yarn_fibers.hpp"
#include "yarn_side.hpp"

namespace {

using relax::Vec3;
namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

/// The cell, and what all surfaces are measured by.
struct Scene {
  weave::Snapshot cell;
  relax::Lattice lattice;
  std::vector<relax::YarnFibers> yarns;
  std::vector<relax::Rings> rings;  ///< by yarn; where the ball touches the fibers
  double diameter = 0;              ///< of the fibers [m]
  double ball_radius = 0;           ///< [m]
  double fiber_space = 0;           ///< union of the fibers [m^3]
};

/// Surface of a yarn; its first triangles are the side, the others lie on the faces of the cell.
struct Surface {
  relax::SurfaceMesh mesh;
  std::size_t side_triangles = 0;
};

/// What a construction gives at one setting.
struct Made {
  std::string name;
  std::vector<Surface> surfaces;  ///< by yarn
  double seconds = 0;
  std::string of_it;  ///< how long a stage of it took
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Before and after yarns that cross are moved apart; the caps join the same points both times.
std::array<Made, 2> join_sections(const Scene& scene, const relax::EnvelopeOptions& options) {
  const relax::Envelopes envelopes = relax::make_envelopes(scene.cell, options);
  const relax::EnvelopeWall& wall = envelopes.wall;
  const std::string name = fmt::format("sections, edges {} d", options.edge_length);
  Made before{name, {}, wall.sections + wall.caps, ""};
  Made after{name + ", moved apart", {}, before.seconds + wall.separation, fmt::format(", moving apart {:.2f}", wall.separation)};
  for (std::size_t y = 0; y < scene.yarns.size(); ++y) {
    const relax::YarnEnvelope& e = envelopes.yarns[y];
    const relax::YarnSide side = relax::join_rings(scene.yarns[y], relax::ring_yarn(scene.yarns[y], options));
    before.surfaces.push_back({{side.all(), e.surface.triangles}, e.side_triangles});
    after.surfaces.push_back({e.surface, e.side_triangles});
  }
  return {std::move(before), std::move(after)};
}

/// Points of a fiber from `margin` [m] before its first face to as far beyond its last one.
std::vector<Vec3> extended(const relax::YarnFibers& yarn, std::size_t fiber, double margin) {
  const double more = margin / yarn.length[fiber];
  std::vector<Vec3> x = {yarn.at(fiber, -more)};
  const auto add = [&](const Vec3& p) {
    if ((p - x.back()).norm() > 1e-3 * yarn.radius[fiber]) x.push_back(p);
  };
  const auto add_fiber = [&](std::size_t f, int periods) {
    for (std::size_t i = 0; i < yarn.points[f].size(); ++i) {
      const double share = periods + yarn.share[f][i];
      if (share > -more && share < 1 + more) add(yarn.points[f][i] + periods * yarn.period);
    }
  };
  add_fiber(yarn.previous[fiber], -1);
  add_fiber(fiber, 0);
  add_fiber(yarn.next[fiber], 1);
  add(yarn.at(fiber, 1 + more));
  return x;
}

struct Soup {
  std::vector<Kernel::Point_3> points;
  std::vector<std::array<std::size_t, 3>> triangles;
};

/// A prism around a fiber, closed at both ends, that touches it with the middles of its sides.
void add_tube(const std::vector<Vec3>& x, double radius, Soup& soup) {
  constexpr std::size_t corners = 16;
  const double corner_radius = radius / std::cos(std::numbers::pi / corners);
  const std::size_t first = soup.points.size(), last = first + (x.size() - 1) * corners;
  const auto add_point = [&](const Vec3& p) { soup.points.emplace_back(p.x(), p.y(), p.z()); };
  const auto direction = [&](std::size_t i) -> Vec3 { return (x[i + 1] - x[i]).normalized(); };
  Vec3 u = direction(0).unitOrthogonal();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Vec3 along = (direction(i > 0 ? i - 1 : 0) + direction(std::min(i, x.size() - 2))).normalized();
    u = (u - u.dot(along) * along).normalized();
    const Vec3 v = along.cross(u);
    for (std::size_t c = 0; c < corners; ++c) {
      const double angle = 2 * std::numbers::pi * static_cast<double>(c) / corners;
      add_point(x[i] + corner_radius * (std::cos(angle) * u + std::sin(angle) * v));
    }
  }
  add_point(x.front());
  add_point(x.back());
  for (std::size_t c = 0; c < corners; ++c) {
    const std::size_t next = (c + 1) % corners;
    for (std::size_t ring = first; ring < last; ring += corners) {
      soup.triangles.push_back({ring + c, ring + next, ring + corners + next});
      soup.triangles.push_back({ring + c, ring + corners + next, ring + corners + c});
    }
    soup.triangles.push_back({soup.points.size() - 2, first + next, first + c});
    soup.triangles.push_back({soup.points.size() - 1, last + c, last + next});
  }
}

/// On which of the two faces that a yarn runs through all corners of a triangle lie: 0, 1, or -1 if on none.
int face_of(const relax::YarnFibers& yarn, const std::array<Vec3, 3>& corners) {
  const double tolerance = 1e-6 * yarn.radius.front();
  const double faces[] = {yarn.first_face, yarn.last_face};
  for (const int face : {0, 1}) {
    if (std::ranges::all_of(corners, [&](const Vec3& x) { return std::abs(x[yarn.axis()] - faces[face]) < tolerance; })) return face;
  }
  return -1;
}

Surface surface_of(const relax::YarnFibers& yarn, const Mesh& mesh) {
  Surface surface;
  std::map<Mesh::Vertex_index, std::uint32_t> index;
  for (const auto v : mesh.vertices()) {
    const Kernel::Point_3& p = mesh.point(v);
    index[v] = static_cast<std::uint32_t>(surface.mesh.points.size());
    surface.mesh.points.emplace_back(p.x(), p.y(), p.z());
  }
  std::vector<std::array<std::uint32_t, 3>> caps;
  for (const auto f : mesh.faces()) {
    std::array<std::uint32_t, 3> t{};
    std::array<Vec3, 3> corners;
    std::size_t c = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) {
      t[c] = index.at(v);
      corners[c++] = surface.mesh.points[index.at(v)];
    }
    (face_of(yarn, corners) < 0 ? surface.mesh.triangles : caps).push_back(t);
  }
  surface.side_triangles = surface.mesh.triangles.size();
  surface.mesh.triangles.insert(surface.mesh.triangles.end(), caps.begin(), caps.end());
  return surface;
}

/// `alpha`, `offset`: in fiber diameters.
Made wrap_fibers(const Scene& scene, double alpha, double offset) {
  Made made{fmt::format("wrap, alpha {} d, offset {} d", alpha, offset), {}, 0, ""};
  double clipping = 0;
  for (const relax::YarnFibers& yarn : scene.yarns) {
    const auto start = std::chrono::steady_clock::now();
    Soup soup;
    // The ball that carves the wrap reaches as far as its radius past the tubes' ends.
    for (std::size_t f = 0; f < yarn.size(); ++f) add_tube(extended(yarn, f, (alpha + 1) * scene.diameter), yarn.radius[f], soup);
    Mesh mesh;
    CGAL::alpha_wrap_3(soup.points, soup.triangles, alpha * scene.diameter, offset * scene.diameter, mesh);
    const double wrapped = seconds_since(start);
    const double along_x = yarn.weft ? 0 : 1, along_y = 1 - along_x;
    for (const Kernel::Plane_3& face :
         {Kernel::Plane_3(-along_x, -along_y, 0, yarn.first_face), Kernel::Plane_3(along_x, along_y, 0, -yarn.last_face)}) {
      if (!pmp::clip(mesh, face, CGAL::parameters::clip_volume(true))) throw std::runtime_error("the wrap can not be clipped");
    }
    mesh.collect_garbage();
    const double clipped = seconds_since(start);
    made.seconds += clipped;
    clipping += clipped - wrapped;
    made.surfaces.push_back(surface_of(yarn, mesh));
  }
  made.of_it = fmt::format(", clipping {:.2f}", clipping);
  return made;
}

std::size_t count_crossings(const Scene& scene, const std::vector<Surface>& surfaces) {
  std::vector<relax::YarnEnvelope> envelopes(surfaces.size());
  for (std::size_t y = 0; y < surfaces.size(); ++y) {
    envelopes[y].weft = scene.yarns[y].weft;
    envelopes[y].surface = surfaces[y].mesh;
  }
  return relax::find_crossings(envelopes, scene.lattice).size();
}

/// How the caps of a surface fit the faces of the cell and one another.
struct Fit {
  double off_face = 0;  ///< largest distance of a cap's point from its face [m]
  double apart = 0;     ///< largest distance of an outline's point from the outline on the opposite face [m]
  bool matches = true;  ///< each point of an outline has its image on the opposite one, exactly
};

Fit fit_faces(const relax::YarnFibers& yarn, const Surface& surface) {
  const std::vector<Vec3>& x = surface.mesh.points;
  const double faces[] = {yarn.first_face, yarn.last_face};
  Fit fit;
  std::array<std::map<std::pair<std::uint32_t, std::uint32_t>, int>, 2> edges;
  for (std::size_t i = surface.side_triangles; i < surface.mesh.triangles.size(); ++i) {
    const auto& t = surface.mesh.triangles[i];
    const int face = face_of(yarn, {x[t[0]], x[t[1]], x[t[2]]});
    for (std::size_t c = 0; c < 3; ++c) {
      fit.off_face = std::max(fit.off_face, std::abs(x[t[c]][yarn.axis()] - faces[face]));
      ++edges[face][std::minmax(t[c], t[(c + 1) % 3])];
    }
  }
  // Both in the first face; a side of an outline is a triangle of no width.
  std::array<std::vector<std::array<Vec3, 3>>, 2> outlines;
  std::array<std::vector<Vec3>, 2> points;
  for (const int face : {0, 1}) {
    const auto in_face = [&](std::uint32_t p) {
      Vec3 moved = x[p];
      moved[yarn.axis()] = yarn.first_face;
      return moved;
    };
    for (const auto& [edge, triangles] : edges[face]) {
      if (triangles > 1) continue;
      const Vec3 a = in_face(edge.first), b = in_face(edge.second);
      outlines[face].push_back({a, b, b});
      points[face].insert(points[face].end(), {a, b});
    }
  }
  for (const int face : {0, 1}) {
    const relax::SurfaceDistance opposite(outlines[1 - face]);
    for (const Vec3& p : points[face]) {
      fit.apart = std::max(fit.apart, opposite.from(p, yarn.period.norm()));
      fit.matches = fit.matches && std::ranges::find(points[1 - face], p) != points[1 - face].end();
    }
  }
  return fit;
}

void print_row(const Scene& scene, const Made& made) {
  const double radius = 0.5 * scene.diameter;
  relax::TouchDistance touch;
  Fit fit;
  bool closed = true;
  std::size_t triangles = 0, self_intersections = 0;
  double volume = 0;
  for (std::size_t y = 0; y < made.surfaces.size(); ++y) {
    const Surface& s = made.surfaces[y];
    triangles += s.mesh.triangles.size();
    volume += relax::enclosed_volume(s.mesh);
    const relax::SurfaceState state = relax::check_surface(s.mesh);
    closed = closed && state.closed;
    self_intersections += state.self_intersections;
    const relax::TouchDistance t = relax::measure_touch(scene.yarns[y], scene.rings[y], s.mesh, s.side_triangles, scene.ball_radius);
    touch.sum += t.sum;
    touch.count += t.count;
    touch.largest = std::max(touch.largest, t.largest);
    touch.protrusion = std::max(touch.protrusion, t.protrusion);
    const Fit f = fit_faces(scene.yarns[y], s);
    fit.off_face = std::max(fit.off_face, f.off_face);
    fit.apart = std::max(fit.apart, f.apart);
    fit.matches = fit.matches && f.matches;
  }
  fmt::print("| {} | {:.2f}{} | {} | {:.3f}, {:.3f} | {:.3f} | {:.3f} | {}, {} | {} | {} | {:.2g} m |\n", made.name, made.seconds,
             made.of_it, triangles, touch.sum / static_cast<double>(touch.count), touch.largest, touch.protrusion,
             volume / scene.fiber_space, closed ? "yes" : "no", self_intersections, count_crossings(scene, made.surfaces),
             fit.matches ? "exactly" : fmt::format("no, {:.2f}", fit.apart / radius), fit.off_face);
  std::fflush(stdout);
}

Scene set_scene(const std::string& file) {
  Scene scene;
  scene.cell = weave::on_axis(weave::read_results(file).snapshot);
  scene.lattice = {scene.cell.x_max - scene.cell.x_min, scene.cell.cell_width};
  scene.yarns = relax::periodic_yarns(scene.cell).yarns;
  scene.diameter = 2 * scene.yarns.front().radius.front();
  const relax::EnvelopeOptions options;
  scene.ball_radius = options.ball_radius * scene.diameter;
  for (const relax::YarnFibers& yarn : scene.yarns) scene.rings.push_back(relax::ring_yarn(yarn, options));
  for (const relax::YarnEnvelope& e : relax::make_envelopes(scene.cell, options).yarns) scene.fiber_space += e.fiber_space;
  return scene;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: heddle_envelope_methods FILE");
  const Scene scene = set_scene(argv[1]);
  fmt::print("d: fiber diameter; distances in fiber radii\n\n");
  fmt::print(
      "| construction | wall time [s] | triangles | distance from the fibers, mean, largest | protrusion | volume over the union of "
      "the fibers | closed, self-intersections | mutual intersections | opposite faces match | off the faces |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  for (const double edge : {0.8, 0.4, 0.2, 0.1}) {
    relax::EnvelopeOptions options;
    options.edge_length = edge;
    for (const Made& made : join_sections(scene, options)) print_row(scene, made);
  }
  for (const auto& [alpha, offset] : {std::pair(2.0, 0.1), {1.0, 0.1}, {0.5, 0.1}, {0.5, 0.025}, {0.25, 0.1}, {0.25, 0.025}})
    print_row(scene, wrap_fibers(scene, alpha, offset));
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
