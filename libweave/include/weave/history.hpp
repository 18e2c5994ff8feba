#pragma once
#include <string>
#include <vector>

namespace weave {

/// What a run records over time, one row per sample, and per beat-up. Column names carry their unit.
struct History {
  std::vector<double> time_s;
  std::vector<int> pick;               ///< 0-based pick under way
  std::vector<int> action;             ///< index into action_names
  std::vector<double> reed_x_m;        ///< position of the reed bars
  std::vector<double> reed_load_N;     ///< per cell, against the motion to the fell; largest value since the last row
  std::vector<double> warp_tension_N;  ///< mean over the warps, in the contact domain near the heddle, per yarn
  std::vector<double> overlap;         ///< largest contact overlap [fiber diameters] since the last row
  std::vector<double> time_step_s;
  // energy ledger
  std::vector<double> kinetic_J, bars_J, contact_J, friction_store_J, heddle_J;                      ///< stored
  std::vector<double> slip_J, damping_J;                                                             ///< lost
  std::vector<double> work_tension_J, work_reed_J, work_heddle_J, work_take_up_J, work_insertion_J;  ///< put in from outside
  std::vector<double> residual_J;                                                                    ///< stored + lost - put in

  std::vector<double> reed_load_per_beat_N;  ///< largest reed load of each beat-up
  std::vector<double> beat_time_s;           ///< and its time

  static inline const std::vector<std::string> action_names = {"insertion", "beat_up", "reed_return", "shedding", "take_up", "settle"};
};

}  // namespace weave
