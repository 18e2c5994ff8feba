#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "scenes/scenes.hpp"

/// The heddle's guides: they hold the stored warp on the heddle's line and neither swing nor make energy.
namespace {

using scenes::Scene;
using weave::Engine;
using weave::Ledger;
using weave::Vec3;

constexpr double pull = 0.5, rise = 1e-3, stroke_time = 2e-4;

/// A taut warp from its held end to behind a heddle at half its length.
Scene guided_warp() {
  Scene scene = scenes::empty_scene(scenes::glass_fiber());
  weave::FiberSpec warp = scenes::chain(Vec3::Zero(), Vec3(8e-3, 0, 0), 40, 0);
  warp.hold_first = true;
  warp.end_force = pull;
  warp.guide_stiffness = 50 * pull / warp.rest_length.front();
  scenes::add(scene, warp);
  scene.model.guide_x = 4e-3;
  scene.model.guide_ramp = 2e-4;
  scene.options.time_step = 2e-7;
  return scene;
}

TEST(guides, hold_the_stored_warp_on_a_heddle_that_moves) {
  const Scene scene = guided_warp();
  Engine engine = scene.engine();
  weave::Drive drive = scenes::at_rest(scene.model);
  const auto height = [](double time) { return rise * std::pow(std::min(time / stroke_time, 1.0), 2); };
  Ledger first, ledger;
  double off_line = 0, work = 0, residual = 0;
  while (engine.state().time < 4 * stroke_time) {
    const double t = engine.state().time, next = t + engine.state().dt;
    drive.guide_z[0] = height(t);
    drive.guide_speed[0] = (height(next) - height(t)) / (next - t);
    engine.step(drive, t == 0 ? &first : &ledger);
    if (t == 0) continue;
    work = std::max(work, ledger.flows.heddle);
    residual = std::max(residual, std::abs(ledger.balance() - first.balance()));
    if (t < 2 * stroke_time) continue;
    for (std::size_t p = 30; p < engine.state().x.size(); ++p) off_line = std::max(off_line, std::abs(engine.state().x[p].z() - rise));
  }
  EXPECT_LT(off_line, 1e-3 * rise);  // ten bars behind the plane a string on such springs has decayed to exp(-10 sqrt 50)
  EXPECT_GT(work, 0);
  EXPECT_LT(residual, 1e-9 * work);  // all parts of this ledger are exact: no contact and no bending
}

}  // namespace
