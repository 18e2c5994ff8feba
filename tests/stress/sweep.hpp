#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace stress {

/// How a scene ended.
struct Outcome {
  bool completed = false;
  std::string message = {};  ///< why it stopped before its end
  double ledger_error = 0;   ///< change of the energy ledger's balance, over the energy in play
  double overlap_max = 0;    ///< deepest overlap [sums of two radii]
  std::int64_t steps = 0;
  std::int64_t late_searches = 0;
  int wrong_order = 0;      ///< crossings whose upper fiber came to lie below; of scenes that went to their end
  std::string defect = {};  ///< what else is wrong
};

/// What is wrong with an outcome; empty if the scene went to its end with its ledger closed to `ledger_limit`, all crossings as they were
/// and no late neighbor list, or stopped with a message that names a yarn or a node and the step or the pick, or a place in the case file.
std::string fault(const Outcome& outcome, double ledger_limit);

/// A scene at several values of one quantity.
struct Sweep {
  std::string quantity, unit, scene;
  std::vector<double> values;  ///< rising
  double ledger_limit = 0;     ///< of Outcome::ledger_error
  std::function<Outcome(double)> run;
};

/// Brief: seconds; full: up to where scenes stop.
enum class Extent { brief, full };

/// The values of one extent or the other.
std::vector<double> pick(Extent extent, std::vector<double> brief, std::vector<double> full);

}  // namespace stress
