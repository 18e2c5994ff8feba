#include "relax/envelope.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "rings.hpp"
#include "scenes/bundles.hpp"
#include "separate.hpp"
#include "surface_check.hpp"
#include "yarn_fibers.hpp"
#include "yarn_side.hpp"

namespace relax {
namespace {

using std::numbers::pi;
using testing::AllOf;
using testing::HasSubstr;

constexpr double radius = 5e-5, diameter = 2 * radius;  // [m]

/// Mutual and self-intersections, closedness, faces.
void expect_sound(const Envelopes& envelopes, const weave::Snapshot& cell) {
  EXPECT_TRUE(envelopes.report.closed);
  EXPECT_EQ(envelopes.report.self_intersections, 0U);
  EXPECT_EQ(envelopes.report.mutual_intersections, 0U);
  EXPECT_LE(envelopes.report.periodic_mismatch, 1e-18);  // rounding of the period [m]
  for (const YarnEnvelope& e : envelopes.yarns) {
    const int axis = e.weft ? 1 : 0;
    const double first = e.weft ? 0 : cell.x_min, last = e.weft ? cell.cell_width : cell.x_max;
    // As sets, the points of the two faces are the same to the last bit.
    std::set<std::pair<double, double>> on_first, on_last;
    for (const Vec3& x : e.surface.points) {
      if (x[axis] == first) on_first.emplace(x[1 - axis], x.z());
      if (x[axis] == last) on_last.emplace(x[1 - axis], x.z());
      EXPECT_GE(x[axis], first);
      EXPECT_LE(x[axis], last);
    }
    EXPECT_EQ(on_first.size(), e.ring_points);
    EXPECT_EQ(on_first, on_last);
  }
}

/// Area within the outline of a hexagon of k rings of fibers, as truth/outline_test.cpp has it [m^2].
double rolled_area(int k, double ball) {
  const double b = ball / radius, half = std::asin(1 / (1 + b)), height = std::sqrt((1 + b) * (1 + b) - 1);
  return radius * radius * (6 * std::sqrt(3.0) * k * k + 6.0 * k * (height - b * b * half + half) + pi);
}

TEST(Envelope, StraightHexagonalYarns) {
  for (const int rings : {1, 2}) {
    for (const bool weft : {false, true}) {
      weave::Snapshot cell = scenes::empty_unit_cell(1.3e-3, 1.7e-3);
      scenes::add_bundle(cell, {.yarn = 3, .weft = weft, .side = 6e-4, .places = scenes::hexagon(rings)});
      const EnvelopeOptions options{.edge_length = 0.05, .ring_distance = 2};
      const Envelopes envelopes = make_envelopes(cell, options);
      expect_sound(envelopes, cell);
      ASSERT_EQ(envelopes.yarns.size(), 1U);
      const YarnEnvelope& e = envelopes.yarns[0];
      EXPECT_EQ(e.yarn, 3);
      EXPECT_EQ(e.weft, weft);
      const double area = rolled_area(rings, 2 * diameter), length = weft ? cell.cell_width : cell.cell_length;
      // Chords of length h miss at most h^2 / 12 per length of an arc of radius 1.
      const double h = 0.05 * diameter, missed = e.ring_points * h * h * h / 12 / radius;
      for (const YarnSection& s : e.sections) EXPECT_NEAR(s.area, area, missed);
      EXPECT_NEAR(e.volume, e.sections[0].area * length, 1e-12 * e.volume);  // a prism; rounding
      EXPECT_NEAR(e.fiber_space, e.fiber_volume, 1e-9 * e.fiber_volume);     // fibers touch and are solid
      EXPECT_NEAR(e.sections[0].fiber_volume_fraction, e.fiber_volume / e.volume, 1e-9);
      EXPECT_NEAR(e.sections.back().arc, length, 1e-12);
      // A hexagon with sides along u: 2 k + 1 fibers wide, k rows of sqrt(3) radii and one diameter high; a principal axis of a hexagon is
      // any.
      EXPECT_LE(e.sections[0].width, (4 * rings + 2) * radius * (1 + 1e-9));
      EXPECT_NEAR(envelopes.report.distance_max, 0, h * h / (8 * radius) / radius * 1.01);  // the sagitta, in radii
    }
  }
}

TEST(Envelope, KeepsAYarnWholeAcrossTheOtherFaces) {
  // A warp that lies on the face y = 0 has the surface of one that does not, moved.
  double volume[2];
  for (const int place : {0, 1}) {
    weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 1e-3);
    scenes::add_bundle(cell, {.side = place == 0 ? 0.0 : 5e-4, .places = scenes::hexagon(1)});
    const Envelopes envelopes = make_envelopes(cell, {});
    expect_sound(envelopes, cell);
    volume[place] = envelopes.yarns[0].volume;
  }
  EXPECT_NEAR(volume[0], volume[1], 1e-9 * volume[0]);  // rounding of the places
}

TEST(Envelope, TwistedYarnGoesOnInItsFibers) {
  // A turn by 60 degrees carries a hexagon of seven into itself with every outer fiber in its neighbor's place.
  weave::Snapshot cell = scenes::empty_unit_cell(3e-3, 1e-3);
  scenes::add_bundle(cell, {.side = 5e-4, .places = scenes::hexagon(1), .twist = pi / 3, .nodes = 60});
  const Envelopes envelopes = make_envelopes(cell, {.edge_length = 0.1, .ring_distance = 0.5});
  expect_sound(envelopes, cell);
  EXPECT_LT(envelopes.face_mismatch, 1e-9);  // the set of fibers on both faces is the same
  // Outer fibers slant by 2 radius (pi / 3) / length = 0.035: sections stretch by 6e-4.
  EXPECT_NEAR(envelopes.yarns[0].volume, rolled_area(1, 2 * diameter) * cell.cell_length, 2e-3 * envelopes.yarns[0].volume);
  // Chords of a twist of 0.017 rad from ring to ring and of 0.1 diameters around: below a hundredth of a radius.
  EXPECT_LT(envelopes.report.distance_max, 0.02);
}

TEST(Envelope, FacesLieWhereWarpsRunLevel) {
  // A warp on a sine wave that climbs by 62 degrees at the faces given, and a quarter of the period later not at all.
  for (const double height : {3e-4, 1e-4}) {
    SCOPED_TRACE(height);
    weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 1e-3);
    scenes::add_bundle(
        cell,
        {.side = 5e-4, .height = [=](double along) { return height * std::sin(2 * pi * along / 1e-3); }, .places = {{0, 0}}, .nodes = 64});
    const Envelopes envelopes = make_envelopes(cell, {});
    EXPECT_NEAR(envelopes.fibers.x_min - cell.x_min, height > 2e-4 ? 2.5e-4 : 0, 1e-12);
    EXPECT_DOUBLE_EQ(envelopes.fibers.x_max - envelopes.fibers.x_min, 1e-3);
    expect_sound(envelopes, envelopes.fibers);
  }
}

