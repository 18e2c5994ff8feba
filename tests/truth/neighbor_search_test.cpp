#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;
using weave::Model;

constexpr int images = 12;  ///< looked at on either side

/// Distance of a point from the axis of a fiber shifted by image * period_y: the least of places along each span, and by golden section
/// about it. Spans that are all farther away than `bound` are left out: they lie within half as much again as their places do of their
/// middle.
double distance_to_fiber(const Model& m, const weave::FiberGeometry& g, const Vec3& point, std::uint32_t fiber, int image, double bound) {
  const Vec3 from = point - Vec3(0, image * m.period_y, 0);
  constexpr int places = 8;
  double least = 1e300;
  for (std::uint32_t q = m.first[fiber]; q < m.first[fiber] + m.own_nodes(fiber); ++q) {
    const weave::Span span = g.span(m, fiber, q);
    const Vec3 middle = span.point(0.5 * (span.low + span.high));
    const double half = std::max((span.point(span.low) - middle).norm(), (span.point(span.high) - middle).norm());
    if ((from - middle).norm() > bound + 1.5 * half) continue;
    const auto distance = [&](double u) { return (from - span.point(u)).norm(); };
    const double width = (span.high - span.low) / places;
    double nearest = span.low;
    for (int k = 1; k <= places; ++k) {
      if (const double u = span.low + k * width; distance(u) < distance(nearest)) nearest = u;
    }
    double low = std::max(span.low, nearest - width), high = std::min(span.high, nearest + width);
    constexpr double golden = 0.6180339887498949;
    while (high - low > 1e-7) {
      const double u = high - golden * (high - low), v = low + golden * (high - low);
      (distance(u) < distance(v) ? high : low) = distance(u) < distance(v) ? v : u;
    }
    least = std::min(least, distance(0.5 * (low + high)));
  }
  return least;
}

struct Comparison {
  int touching = 0;
  int nearer = 0;  ///< of these, points that the fiber is nearer to at another place than those in the list
};

/// Compares an engine's list with all pairs of points and fibers: every pair that touches must be in it. A closed fiber's images are one
/// endless chain: its place nearest to a point counts once.
void compare_with_brute_force(const weave::Engine& engine, Comparison& result) {
  const Model& m = engine.model();
  const weave::FiberGeometry g = engine.geometry();
  const int reach_of_images = m.period_y > 0 ? images : 0;

  std::map<std::tuple<std::uint32_t, float, std::uint32_t, int>, std::vector<double>> listed;
  for (const weave::LineContact& c : engine.state().contacts.line) {
    std::uint32_t span = c.span;
    std::int32_t image = c.image;
    const double distance = std::sqrt(walk_to_point(m, g, contact_point(m, g, c), span, image).distance2);
    const std::uint32_t f = m.fiber_of[span];
    listed[{c.node, c.at, f, m.periodic[f] ? 0 : image}].push_back(distance);
  }

  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    for (std::uint32_t b = 0; b < m.fibers(); ++b) {
      if (share_of_points(m, f, b) == 0) continue;  // the pair is in the other's list
      const bool nodes = meets_at_nodes(m, f, b);
      const std::uint32_t end = m.first[f] + m.own_nodes(f);
      for (std::uint32_t p = m.first[f]; p < end; ++p) {
        for (std::uint32_t i = 0; i < (nodes ? 1 : m.points[f]); ++i) {
          weave::LineContact at;
          at.node = p;
          at.at = nodes ? 0 : static_cast<float>((i + 0.5) / m.points[f] - 0.5);
          if (const weave::Span span = g.span(m, f, p); at.at < span.low || at.at > span.high) continue;
          const Vec3 point = contact_point(m, g, at);
          std::map<int, double> by_image;  // a closed fiber has one entry
          for (int k = -reach_of_images; k <= reach_of_images; ++k) {
            if (b == f && (k == 0 || m.periodic[f])) continue;
            const double d = distance_to_fiber(m, g, point, b, k, m.pair_law(f, b).reach);
            const auto [entry, first] = by_image.try_emplace(m.periodic[b] ? 0 : k, d);
            if (!first) entry->second = std::min(entry->second, d);
          }
          for (const auto& [k, d] : by_image) {
            if (d >= m.pair_law(f, b).reach) continue;
            ++result.touching;
            const auto found = listed.find({p, at.at, b, k});
            const std::vector<double> distances = found == listed.end() ? std::vector<double>{} : found->second;
            // A bent fiber may be near at several places; the nearest counts here.
            ASSERT_FALSE(distances.empty()) << "point " << at.at << " of span " << p << " of fiber " << f << ", fiber " << b << ", image "
                                            << k << ", distance " << d;
            const double nearest = *std::min_element(distances.begin(), distances.end());
            result.nearer += nearest > d + 1e-9 * m.types[0].radius;  // a tie within round-off may go to the next bar
          }
        }
      }
    }
  }
}

