#pragma once
#include "scenes/scenes.hpp"

namespace scenes {

struct BeltSpec {
  int rods = 8;
  double wrap = 1.5707963267948966;  ///< [rad]
  double drum_radius = 1e-2;         ///< of the circle of the rods' axes [m]
  double rod_over_bar = 0.02;        ///< distance of the axes at touch over the length of a bar on a rod
  double tension = 1;                ///< at the slack end [N]
  double friction = 0.3;
};

/// A belt over a drum made of thin fixed rods along z on a circle, each under the middle of a bar of its own; free bars between. The slack
/// end is pulled along +x, the held first node is the tight end. The belt's fiber is the last.
Scene belt_on_drum(const BeltSpec& spec);

/// A belt that slips.
struct DrawnBelt {
  double ratio = 0;      ///< of the tensions at the two ends
  double law_error = 0;  ///< largest relative error of one rod's discrete law
  std::int64_t steps = 0;
};

/// Draws the belt of belt_on_drum over the drum until it slips on every rod, then ever slower. A bar on a rod turns the belt by b1 before
/// and b2 after it. Along and across that bar, T2 cos b2 - T1 cos b1 = mu N and T1 sin b1 + T2 sin b2 = N give the discrete law T2/T1 =
/// (cos b1 + mu sin b1)/(cos b2 - mu sin b2), with b1 = b2 the law of numerics' table. Throws std::runtime_error if the motion fails.
DrawnBelt draw_belt(Scene scene, const BeltSpec& spec);

}  // namespace scenes