TEST(Envelope, RibbonTurnsOver) {
  // Half a turn carries a row of fibers into itself, each point of its outline to the far side.
  weave::Snapshot cell = scenes::empty_unit_cell(8e-3, 2e-3);
  std::vector<Eigen::Vector2d> row;
  for (int i = -3; i <= 3; ++i) row.emplace_back(2 * i, 0);
  scenes::add_bundle(cell, {.side = 1e-3, .places = row, .twist = pi, .nodes = 160});
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  EXPECT_LT(envelopes.face_mismatch, 1e-9);
  const YarnEnvelope& e = envelopes.yarns[0];
  for (const YarnSection& s : e.sections) {
    // Outer fibers slant by 6 radius pi / length = 0.12, which stretches them by 0.7 % across the row.
    EXPECT_NEAR(s.width, 14 * radius, 0.02 * 14 * radius);
    EXPECT_NEAR(std::abs(std::sin(s.rotation - pi * s.arc / 8e-3)), 0, 0.03);
  }
  const std::vector<double> rotation = continuous_rotation(e.sections);
  for (std::size_t i = 0; i < rotation.size(); ++i) EXPECT_NEAR(rotation[i] - rotation[0], pi * e.sections[i].arc / 8e-3, 0.06) << i;
}

/// A warp and a weft that cross, their fibers overlapping by a share of a diameter.
weave::Snapshot crossing_yarns(double overlap) {
  weave::Snapshot cell = scenes::empty_unit_cell(1.2e-3, 1.2e-3);
  const double height = (2 * std::sqrt(3.0) + 2) * radius - overlap * diameter;  // between centers: two rows of hexagons
  scenes::add_bundle(cell, {.yarn = 0, .side = 6e-4, .places = scenes::hexagon(1)});
  scenes::add_bundle(cell, {.yarn = 1, .weft = true, .side = 6e-4, .height = [=](double) { return height; }, .places = scenes::hexagon(1)});
  return cell;
}

