#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <limits>
#include <numbers>

#include "scenes/posed_fibers.hpp"
#include "weave/yarn_turning.hpp"

namespace {

using namespace scenes;
constexpr double mu = 0.3, d = 1e-4;
constexpr double overlap = 0.03;  ///< of the fibers of a yarn, in diameters

/// A yarn of seven straight fibers along x, six around one, a little pressed.
Scene pressed_yarn() {
  Scene scene = empty_scene(glass_fiber(0.5 * d));
  scene.model.friction = mu;
  for (int k = 0; k < 7; ++k) {
    const double angle = k * std::numbers::pi / 3, r = k == 6 ? 0 : (1 - overlap) * d;
    std::vector<Vec3> x;
    for (int i = 0; i <= 10; ++i) x.emplace_back((i - 5) * d, r * std::cos(angle), r * std::sin(angle));
    weave::FiberSpec fiber = chain_through(x);
    fiber.place = k;
    add(scene, fiber);
  }
  return scene;
}

template <typename Motion>
std::vector<Vec3> moved(const std::vector<Vec3>& x, Motion&& motion) {
  std::vector<Vec3> y;
  for (const Vec3& p : x) y.push_back(motion(p));
  return y;
}

double largest(const std::vector<Vec3>& forces) {
  double most = 0;
  for (const Vec3& f : forces) most = std::max(most, f.norm());
  return most;
}

TEST(yarn_turning, rate_is_that_of_a_rigid_motion) {
  const Scene scene = pressed_yarn();
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Vec3(0.3, -0.5, 0.8).normalized()).toRotationMatrix();
  const Vec3 rate(100, -200, 300), velocity(3, 2, 1);
  const std::vector<Vec3> x = moved(scene.state.x, [&](const Vec3& p) { return Vec3(turn * p); });
  const std::vector<Vec3> v = moved(x, [&](const Vec3& p) { return Vec3(velocity + rate.cross(p)); });
  weave::YarnTurning turning(scene.model);
  turning.align(scene.model, x, std::numeric_limits<double>::infinity());
  ASSERT_TRUE(turning.is_first(0));
  turning.find(scene.model, 0, x, v);
  for (const double r : turning.rate()) EXPECT_NEAR(r, rate.dot(turn * Vec3::UnitX()), 1e-10 * rate.norm());
}

TEST(yarn_turning, what_is_stored_does_not_turn) {
  const Scene scene = pressed_yarn();
  const std::vector<Vec3> v = moved(scene.state.x, [](const Vec3& p) { return Vec3(Vec3(100, 0, 0).cross(p)); });
  weave::YarnTurning turning(scene.model);
  turning.align(scene.model, scene.state.x, std::numeric_limits<double>::infinity());
  turning.find(scene.model, 0, scene.state.x, v);
  turning.align(scene.model, scene.state.x, 0.5 * d);
  turning.find(scene.model, 0, scene.state.x, v);
  for (std::size_t p = 0; p < scene.model.nodes(); ++p) {
    if (scene.state.x[p].x() > 0.5 * d) {
      EXPECT_EQ(turning.rate()[p], 0);
    } else {
      EXPECT_NEAR(turning.rate()[p], 100, 1e-8);
    }
  }
}

TEST(yarn_turning, couples_have_a_moment_and_no_resultant) {
  const Scene scene = pressed_yarn();
  weave::YarnTurning turning(scene.model);
  turning.align(scene.model, scene.state.x, std::numeric_limits<double>::infinity());
  turning.find(scene.model, 0, scene.state.x, scene.state.v);
  for (double& c : turning.couple()) c = 1;
  std::vector<Vec3> force(scene.model.nodes(), Vec3::Zero());
  for (std::uint32_t f = 0; f < 7; ++f) turning.add_forces(f, scene.state.x, force);
  Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
  for (std::size_t p = 0; p < force.size(); ++p) {
    sum += force[p];
    moment += scene.state.x[p].cross(force[p]);
  }
  const double nodes = static_cast<double>(force.size());
  EXPECT_LT(sum.norm(), 1e-12 * nodes / d);
  EXPECT_LT((moment - nodes * Vec3::UnitX()).norm(), 1e-12 * nodes);
}

