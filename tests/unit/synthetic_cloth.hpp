#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "weave/history.hpp"
#include "weave/snapshot.hpp"

namespace weave {

/// A plain weave by formula: yarns of seven fibers, hexagonally packed, whose centers follow cosines. SI units.
struct SyntheticCloth {
  int warps = 2;               ///< in the period along y
  int columns = 2;             ///< wefts in the period along x
  int cells = 1;               ///< periods along x
  double pitch = 0.75e-3;      ///< of warps and wefts [m]
  double radius = 0.038e-3;    ///< of a fiber [m]
  double amplitude = 0.09e-3;  ///< of the yarn paths [m]
  int elements_per_pitch = 12;
};

/// Warp i is at y = (i + 1/2) pitch, weft j at x = -(j + 1/2) pitch; warp i lies above weft j where i + j is even.
inline Snapshot make_synthetic_cloth(const SyntheticCloth& cloth) {
  using std::numbers::pi;
  Snapshot s;
  s.time = 0.0375;
  s.pick = cloth.columns * cloth.cells;
  s.cell_width = cloth.warps * cloth.pitch;
  s.cell_length = cloth.cells == 1 ? cloth.columns * cloth.pitch : 0;
  s.x_min = -cloth.columns * cloth.cells * cloth.pitch;
  s.x_max = 0;
  s.offset = {0};

  const auto add_yarn = [&](int yarn, bool weft, double across, double phase, double from, double to) {
    const int n = static_cast<int>(std::lround((to - from) / cloth.pitch)) * cloth.elements_per_pitch;
    for (int fiber = 0; fiber < 7; ++fiber) {
      const double turn = fiber * pi / 3;
      const double ring = fiber == 0 ? 0 : 2 * cloth.radius;
      Vec3 last;
      for (int i = 0; i <= n; ++i) {
        const double along = from + (to - from) * i / n;
        const double wave = std::cos(pi * along / cloth.pitch + phase);
        const double slope = -cloth.amplitude * pi / cloth.pitch * std::sin(pi * along / cloth.pitch + phase);
        const double height = ring * std::sin(turn) / std::hypot(1, slope);
        const Vec3 center(along - slope * height, across + ring * std::cos(turn), cloth.amplitude * wave + height);
        const Vec3 x = weft ? Vec3(center.y(), center.x(), center.z()) : center;
        s.arc.push_back(i == 0 ? 0 : s.arc.back() + (x - last).norm());
        s.tension.push_back((weft ? 0.1 : 0.25) * (1 + 0.3 * wave + 0.05 * fiber));
        s.x.push_back(x);
        last = x;
      }
      s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
      s.yarn.push_back(yarn);
      s.fiber.push_back(fiber);
      s.weft.push_back(weft ? 1 : 0);
      s.radius.push_back(cloth.radius);
      s.area.push_back(0.82 * pi * cloth.radius * cloth.radius);
    }
  };
  for (int i = 0; i < cloth.warps; ++i) add_yarn(i, false, (i + 0.5) * cloth.pitch, (i + 0.5) * pi, s.x_min, s.x_max);
  for (int j = 0; j < s.pick; ++j) add_yarn(cloth.warps + j, true, -(j + 0.5) * cloth.pitch, (j + 0.5) * pi, 0, s.cell_width);
  return s;
}

/// A loom's history by formula: `picks` beat-ups with a load that rises to its steady value.
inline History make_synthetic_history(int picks) {
  using std::numbers::pi;
  constexpr int rows_per_pick = 400;
  constexpr double pick_time = 0.022;
  History h;
  double slip = 0, damping = 0, put_in = 0;
  for (int i = 0; i < picks * rows_per_pick; ++i) {
    const int pick = i / rows_per_pick;
    const double phase = static_cast<double>(i % rows_per_pick) / rows_per_pick;
    const double steady = 1 - std::exp(-(pick + 1) / 4.0);
    const double beat = std::exp(-std::pow((phase - 0.42) / 0.02, 2));
    h.time_s.push_back((i + 1) * pick_time / rows_per_pick);
    h.pick.push_back(pick);
    h.action.push_back(phase < 0.1 ? 0 : phase < 0.45 ? 1 : phase < 0.6 ? 2 : phase < 0.9 ? 3 : phase < 0.97 ? 4 : 5);
    h.reed_x_m.push_back(0.01778 * (1 - std::exp(-std::pow((phase - 0.42) / 0.15, 2))));
    h.reed_load_N.push_back(42 * steady * beat);
    h.warp_tension_N.push_back(3 + 0.9 * beat * steady - 0.4 * std::exp(-std::pow((phase - 0.75) / 0.05, 2)) +
                               0.03 * std::sin(60 * pi * phase));
    h.overlap.push_back(0.02 + 0.11 * beat * steady);
    h.time_step_s.push_back(2.5e-7);
    slip += 2e-7 * beat * steady + 1e-8;
    damping += 6e-8;
    h.kinetic_J.push_back(4e-6 * std::abs(std::sin(pi * phase)));
    h.bars_J.push_back(3e-5 + 9e-6 * beat);
    h.contact_J.push_back(1e-5 + 8e-6 * beat);
    h.friction_store_J.push_back(1e-6);
    h.heddle_J.push_back(5e-7);
    h.slip_J.push_back(slip);
    h.damping_J.push_back(damping);
    const double stored = h.kinetic_J.back() + h.bars_J.back() + h.contact_J.back() + h.friction_store_J.back() + h.heddle_J.back();
    const double residual = 4e-8 * std::sin(7.0 * i / rows_per_pick) * (1 + pick / 8.0);
    h.residual_J.push_back(residual);
    put_in = stored + slip + damping - residual;
    h.work_tension_J.push_back(-0.2 * put_in);
    h.work_reed_J.push_back(0.5 * put_in);
    h.work_heddle_J.push_back(0.5 * put_in);
    h.work_take_up_J.push_back(0.15 * put_in);
    h.work_insertion_J.push_back(0.05 * put_in);
    if (i % rows_per_pick == 168) {
      h.reed_load_per_beat_N.push_back(42 * steady);
      h.beat_time_s.push_back(h.time_s.back());
    }
  }
  return h;
}

}  // namespace weave