TEST(Envelope, OverlappingYarnsAreMovedApartToTheGap) {
  for (const double gap : {0.05, 0.1}) {
    const weave::Snapshot cell = crossing_yarns(0.2);
    const Envelopes envelopes = make_envelopes(cell, {.gap = gap});
    expect_sound(envelopes, cell);
    // Points move little farther than they must.
    EXPECT_GE(envelopes.report.gap_min, gap * diameter);
    EXPECT_LE(envelopes.report.gap_min, 1.05 * gap * diameter);
    EXPECT_NEAR(envelopes.intrusion, 0.2, 0.02);  // of fibers that lie even with the other's outline, to its chords
    // Each gives way by half of overlap and gap, chords aside.
    EXPECT_NEAR(envelopes.report.protrusion_max, 0.2 + gap, 0.1);
    for (const YarnEnvelope& e : envelopes.yarns) EXPECT_GT(e.volume_moved, 0);
    EXPECT_NEAR(envelopes.yarns[0].volume_moved, envelopes.yarns[1].volume_moved, 0.05 * envelopes.yarns[0].volume_moved);
  }
}

TEST(Envelope, EdgesAreShortenedToATolerance) {
  weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 1e-3);
  scenes::add_bundle(cell, {.side = 5e-4, .places = scenes::hexagon(1)});
  const double tolerance = 0.005;  // a sixteenth of the sagitta of the default's edges, 0.8 radii
  for (const double edge_length_m : {0.0, 0.6 * diameter}) {
    const Envelopes envelopes = make_envelopes(cell, {.edge_length_m = edge_length_m, .tolerance = tolerance});
    expect_sound(envelopes, cell);
    EXPECT_LE(envelopes.report.distance_max, tolerance);
    EXPECT_GE(envelopes.report.distance_max, 0.25 * tolerance);  // no finer than it must
  }
  EXPECT_EQ(make_envelopes(cell, {.tolerance = 0.5}).options.edge_length, EnvelopeOptions{}.edge_length);
}

TEST(Envelope, ToleranceBelowWhatTheFibersAllowIsNamed) {
  const weave::Snapshot cell = crossing_yarns(0.2);  // each gives way by half of overlap and gap, 0.25 radii
  EXPECT_LE(make_envelopes(cell, {.tolerance = 0.35}).report.distance_max, 0.35);
  try {
    make_envelopes(cell, {.tolerance = 0.1});
    FAIL() << "surfaces nearer to overlapping fibers than these allow";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("tolerance of 0.1 fiber radii: the surface of w"),
                                HasSubstr("fiber radii from its fibers at (0."), HasSubstr("yarns are moved apart")));
  }
}

TEST(Envelope, YarnsApartStayAsTheyAre) {
  const weave::Snapshot cell = crossing_yarns(-0.2);
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  for (const YarnEnvelope& e : envelopes.yarns) EXPECT_EQ(e.volume_moved, 0);
}

TEST(Envelope, ImagesOfAYarnAreMovedApart) {
  // A warp as wide as the cell touches its own images.
  weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 6 * radius - 0.1 * diameter);
  scenes::add_bundle(cell, {.side = 1e-4, .places = scenes::hexagon(1)});
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  EXPECT_GE(envelopes.report.gap_min, 0.05 * diameter);
  EXPECT_GT(envelopes.yarns[0].volume_moved, 0);
}

