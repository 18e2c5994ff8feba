#pragma once
#include <numbers>
#include <vector>

#include "scenes/scenes.hpp"
#include "stress/sweep.hpp"

namespace stress {

/// Two yarns of free fibers, the upper one falling on the lower one.
struct FallingYarn {
  int fibers = 1;                         ///< a yarn: 1, 3, 5 or a centred hexagonal number
  double angle = 0.5 * std::numbers::pi;  ///< between the two [rad]
  double gap = 0.02;                      ///< between their surfaces at the start, negative where they overlap [upper diameters]
  double gap_within = 0.02;               ///< between the fibers of a yarn [diameters]
  double radius_ratio = 1;                ///< of the upper fibers over the lower ones
  double modulus_ratio = 87;              ///< E/E_T
  double friction = 0.2;
  double bar = 1;              ///< length of a bar [upper diameters]
  double length = 6;           ///< of the fibers, at least two bars [upper diameters]
  double speed = 4.5;          ///< of the fall [m/s]
  double tension = 0;          ///< of the lower yarn's fibers, their first nodes held [N]
  double lower_radius = 5e-5;  ///< [m]
  double fall = 3;             ///< the scene ends after so many upper diameters at `speed`, or at 5 m/s if that is 0
};
Outcome run(const FallingYarn& spec);
scenes::Scene falling_yarn(const FallingYarn& spec);  ///< at its start

/// A closed weft of a single fiber that falls on a warp in a cell of the given width [diameters], in which each touches its own images.
Outcome run_narrow_cell(double width);

std::vector<Sweep> contact_sweeps(Extent extent);

}  // namespace stress
