#include <gtest/gtest.h>

#include <algorithm>

#include "fit_faces.hpp"
#include "relax/energy.hpp"
#include "relax/woven_start.hpp"
#include "scenes/cells.hpp"
#include "unit/synthetic_cloth.hpp"

namespace {

using namespace scenes;
using weave::Vec3;

constexpr double d = 1e-4;  ///< fiber diameter [m]
constexpr double pitch = 6e-4;

/// A woven plain weave by formula, and its case.
struct Woven {
  weave::Case c = plain_weave({.fibers = 7, .pitch = pitch});
  weave::Snapshot cloth = weave::make_synthetic_cloth({.pitch = pitch, .radius = 0.5 * d});
};

TEST(relax_woven, lean_is_sheared_away) {
  Woven w;
  const relax::WovenStart upright = relax::cell_from_woven(w.c, w.cloth, {});
  EXPECT_NEAR(upright.mismatch.lean, 0, 1e-9);
  // The cell leans down and aside along x, warps and wefts alike: the start is the same, to round-off.
  const Vec3 lean(0, 0.7 * d, -2.3 * d);
  for (Vec3& x : w.cloth.x) x += (x.x() - w.cloth.x_min) / w.cloth.cell_length * lean;
  const relax::WovenStart leaning = relax::cell_from_woven(w.c, w.cloth, {});
  EXPECT_NEAR(leaning.mismatch.lean, lean.norm() / d, 1e-9);
  EXPECT_NEAR(leaning.mismatch.mean, upright.mismatch.mean, 1e-9);
  ASSERT_EQ(leaning.x.size(), upright.x.size());
  double apart = 0, stretch = 0;
  for (std::size_t i = 0; i < upright.x.size(); ++i) {
    apart = std::max(apart, (leaning.x[i] - upright.x[i]).norm());
    stretch = std::max(stretch, std::abs(leaning.cell.rest_length[i] / upright.cell.rest_length[i] - 1));
  }
  EXPECT_LT(apart, 1e-9 * d);
  EXPECT_LT(stretch, 1e-9);
}

TEST(relax_woven, warps_keep_their_height_however_long_the_elements) {
  const Woven w;
  const weave::Snapshot axes = weave::on_axis(w.cloth);
  const auto begin = axes.x.begin() + axes.offset[0], end = axes.x.begin() + axes.offset[1];
  const auto [low, high] = std::minmax_element(begin, end, [](const Vec3& a, const Vec3& b) { return a.z() < b.z(); });
  for (const double element_length : {0.5, 1.0, 2.0, 3.0}) {  // of a wave of 12 diameters: points taken as nodes lose a quarter of it at 3
    SCOPED_TRACE(element_length);
    relax::WovenOptions options;
    options.element_length = element_length;
    const relax::WovenStart start = relax::cell_from_woven(w.c, w.cloth, options);
    const Eigen::VectorXd q = relax::unknowns_at(start.cell, start.x);
    double top = -1, bottom = 1;
    for (std::uint32_t i = 0; i < start.cell.first[1]; ++i) {
      for (int k = 0; k < 16; ++k) {
        const double z = relax::axis_point(start.cell, q, i, k / 16.0).z();
        top = std::max(top, z);
        bottom = std::min(bottom, z);
      }
    }
    EXPECT_NEAR((top - bottom) / (high->z() - low->z()), 1, 0.03);
  }
}

TEST(relax_woven, bars_keep_their_tension_where_a_fiber_is_closed) {
  // A warp that ends 1.5 d above its start becomes longer as it is closed, by far more than its tension stretches it.
  Woven w;
  for (std::size_t f = 0; f < 7; ++f) {
    const auto begin = w.cloth.offset[f], end = w.cloth.offset[f + 1];
    for (auto p = begin; p < end; ++p)
      w.cloth.x[static_cast<std::size_t>(p)].z() += 1.5 * d * static_cast<double>(p - begin) / static_cast<double>(end - begin - 1);
  }
  const auto [least, largest] = std::minmax_element(w.cloth.tension.begin(), w.cloth.tension.end());
  const relax::WovenStart start = relax::cell_from_woven(w.c, w.cloth, {});
  EXPECT_GT(start.mismatch.largest, 0.5);
  for (const double t : relax::bar_tensions(start.cell, relax::Unknowns(start.cell), relax::unknowns_at(start.cell, start.x))) {
    EXPECT_GE(t, (1 - 1e-6) * *least);  // round-off of a strain of 1e-4 at least
    EXPECT_LE(t, (1 + 1e-6) * *largest);
  }
}

/// How the warps of a steady cloth go on: as they do a period before.
weave::Continuation as_before(const weave::Snapshot& cloth) {
  weave::Continuation beyond;
  beyond.length = pitch;
  beyond.offset = {0};
  for (std::size_t f = 0; f < cloth.fibers(); ++f) {
    for (auto p = cloth.offset[f]; !cloth.weft[f] && cloth.x[p].x() < cloth.x_min + 1.01 * pitch; ++p) {
      beyond.x.push_back(cloth.x[p] + Vec3(cloth.cell_length, 0, 0));
      beyond.tension.push_back(cloth.tension[p]);
      beyond.arc.push_back(cloth.arc[p] - cloth.arc[cloth.offset[f]]);
    }
    beyond.offset.push_back(static_cast<std::int64_t>(beyond.x.size()));
  }
  return beyond;
}

TEST(relax_woven, warps_take_the_paths_beyond_the_last_face_behind_the_first) {
  Woven w;
  w.cloth.beyond = as_before(w.cloth);
  const weave::Snapshot steady = weave::on_axis(w.cloth), kept = relax::fit_faces(w.cloth);
  for (std::size_t p = 0; p < steady.x.size(); ++p) EXPECT_LT((kept.x[p] - steady.x[p]).norm(), 1e-3 * d) << p;

  // The column before the cell lay otherwise: one warp comes higher out of it, one lower, and all have other tensions.
  for (std::size_t f = 0; f < w.cloth.fibers(); ++f) {
    for (auto p = w.cloth.offset[f]; !w.cloth.weft[f] && p < w.cloth.offset[f + 1]; ++p) {
      const double way = (w.cloth.x[p].x() - w.cloth.x_min) / pitch;
      if (way >= 1) continue;
      w.cloth.x[p].z() += (w.cloth.yarn[f] == 0 ? 1.5 : -1.5) * d * (1 - way);
      w.cloth.tension[p] *= 2;
    }
  }
  const weave::Snapshot cut = weave::on_axis(w.cloth), fitted = relax::fit_faces(w.cloth);
  for (std::size_t f = 0; f < cut.fibers(); ++f) {
    for (auto p = cut.offset[f]; p < cut.offset[f + 1]; ++p) {
      const double way = cut.weft[f] ? 1 : (cut.x[p].x() - cut.x_min) / pitch;
      SCOPED_TRACE(way);
      if (way < 0.3) {
        EXPECT_LT((fitted.x[p] - steady.x[p]).norm(), 0.02 * d);
        EXPECT_NEAR(fitted.tension[p] / steady.tension[p], 1, 0.02);
      } else if (way > 0.8) {
        EXPECT_EQ(fitted.x[p], cut.x[p]);
        EXPECT_EQ(fitted.tension[p], cut.tension[p]);
      }
    }
  }
  // The start tells how far apart the faces were, and lies as before where they are.
  const relax::WovenStart start = relax::cell_from_woven(w.c, w.cloth, {});
  EXPECT_NEAR(start.mismatch.largest, 1.5, 0.1);  // fibers begin up to 0.06 pitches before the face
  w.cloth.beyond = {};
  EXPECT_EQ(relax::fit_faces(w.cloth).x, cut.x);
}

TEST(relax_woven, strain_is_that_of_the_bar_under_its_tension) {
  const weave::FiberType type{5e-5, 6e-9, 1e9, 1e-4, 1e9, 2000, 0};
  const double width = 1e-3;
  for (const double strain : {-3e-3, -1e-3, -0.7e-3, 0.0, 0.4e-3, 1e-3, 2e-3}) {
    relax::Cell cell = empty_cell(8 * d, 8 * d);
    cell.types[0] = type;
    cell.slack_strain = width;
    relax::CellFiber fiber = straight_fiber(cell, false, {0, 0, 0}, 4, 0, 0);
    for (double& l : fiber.rest_length) l /= 1 + strain;
    std::vector<Vec3> x;
    relax::add_fiber(cell, fiber, x);
    for (const double t : relax::bar_tensions(cell, relax::Unknowns(cell), relax::unknowns_at(cell, x)))
      EXPECT_NEAR(relax::strain_under(type, t, width), strain, 1e-12);
  }
}

}  // namespace