TEST(Envelope, IntermixedYarnsAreNamed) {
  // Two warps side by side: the first's fiber on the right has changed places with the second's middle one.
  weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 2e-3);
  std::vector<Eigen::Vector2d> left = scenes::hexagon(1), right = left;
  for (Eigen::Vector2d& place : right) place.x() += 6;
  std::swap(left[4], right[3]);
  scenes::add_bundle(cell, {.yarn = 0, .side = 5e-4, .places = left});
  scenes::add_bundle(cell, {.yarn = 1, .side = 5e-4, .places = right});
  try {
    make_envelopes(cell, {});
    FAIL() << "disjoint surfaces of intermixed yarns";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("warp 0"), HasSubstr("warp 1"), HasSubstr("intermixed"), HasSubstr("fiber diameters at (")));
  }
}

TEST(Envelope, AYarnThatNestsInAnotherHasItsOwnSurface) {
  // Five fibers in the shape of a U, and a fiber of another warp in it, on which its other fibers lie: the ball spans the U.
  weave::Snapshot cell = scenes::empty_unit_cell(1e-3, 2e-3);
  scenes::add_bundle(cell, {.yarn = 0, .side = 1e-3, .places = {{-2.1, 0}, {0, 0}, {2.1, 0}, {-2.1, 2}, {2.1, 2}}});
  scenes::add_bundle(cell, {.yarn = 1, .side = 1e-3, .places = {{0, 2}, {0, 4}, {-1.5, 5.4}, {1.5, 5.4}}});
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  EXPECT_GT(envelopes.intrusion, 0.75);
  EXPECT_EQ(envelopes.stray_share, 0);
  EXPECT_GE(envelopes.report.gap_min, 0.05 * diameter);
  EXPECT_LT(envelopes.report.protrusion_max, 1);  // no fiber's axis lies outside of its own surface
}

TEST(Envelope, AFiberThatStraysIntoAnotherYarnForAWhileIsLeftThere) {
  // Two warps side by side; over a tenth of the cell the first's fiber on the right lies where the second's middle one does.
  weave::Snapshot cell = scenes::empty_unit_cell(6e-3, 2e-3);
  std::vector<Eigen::Vector2d> right = scenes::hexagon(1);
  for (Eigen::Vector2d& place : right) place.x() += 6;
  scenes::add_bundle(cell, {.yarn = 0, .side = 5e-4, .places = scenes::hexagon(1), .nodes = 120});
  scenes::add_bundle(cell, {.yarn = 1, .side = 5e-4, .places = right, .nodes = 120});
  std::size_t stray = 0;
  const auto start_of = [&](std::size_t fiber) { return cell.x[static_cast<std::size_t>(cell.offset[fiber])].y(); };
  for (std::size_t f = 1; f < 7; ++f)
    if (start_of(f) > start_of(stray)) stray = f;
  for (auto i = static_cast<std::size_t>(cell.offset[stray]); i < static_cast<std::size_t>(cell.offset[stray + 1]); ++i) {
    const double way = (cell.x[i].x() - 3e-3) / 3e-4;
    cell.x[i].y() += 3 * radius * std::exp(-way * way);
  }
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  EXPECT_GT(envelopes.intrusion, 1);
  EXPECT_GT(envelopes.stray_share, 0);
  EXPECT_LT(envelopes.stray_share, 0.1 / 7);  // one of its 7 fibers, over a tenth of its length at most
  EXPECT_GT(envelopes.report.protrusion_max, 1);
}

/// A straight warp's side over eight rings 0.5 diameters apart; section: counterclockwise along the warp (y, z) [diameters].
YarnSide straight_side(const std::vector<Eigen::Vector2d>& section) {
  YarnFibers yarn;
  yarn.period = Vec3(4 * diameter, 0, 0);
  yarn.last_face = 4 * diameter;
  yarn.radius = {radius};
  Rings rings;
  rings.stations.resize(8);
  rings.points = section.size();
  for (std::size_t k = 0; k < rings.rings(); ++k)
    for (const Eigen::Vector2d& p : section) rings.x.push_back(diameter * Vec3(0.5 * static_cast<double>(k), p.x(), p.y()));
  return join_rings(yarn, rings);
}