TEST(yarn_turning, friction_does_not_notice_a_yarn_that_turns) {
  const Scene scene = pressed_yarn();
  PosedFibers yarn(scene, 40 * d);
  yarn.move_to(scene.state.x);
  const double pressed = largest(yarn.force());
  const Vec3 axis = Vec3(0.9, -0.2, 0.3).normalized();
  const int n = 4000;
  for (int i = 1; i <= n; ++i) {
    const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0 * i / n, axis).toRotationMatrix();
    yarn.move_to(moved(scene.state.x, [&](const Vec3& p) { return Vec3(turn * p); }));
  }
  // A turn by w in a step about a slanting axis, read at its end, looks like a slip of w^2 d: 5e-4 d in all; held, the fibers would slip by
  // 2 d.
  EXPECT_LT(yarn.ledger().friction_store + yarn.ledger().flows.slip, 1e-4 * yarn.ledger().contact);
  EXPECT_NEAR(largest(yarn.force()), pressed, 1e-3 * pressed);
}

TEST(yarn_turning, friction_resists_a_section_that_changes_its_shape) {
  const Scene scene = pressed_yarn();
  PosedFibers yarn(scene, 40 * d);
  const double strain = 0.02;
  const int n = 2000;
  const auto flattened = [&](double e) {
    return moved(scene.state.x, [&](const Vec3& p) { return Vec3(p.x(), p.y() * (1 + e), p.z() * (1 - e)); });
  };
  for (int i = 0; i <= n; ++i) yarn.move_to(flattened(strain * i / n));
  const double there = yarn.work();
  for (int i = n; i >= 0; --i) yarn.move_to(flattened(strain * i / n));
  EXPECT_GT(there, 0);
  // What the hand put in is lost or still stored in the springs: the couples on the sections do their part of the work.
  const double lost = yarn.ledger().flows.slip;
  EXPECT_GT(lost, 0.01 * yarn.ledger().contact);
  EXPECT_NEAR(yarn.work(), lost + yarn.ledger().friction_store, 1e-4 * yarn.ledger().contact);
}

TEST(yarn_turning, keeps_momentum_and_energy) {
  Scene scene = pressed_yarn();
  scene.options.time_step = 2e-9;
  // Flattens while it turns and flies.
  for (std::size_t p = 0; p < scene.state.x.size(); ++p) {
    const Vec3& x = scene.state.x[p];
    scene.state.v[p] = Vec3(1, 2, 3) + 2e4 * Vec3(0, x.y(), -x.z()) + 1e4 * Vec3::UnitX().cross(x);
  }
  weave::Engine engine = scene.engine();
  const weave::Drive drive = at_rest(scene.model);
  weave::Ledger ledger;
  const Momentum before = momentum(engine);
  engine.step(drive, &ledger);
  const double start = ledger.balance(), scale = ledger.kinetic + ledger.contact;
  while (engine.state().time < 1e-5) ASSERT_EQ(engine.step(drive, &ledger).status, weave::StepStatus::ok);
  EXPECT_GT(ledger.flows.slip, 1e-3 * scale);
  EXPECT_NEAR(ledger.balance(), start, 1e-4 * scale);
  const Momentum after = momentum(engine);
  EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
  EXPECT_LT((after.angular - before.angular).norm(), 1e-7 * before.angular.norm());  // exact for parallel fibers; these end bent
}

