#include <gtest/gtest.h>

#include <cmath>

#include "scenes/scenes.hpp"

namespace {

using namespace scenes;

constexpr double bar = 1.0;  // [diameters]

/// Total force of the first fiber's nodes under the node-to-node law, at rest.
Vec3 force_on_first(Scene scene) {
  scene.model.node_contact = true;
  weave::Engine engine = scene.engine();
  engine.step(at_rest(scene.model));
  Vec3 sum = Vec3::Zero();
  for (std::uint32_t p = scene.model.first[0]; p <= scene.model.last(0); ++p) sum += engine.force()[p];
  return sum;
}

TEST(node_contact, parallel_fibers_push_one_another_as_lines_do) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius, overlap = 0.1 * d;
  constexpr int bars = 6;
  Scene scene = empty_scene(type);
  for (const double z : {0.0, d - overlap}) add(scene, chain(Vec3(0, 0, z), Vec3(bars * bar * d, 0, z), bars, 0, z > 0));
  const Vec3 force = force_on_first(scene);
  const double expected = bars * bar * d * scene.model.pair_law(0, 1).line_force(overlap);
  EXPECT_NEAR(force.z(), -expected, 1e-9 * expected);
  EXPECT_NEAR(force.head<2>().norm(), 0, 1e-9 * expected);
}

TEST(node_contact, crossing_fibers_push_by_one_element_where_a_node_lies_on_a_node) {
  const auto type = glass_fiber();
  const double d = 2 * type.radius, overlap = 0.1 * d;
  Scene scene = empty_scene(type);
  add(scene, chain(Vec3(-3 * bar * d, 0, 0), Vec3(3 * bar * d, 0, 0), 6, 0, 0));
  add(scene, chain(Vec3(0, -3 * bar * d, d - overlap), Vec3(0, 3 * bar * d, d - overlap), 6, 0, 1));
  const double expected = bar * d * scene.model.pair_law(0, 1).line_force(overlap);
  EXPECT_NEAR(force_on_first(scene).z(), -expected, 1e-9 * expected);
}

}  // namespace
