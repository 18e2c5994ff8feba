#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "relax/surface_mesh.hpp"
#include "weave/snapshot.hpp"

namespace relax {

/// A yarn's section by a plane across its path.
struct YarnSection {
  double arc = 0;                    ///< along the path of the fibers' centroid from the first face [m]
  Vec3 centroid = Vec3::Zero();      ///< of the outline's area [m]
  Vec3 normal = Vec3::Zero();        ///< of the plane, along the yarn
  Vec3 lateral = Vec3::Zero();       ///< unit vector in the plane that rotation is counted from: nearest to y for a warp, to -x for a weft
  double width = 0, height = 0;      ///< extent along and across the longer principal axis of the outline's area [m]
  double rotation = 0;               ///< of that axis from `lateral` towards normal x lateral, -pi/2 ... pi/2 [rad]
  double area = 0;                   ///< within the outline [m^2]
  double fiber_volume_fraction = 0;  ///< solid area of the fibers / area
};

/// The rotation of successive sections without its steps of pi: the axis of a section points both ways [rad].
std::vector<double> continuous_rotation(const std::vector<YarnSection>& sections);

/// Surface of one yarn over one period: rings of points around its fibers, one ring for each section, joined by triangles and capped flat
/// on the two faces of the cell that it runs through. It holds the yarn whole, also where that lies across the other pair of faces.
struct YarnEnvelope {
  int yarn = 0;  ///< as in weave::Snapshot
  bool weft = false;
  SurfaceMesh surface;  ///< closed; flat on the two faces normal to its period

  std::uint32_t ring_points = 0;  ///< point j of ring k is surface.points[k * ring_points + j]
  std::uint32_t rings =
      0;  ///< the last is the first moved by `period`, its points counted from another one where the yarn turns around itself
  std::uint32_t side_triangles =
      0;                       ///< the first ones of surface.triangles; then the first face's cap, then the last one's, of the same number
  Vec3 period = Vec3::Zero();  ///< from the first face to the last [m]
  std::vector<YarnSection> sections;  ///< of the rings

  double ball_radius = 0;   ///< largest radius of the ball that was rolled around a section [m]
  double fiber_volume = 0;  ///< solid [m^3]
  double fiber_space = 0;   ///< union of the fibers' cylinders [m^3]
  double volume = 0;        ///< within the surface [m^3]
  double volume_moved = 0;  ///< that the yarn gave up when yarns were moved apart [m^3]
};

/// Lengths in diameters of the yarn's fibers.
struct EnvelopeOptions {
  double edge_length = 0.4;  ///< around a section
  double edge_length_m = 0;  ///< in place of edge_length [m]; 0: none given
  double ring_distance = 0;  ///< along the yarn; 0: two edge lengths, at most 1
  double ball_radius = 2;    ///< rolled around the fibers; grown where it would leave them in several parts
  double gap = 0.05;         ///< least distance between yarns
  double tolerance = 0;      ///< largest distance_max of the report, for which edges and ring distance are shortened [fiber radii]; 0: any
};

/// Throws std::invalid_argument for values out of bounds. diameter: the smallest of the fibers [m]; 0 if it is not known.
void check_options(const EnvelopeOptions& options, double diameter);

/// How surfaces and fibers fit one another.
struct EnvelopeReport {
  bool closed = true;                    ///< each one, manifold and with normals that point outward
  std::size_t self_intersections = 0;    ///< pairs of triangles of one surface that cross
  std::size_t mutual_intersections = 0;  ///< of two surfaces, periodic images among them
  double periodic_mismatch = 0;          ///< largest distance of a point of a last ring from its image on the first [m]
  double gap_min = 0;        ///< least distance between two surfaces, where that is below twice the gap asked for, else this [m]
  double distance_mean = 0;  ///< from where the ball touched fibers to the surface, in fiber radii
  double distance_max = 0;
  Vec3 distance_max_at = Vec3::Zero();  ///< [m]
  std::size_t distance_max_yarn = 0;    ///< index in Envelopes::yarns
  double protrusion_max = 0;            ///< of such a point out of the surface, in fiber radii
};

/// How long the stages took [s].
struct EnvelopeWall {
  double sections = 0, separation = 0, caps = 0, check = 0, distance = 0;
};

struct Envelopes {
  std::vector<YarnEnvelope> yarns;  ///< warps by rising number, then wefts
  EnvelopeOptions options;          ///< with the lengths that were needed for the tolerance
  EnvelopeReport report;
  EnvelopeWall wall;
  weave::Snapshot fibers;    ///< that the surfaces hold: those of the cell made periodic, from face to face; without tensions
  double lean = 0;           ///< length of the vector that the cell leaned by and was sheared back, in fiber diameters
  double intrusion = 0;      ///< how far the surface of a fiber lay within another yarn before these were moved apart, in fiber diameters
  double stray_share = 0;    ///< of the fibers of a yarn, at most: left outside of its surface where yarns are intermixed
  double face_mismatch = 0;  ///< largest distance of fibers that were joined across the faces, in fiber diameters
};

/// Surfaces of all yarns of a unit cell, disjoint from one another and from their periodic images.
///
/// Each section is the outline that a ball rolled around the fibers leaves: arcs on the fibers, joined by arcs of the ball. Rings are
/// evenly spaced along the path of the fibers' centroid, on planes across it, which turn parallel to the faces near these. Where surfaces
/// of two yarns come nearer than the gap, points of both are moved apart; where yarns are intermixed by more than half a diameter, both
/// surfaces first go back to where the fibers of both are as dense, so that single fibers may come to lie partly outside.
///
/// The faces of a relaxed cell are moved to where its warps run level, if one climbs steeply where it crosses them.
/// A cell whose fibers do not meet across its faces, as a woven one, is sheared upright and what is left spread along each fiber.
/// Throws std::invalid_argument if the snapshot is not of a unit cell or not periodic, or an option is out of bounds; std::runtime_error
/// where a fiber has left its yarn, two yarns are intermixed so that a fiftieth of a yarn's fibers would lie outside of its surface, or the
/// fibers allow none within the tolerance, as where yarns press one another. The messages name yarns and fiber, place and size.
Envelopes make_envelopes(const weave::Snapshot& cell, const EnvelopeOptions& options);

/// The summary as JSON text, keys with units. `blocked_by`: what keeps a relaxed cell from being a certified minimum, else empty; wall time
/// [s].
std::string envelope_summary_json(const weave::Snapshot& cell, const EnvelopeOptions& options, const Envelopes& envelopes,
                                  const std::string& case_name, const std::string& blocked_by, double wall);

}  // namespace relax