/// By how much the outer two of three fibers piled up between plates of bars part as a reed presses on the pile along -x by `depth` [m];
/// friction on the plates and between the three. Or the upper fiber is held, slides along itself at `along` [m/s], and the reed is the
/// lower plate.
double spread_of_pile(double on_plates, double within, double depth, double along = 0) {
  const bool drags = along != 0;
  weave::FiberType type = glass_fiber(0.5 * d);
  type.friction_within = within;
  Scene scene = empty_scene(type);
  scene.model.friction = on_plates;
  scene.model.damping = 2e4;
  const double height = std::sqrt(0.75) * d;
  const int bars = 6;
  for (const bool above : {true, false}) {
    if (above && drags) continue;
    for (int i = 0; i <= bars; ++i) {
      const Vec3 middle(above ? height + d : -d, (i - 0.5 * bars) * d, 0);
      weave::FiberSpec bar = chain_through({middle - 5 * d * Vec3::UnitZ(), middle + 5 * d * Vec3::UnitZ()}, above ? -1 : i);
      bar.role = above || drags ? weave::Role::reed : weave::Role::warp;
      bar.hold_all = true;
      add(scene, bar);
    }
  }
  for (int k = 0; k < 3; ++k) {
    std::vector<Vec3> x;
    for (int i = 0; i <= bars; ++i) x.emplace_back(k == 2 ? height : 0, (i - 0.5 * bars) * d, (k == 0 ? -0.5 : k == 1 ? 0.5 : 0) * d);
    weave::FiberSpec fiber = chain_through(x, 100);
    fiber.role = weave::Role::weft;
    fiber.place = k;
    fiber.hold_all = k == 2 && drags;
    add(scene, fiber);
  }
  weave::Engine engine = scene.engine();
  weave::Drive drive = at_rest(scene.model);
  const double speed = 0.01;
  drive.reed_velocity = (drags ? speed : -speed) * Vec3::UnitX();
  drive.held_velocity = along * Vec3::UnitY();
  while (engine.state().time < depth / speed) EXPECT_EQ(engine.step(drive).status, weave::StepStatus::ok);
  const std::size_t plates = drags ? 1 : 2;
  const std::uint32_t left = engine.model().first[plates * (bars + 1)], right = engine.model().first[plates * (bars + 1) + 1];
  return engine.state().x[right + bars / 2].z() - engine.state().x[left + bars / 2].z() - d;
}

TEST(yarn_turning, a_pile_of_three_holds_from_coulombs_limit_on) {
  // Pushed by a force at 30 degrees from the vertical and held by friction there and on the plate: tan 15 degrees = 0.268 (of rods that do
  // not turn as of rods that roll). Below it the pile collapses, by 2 sqrt(3) of the depth at first; above it gives way as its contacts do.
  const double depth = 0.05 * d, collapse = 2 * std::sqrt(3) * depth;
  EXPECT_GT(spread_of_pile(0.25, 0.25, depth), 0.6 * collapse);
  EXPECT_LT(spread_of_pile(0.3, 0.3, depth), 0.2 * collapse);
}

TEST(yarn_turning, a_pile_holds_by_the_friction_within_its_yarn) {
  // As above with two coefficients: sin 30 = within cos 30 + on_plates (cos 30 + within sin 30), which is within = 0.338 at 0.2 on the
  // plates.
  const double depth = 0.05 * d, collapse = 2 * std::sqrt(3) * depth;
  EXPECT_GT(spread_of_pile(0.2, 0.31, depth), 0.6 * collapse);
  EXPECT_LT(spread_of_pile(0.2, 0.37, depth), 0.2 * collapse);
}

TEST(yarn_turning, friction_within_a_yarn_beyond_that_between_yarns_holds_across_whatever_slides_along) {
  // The upper fiber, pressed by P at an angle of a = 30 degrees, drags at those below it with 0.2 P. The plate presses with
  // N = P (cos a + g sin a), g what friction within has beyond 0.2, and holds them along, so that 0.2 N (1 - (P/N)^2)^(1/2) is left of it
  // across; the pile holds from sin a = g cos a + 0.2 (N^2/P^2 - 1)^(1/2) on: g = 0.471.
  const double depth = 0.05 * d, collapse = 2 * std::sqrt(3) * depth;
  EXPECT_GT(spread_of_pile(0.2, 0.63, depth, 0.1), 0.6 * collapse);
  EXPECT_LT(spread_of_pile(0.2, 0.72, depth, 0.1), 0.2 * collapse);
}

}  // namespace