/// The same for a fresh search. Returns how many touch.
int compare_with_brute_force(const Scene& scene) {
  Comparison result;
  compare_with_brute_force(scene.engine(), result);
  EXPECT_EQ(result.nearer, 0);
  return result.touching;
}

TEST(neighbor_search, finds_what_brute_force_finds_in_a_tangle) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    for (const double bar : {0.5, 1.0, 2.5}) {
      const int bars = static_cast<int>(10 / bar);
      const Scene scene = tangle(glass_fiber(), {.fibers = 25, .bars = bars, .bar_length = bar, .box = 8, .clearance = 0.5, .seed = seed});
      EXPECT_GT(compare_with_brute_force(scene), 10);
    }
  }
}

TEST(neighbor_search, finds_what_brute_force_finds_among_nearly_parallel_fibers) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius;
  std::mt19937_64 random(7);
  Scene scene = empty_scene(type);
  for (int i = 0; i < 5; ++i) {
    for (int k = 0; k < 5; ++k) {
      const Vec3 from = d * Vec3(uniform(random), 0.97 * i, 0.97 * k);
      const Vec3 along = 15 * d * Vec3(1, 0.02 * uniform(random), 0.02 * uniform(random));
      add(scene, chain(from, from + along, 9 + i, 0, 5 * i + k));
    }
  }
  EXPECT_GT(compare_with_brute_force(scene), 300);
}

TEST(neighbor_search, finds_what_brute_force_finds_in_periodic_cells) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    for (const double width : {1.5, 2.2, 5.0, 12.0}) {
      for (const double bar : {0.7, 2.0}) {
        SCOPED_TRACE(testing::Message() << "width " << width << ", bar " << bar << ", seed " << seed);
        const Scene scene = periodic_mesh(type, width * d, 6, 6, bar * d, 2 * d, seed);
        EXPECT_GT(compare_with_brute_force(scene), 10);
      }
    }
  }
}

TEST(neighbor_search, finds_what_brute_force_finds_in_a_plain_weave) {
  Scene scene = plain_weave_cell(glass_fiber(), 2.5, 8);
  for (Vec3& x : scene.state.x) x.z() *= 0.9;  // touching
  EXPECT_GT(compare_with_brute_force(scene), 8);
}