TEST(Envelope, WhatLiesBesideABladeIsOutside) {
  // The triangles above the blade's edge are twenty times as large as those below: a normal that is their mean points up.
  const YarnSide blade = straight_side({{0, 0}, {-4, 0.7}, {-4, -0.7}, {-0.2, -0.035}});
  const Lattice lattice{4 * diameter, 20 * diameter};
  const auto overlaps_at = [&](double y, double z) {
    const YarnSide probe = straight_side({{y + 0.01, z}, {y, z + 0.01}, {y - 0.01, z}, {y, z - 0.01}});
    return find_overlaps({blade, probe}, lattice).size();
  };
  for (const double angle : {-1.3, -0.8, 0.0, 0.8, 1.3}) EXPECT_EQ(overlaps_at(0.7 * std::cos(angle), 0.7 * std::sin(angle)), 0U) << angle;
  EXPECT_EQ(overlaps_at(-3, 0.3), 32U);  // all points of the probe
}

/// A warp of seven fibers of which the last bends away from the others by `radii` in the middle of the cell.
weave::Snapshot straying_fiber(double radii) {
  weave::Snapshot cell = scenes::empty_unit_cell(6e-3, 6e-3);
  scenes::add_bundle(cell, {.yarn = 4, .side = 3e-3, .places = scenes::hexagon(1), .nodes = 120});
  const auto first = static_cast<std::size_t>(cell.offset[6]);
  for (std::size_t i = first; i < cell.x.size(); ++i)
    cell.x[i].y() += 0.5 * radii * radius * (1 - std::cos(2 * pi * cell.x[i].x() / cell.cell_length));
  return cell;
}

TEST(Envelope, FiberThatLeavesItsYarnIsNamed) {
  const weave::Snapshot near = straying_fiber(8);
  expect_sound(make_envelopes(near, {}), near);
  // From (1, sqrt 3) to (17, sqrt 3) radii, the nearest fiber at (2, 0).
  try {
    make_envelopes(straying_fiber(16), {.ring_distance = 1});  // 60 rings, of which one lies in the middle
    FAIL() << "a surface around a fiber that has left its yarn";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("fiber 6 of warp 4 leaves its yarn: at (3, 3.85, 0.0866) mm"),
                                HasSubstr(fmt::format("{:.3g} fiber diameters away", (std::sqrt(15.0 * 15.0 + 3) - 2) / 2))));
  }
}

TEST(Envelope, CellThatIsNotPeriodicIsNamed) {
  weave::Snapshot cell = scenes::empty_unit_cell(2e-3, 2e-3);
  scenes::add_bundle(cell, {.yarn = 2, .weft = true, .side = 1e-3, .places = scenes::hexagon(1)});
  cell.x.back().z() += 12 * diameter;
  try {
    make_envelopes(cell, {});
    FAIL() << "a cell that is not periodic";
  } catch (const std::invalid_argument& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("not periodic"), HasSubstr("fiber 6 of weft 2 ends at (0.95, 2, 1.287) mm"),
                                HasSubstr("12 fiber diameters from where")));
  }
}

/// Plain weave of hexagonal yarns whose paths follow cosines.
weave::Snapshot plain_weave(double pitch, double amplitude) {
  weave::Snapshot cell = scenes::empty_unit_cell(2 * pitch, 2 * pitch);
  for (const bool weft : {false, true})
    for (const int i : {0, 1}) {
      const double sign = (i == 0) != weft ? amplitude : -amplitude;
      scenes::add_bundle(cell, {.yarn = i + (weft ? 2 : 0),
                                .weft = weft,
                                .side = (i + 0.5) * pitch,
                                .height = [=](double along) { return sign * std::sin(pi * along / pitch); },
                                .places = scenes::hexagon(1),
                                .nodes = 32});
    }
  return cell;
}

