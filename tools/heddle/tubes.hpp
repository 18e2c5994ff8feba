#pragma once
#include <vector>

#include "heddle/picture.hpp"
#include "weave/vec.hpp"

namespace heddle {

/// A fiber as seen: a tube along a poly-line.
struct Tube {
  std::vector<weave::Vec3> points;  ///< right, up, away from the viewer [m]
  std::vector<Color> colors;        ///< per point
  double radius = 0;                ///< [m]
};

/// Draws tubes in parallel projection with a depth buffer, so that each pixel shows the nearest fiber however they interlace, lit from
/// the upper left and darker with depth. The window, left ... left + width_px / scale and bottom ... bottom + height_px / scale, is
/// drawn on a transparent ground. scale: [px/m].
Image render_tubes(const std::vector<Tube>& tubes, double left, double bottom, double scale, int width_px, int height_px);

}  // namespace heddle
