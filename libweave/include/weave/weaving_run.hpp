#pragma once
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "weave/case.hpp"
#include "weave/cloth_order.hpp"
#include "weave/history.hpp"
#include "weave/loom.hpp"
#include "weave/measures.hpp"

namespace weave {

/// How far a run is; passed on about twice a second.
struct RunProgress {
  std::string action;
  int pick = 0, picks = 0;  ///< 1-based pick under way
  double time = 0;          ///< simulated [s]
  double time_end = 0;      ///< estimated simulated time at the end [s]
  std::int64_t step = 0;
  double dt = 0;  ///< [s]
  double steps_per_second = 0;
  double wall = 0, left = 0;  ///< [s]
};

struct RunOptions {
  std::filesystem::path output;  ///< folder for results and checkpoint; empty: nothing is written
  bool resume = false;           ///< go on from the checkpoint in `output`
  std::function<void(const RunProgress&)> on_progress;
  const std::atomic<bool>* stop = nullptr;  ///< set from outside: checkpoint and return
  std::int64_t stop_at_step = -1;           ///< same at this step
  int stop_after_pick = -1;                 ///< same when so many picks are done
};

enum class RunStatus { completed, interrupted, failed };

struct WeaveSummary {
  std::size_t nodes = 0, nodes_max = 0, fibers = 0;  ///< at the end; largest during the run
  std::int64_t steps = 0;
  double dt_mean = 0, dt_min = 0;  ///< [s]
  int threads = 1;
  double wall = 0;  ///< [s]
  StageTimes stages;
  double wall_loom = 0, wall_output = 0;  ///< loom motion and edits; results and checkpoints [s]
  std::size_t contacts_max = 0;           ///< near enough to be evaluated, at the end of a pick
  double contact_node_steps = 0;          ///< sum of nodes over the steps
  double contact_steps = 0;               ///< sum of those contacts over the steps
  int picks = 0;
  // Of the largest loads of the last unit cell's beat-ups, or of all where there are fewer. The first column is beaten against held ends.
  double reed_load_max = 0, reed_load_mean = 0;      ///< [N]
  double warp_tension_mean = 0;                      ///< [N]
  CellMeasures cell;                                 ///< of the last unit cell
  std::vector<double> void_shares;                   ///< by section of the last unit cell
  StressByPlace warp_stress;                         ///< of the last unit cell
  ClothOrder order;                                  ///< of the last unit cell
  std::vector<double> column_distances_behind_fell;  ///< at the end [m]
  std::vector<double> warp_stress_behind_fell;       ///< by cell lengths of the cloth that is on the loom at the end [Pa]
  std::vector<Steadiness> steadiness;                ///< of successive cells, each when its last pick was done
  int order_violations = 0;
  std::int64_t searches = 0, late_searches = 0;
  double overlap_max = 0;
  Ledger energy;
  double energy_removed = 0;   ///< taken out or put in by edits of the topology [J]
  double energy_residual = 0;  ///< largest |residual| / largest net work put in
};

struct WeaveResult {
  RunStatus status = RunStatus::completed;
  std::string message;  ///< why it failed or stopped
  WeaveSummary summary;
  History history;
  Snapshot loom;  ///< at the end
  Snapshot cell;  ///< last unit cell; empty if none was finished
};

/// Weaves the cloth of a case. A numerical failure is returned with its message; a folder that cannot be written, a checkpoint of another
/// case and a shed that is too low for a weft throw std::runtime_error.
/// Writes into the output folder: weave.vtkhdf (loom at the end, history), cell.vtkhdf (last unit cell), cells/cell_NN.vtkhdf (each unit
/// cell when its last pick was done), picks/pick_NNNN.vtkhdf with picks.vtkhdf.series, summary.json, checkpoint.h5 (until completed).
WeaveResult weave_cloth(const Case& c, const RunOptions& options);

/// The summary as JSON text, keys with units.
std::string summary_json(const Case& c, const WeaveResult& result);

/// What a case would cost, from its model at the start.
struct RunEstimate {
  std::size_t warps = 0, wefts = 0, fibers = 0, nodes_start = 0, nodes_end = 0;
  int picks = 0;
  double simulated_time = 0;      ///< [s]
  double time_step = 0;           ///< [s]
  double explicit_time_step = 0;  ///< limit of the axial wave, which the implicit bars lift [s]
  double steps = 0;
  double memory = 0;  ///< [bytes]
  double wall = 0;    ///< on this machine's threads [s]
};
RunEstimate estimate_run(const Case& c);

}  // namespace weave
