#pragma once
#include "scenes/scenes.hpp"

namespace scenes {

/// Thirty fibers that fly through one another with friction, bending and axial damping: everything that a step can do to free fibers.
inline Scene busy_tangle() {
  weave::FiberType type = glass_fiber();
  type.bending_stiffness = 1e-10;
  Scene scene = tangle(type, {.fibers = 30, .bars = 10, .box = 12, .speed = 20, .spin = 3000});
  scene.model.friction = 0.3;
  scene.model.axial_damping = 0.05;
  scene.options.time_step_max = 1e-7;
  return scene;
}

}  // namespace scenes
