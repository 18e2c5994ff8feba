#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "relax/minimize.hpp"

namespace heddle {

struct RelaxOptions {
  std::filesystem::path input;           ///< folder or file of a woven cell; or a case, for a start from topology
  std::filesystem::path output;          ///< default ./results/NAME_relaxed
  std::vector<std::string> overrides;    ///< key.path=value
  int fibers = 0;                        ///< per yarn, refined from those of the start; 0: as many as the start has
  std::vector<int> series;               ///< the same start at each of these counts, in place of `fibers`
  int starts = 1;                        ///< the start as it is, and others with its fibers moved at random
  int start_fibers = 0;                  ///< per yarn, of a start from topology; 0: as the case has it
  double warp_tension = 0;               ///< per yarn [N]; 0: the woven tensions, from topology those of the case
  double weft_tension = 0;               ///< per yarn [N]; 0: the woven tensions, from topology as the warp or the loom
  double pressure = 0;                   ///< of the platens [Pa]
  std::vector<double> pressures;         ///< one after the other, each from the minimum of the one before, in place of `pressure`
  std::optional<double> load_x, load_y;  ///< that pull the cell along x, along y, whose length is free then [N]; none: given lengths
  double element_length = 0;             ///< [fiber diameters]; 0: as the case has it, of more than 19 fibers a yarn as long as of 19
  std::string method = "auto";           ///< dynamic: the first-order phase alone; newton: Newton's method alone
  /// At which to stop: gradient over the reference tension, Newton step in fiber diameters.
  double tolerance = relax::certificate_tolerance;
  int iterations = relax::MinimizeOptions{}.iterations_max;    ///< of Newton's method, at most
  int first_order = relax::MinimizeOptions{}.first_order_max;  ///< steps of its first-order phases, at most
  int threads = 0;                                             ///< 0: all
  bool resume = false;  ///< go on from the checkpoint in the results folder; keep what is finished of a series
  bool quiet = false;
};

/// Relaxes a unit cell, shows progress on standard error, writes relax.vtkhdf and summary.json, and while it runs checkpoint.h5. A series
/// writes these into a folder fibers_N for each count, and series.json; pressures into a folder pressure_P for each, and a summary.json of
/// all; several starts into a folder start_K for each, and a folder comparison with that of them all (compare_command). Returns the exit
/// status: 0 certified minima, 1 not converged, 130 interrupted. Throws std::runtime_error for a checkpoint of another case, another start
/// or other options.
int relax_command(const RelaxOptions& options);

}  // namespace heddle