TEST(Envelope, PlainWeave) {
  const weave::Snapshot cell = plain_weave(1e-3, 1.3e-4);
  const Envelopes envelopes = make_envelopes(cell, {});
  expect_sound(envelopes, cell);
  ASSERT_EQ(envelopes.yarns.size(), 4U);
  // By symmetry all yarns are alike but for how they are cut into triangles.
  for (const YarnEnvelope& e : envelopes.yarns) EXPECT_NEAR(e.volume, envelopes.yarns[0].volume, 0.01 * e.volume);
}

TEST(Envelope, AnotherStartOfTheCellGivesTheSameYarns) {
  // The wefts' fibers may start anywhere: moved by part of a period they are cut at the same faces.
  weave::Snapshot cell = plain_weave(1e-3, 1.3e-4), moved = cell;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    if (!cell.weft[f]) continue;
    const auto begin = static_cast<std::size_t>(cell.offset[f]), end = static_cast<std::size_t>(cell.offset[f + 1]);
    const std::size_t nodes = end - begin - 1, by = 5 + f % 3;
    for (std::size_t i = 0; i <= nodes; ++i)
      moved.x[begin + i] = cell.x[begin + (i + by) % nodes] + Vec3(0, static_cast<double>((i + by) / nodes) * cell.cell_width, 0);
  }
  const Envelopes a = make_envelopes(cell, {}), b = make_envelopes(moved, {});
  for (std::size_t y = 0; y < a.yarns.size(); ++y) {
    ASSERT_EQ(a.yarns[y].surface.points.size(), b.yarns[y].surface.points.size());
    EXPECT_NEAR(a.yarns[y].volume, b.yarns[y].volume, 1e-6 * a.yarns[y].volume);  // rounding, carried through the moving apart
  }
}

TEST(Envelope, RefusesBadInput) {
  const weave::Snapshot cell = plain_weave(1e-3, 1.3e-4);
  EXPECT_THROW(make_envelopes(cell, {.edge_length = 0}), std::invalid_argument);
  EXPECT_THROW(make_envelopes(cell, {.ball_radius = NAN}), std::invalid_argument);
  EXPECT_THROW(make_envelopes(cell, {.gap = 2}), std::invalid_argument);
  EXPECT_THROW(make_envelopes(cell, {.tolerance = -1}), std::invalid_argument);
  weave::Snapshot loom = cell, holed = cell;
  loom.cell_length = 0;
  EXPECT_THROW(make_envelopes(loom, {}), std::invalid_argument);
  EXPECT_THROW(make_envelopes(scenes::empty_unit_cell(1e-3, 1e-3), {}), std::invalid_argument);
  holed.x[3].z() = NAN;
  EXPECT_THROW(make_envelopes(holed, {}), std::invalid_argument);
}

SurfaceMesh tetrahedron(const Vec3& at) {
  return {{at, at + Vec3::UnitX(), at + Vec3::UnitY(), at + Vec3::UnitZ()}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

TEST(SurfaceCheck, SeesHolesWrongSidesAndCrossings) {
  const SurfaceMesh good = tetrahedron(Vec3::Zero());
  EXPECT_TRUE(check_surface(good).closed);
  EXPECT_EQ(check_surface(good).self_intersections, 0U);
  SurfaceMesh open = good, inward = good, crossing = good;
  open.triangles.pop_back();
  EXPECT_FALSE(check_surface(open).closed);
  for (auto& t : inward.triangles) std::swap(t[1], t[2]);
  EXPECT_FALSE(check_surface(inward).closed);
  const SurfaceMesh other = tetrahedron(Vec3(0.1, 0.1, -0.3));
  for (const auto& t : other.triangles) crossing.triangles.push_back({t[0] + 4, t[1] + 4, t[2] + 4});
  crossing.points.insert(crossing.points.end(), other.points.begin(), other.points.end());
  EXPECT_GT(check_surface(crossing).self_intersections, 0U);
}

}  // namespace
}  // namespace relax