TEST(neighbor_search, finds_every_point_that_touches_a_reed_bar_once) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius, period = 8 * d;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    std::mt19937_64 random(seed);
    Scene scene = empty_scene(type);
    scene.model.period_y = period;
    const int bars = 3, fibers = 12;
    for (int i = 0; i < bars; ++i) {
      auto bar = chain(Vec3(0, i * period / bars, -50 * d), Vec3(0, i * period / bars, 50 * d), 1, 0, -1);
      bar.role = weave::Role::reed;
      bar.hold_all = true;
      add(scene, bar);
    }
    for (int i = 0; i < fibers; ++i) {
      const Vec3 middle = 6 * d * Vec3(0.2 * uniform(random), uniform(random), uniform(random));
      const Vec3 along = 5 * d * Vec3(1, 0.3 * uniform(random), 0.3 * uniform(random));
      add(scene, chain(middle - along, middle + along, 7, 0, i));
    }
    const weave::Engine engine = scene.engine();
    const Model& m = engine.model();
    const weave::FiberGeometry g = engine.geometry();
    int touching = 0;
    for (std::uint32_t f = bars; f < m.fibers(); ++f) {
      for (std::uint32_t p = m.first[f]; p <= m.last(f); ++p) {
        for (std::uint32_t k = 0; k < m.points[f]; ++k) {
          weave::LineContact point;
          point.node = p;
          point.at = static_cast<float>((k + 0.5) / m.points[f] - 0.5);
          if (const weave::Span span = g.span(m, f, p); point.at < span.low || point.at > span.high) continue;
          for (std::uint32_t b = 0; b < bars; ++b) {
            for (int image = -images; image <= images; ++image) {
              const Vec3 shift(0, image * period, 0), x = contact_point(m, g, point);
              if ((x - g.x[m.first[b]] - shift).head<2>().norm() >= m.pair_law(f, b).reach) continue;
              ++touching;
              const auto& listed = engine.state().contacts.on_reed.line;
              EXPECT_EQ(std::count_if(listed.begin(), listed.end(),
                                      [&](const weave::LineContact& c) {
                                        return c.node == p && c.at == point.at && m.fiber_of[c.span] == b && c.image == image;
                                      }),
                        1)
                  << "fiber " << f << ", bar " << b << ", image " << image;
            }
          }
        }
      }
    }
    EXPECT_GT(touching, 3);
  }
}

/// Two tangles far apart, of which one moves and the other hardly does, so that only the first is searched again.
TEST(neighbor_search, keeps_finding_what_brute_force_finds_as_parts_move) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const double d = 1e-4;
    Scene scene = tangle(glass_fiber(), {.fibers = 12, .bars = 8, .box = 6, .speed = 15, .clearance = 1.01, .seed = seed});
    const Scene still = tangle(glass_fiber(), {.fibers = 12, .bars = 8, .box = 4, .speed = 0.1, .clearance = 1.01, .seed = seed + 10});
    for (std::uint32_t f = 0; f < still.model.fibers(); ++f) {
      auto fiber = chain_through({still.state.x.begin() + still.model.first[f], still.state.x.begin() + still.model.first[f + 1]},
                                 static_cast<int>(100 + f));
      for (Vec3& x : fiber.x) x.x() += 40 * d;
      add(scene, fiber, still.state.v[still.model.first[f]]);
    }
    scene.options.time_step = 3e-8;
    scene.options.outer_skin = d;
    weave::Engine engine = scene.engine();
    Comparison result;
    for (int i = 1; i <= 2000; ++i) {
      engine.step(at_rest(scene.model));
      if (i % 100 == 0) compare_with_brute_force(engine, result);
    }
    EXPECT_GT(result.touching, 50);
    // Where a fiber bends so sharply that it comes near at a second place, that is found at the next search.
    EXPECT_LE(result.nearer, result.touching / 100);
    EXPECT_GT(engine.state().searches, 3);
    EXPECT_EQ(engine.state().late_searches, 0);
  }
}

TEST(neighbor_search, is_never_late) {
  Scene scene = tangle(glass_fiber(), {.fibers = 12, .bars = 8, .box = 8, .speed = 10});
  scene.options.time_step = 3e-8;
  weave::Engine engine = scene.engine();
  for (int i = 0; i < 2000; ++i) engine.step(at_rest(scene.model));
  EXPECT_GT(engine.state().searches, 3);
  EXPECT_EQ(engine.state().late_searches, 0);
}

}  // namespace
