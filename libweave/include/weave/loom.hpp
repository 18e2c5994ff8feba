#pragma once
#include <optional>
#include <string>
#include <vector>

#include "weave/case.hpp"
#include "weave/engine.hpp"
#include "weave/snapshot.hpp"

namespace weave {

constexpr int weft_bars_least = 6;  ///< across the cell

/// One warp yarn's place in the loom.
struct WarpPlace {
  int section = 0;
  int type = 0;        ///< fiber type in the model
  double y = 0;        ///< line of the warp [m]
  double stack_z = 0;  ///< offset of the warp in its section's stack, the same at the fell and at the heddle [m]
  double tension = 0;  ///< [N]
  int fibers = 0;
  double width = 0;  ///< its share of the dent's opening [m]
};

/// Geometry of the loom derived from a case; constant during a run.
struct LoomLayout {
  std::vector<std::string> type_names;  ///< yarn types in the order of the model's fiber types (the last type is the reed's)
  std::vector<WarpPlace> warps;
  WeavingMatrix matrix;        ///< (picks a cell x warps)
  std::vector<int> weft_type;  ///< fiber type by layer
  double start_length = 0;     ///< warp held ends to the fell at the start [m]
  double stored_length = 0;    ///< warp kept behind the heddle [m]
  double fiber_diameter = 0;   ///< largest [m]
};

LoomLayout lay_out(const Case& c);

/// Places of a yarn's fibers in its cross-section, touching but for `gap`: 1, 3, 5 or a centred hexagonal number; an upright block where
/// the hexagon is wider than `width`. Returns (offset across, offset through the thickness) [m], the innermost first.
std::vector<Eigen::Vector2d> bundle_section(int fibers, double radius, double gap, double width);
double bundle_height(int fibers, double radius, double width);  ///< [m]

/// The same for a warp at the heddle, spaced in z such that its fibers do not touch in the sloping shed [m].
std::vector<Eigen::Vector2d> warp_section(const Case& c, const WarpPlace& warp, double radius);

/// Model and positions at the start: warps straight from the held ends to their heddles, which stand as the first pick wants them, under
/// their tension; reed at rest. All velocities zero.
std::pair<Model, State> set_up_loom(const Case& c, const LoomLayout& layout);

/// Heddle position of a warp for an entry of the weaving matrix [m].
double heddle_z(const Case& c, const WarpPlace& warp, int entry);

/// The actions of one pick in time, from the placing of its weft on.
struct PickTimes {
  double beat_up = 0, reed_return = 0, shedding = 0, take_up = 0, end = 0;  ///< start of each action [s]
};
PickTimes pick_times(const Case& c, bool shed_changes, bool takes_up);

/// Whether the take-up acts after this pick (0-based in the cell).
bool takes_up_after(const Case& c, int pick_in_cell);

/// Where everything that the loom moves stands `t` after the placing of the weft. From rest with constant acceleration (Yang 2015, eq. 10).
double reed_position(const Case& c, const PickTimes& times, double t);     ///< x of the bars' axes [m]
double shed_progress(const Case& c, const PickTimes& times, double t);     ///< 0...1
double take_up_progress(const Case& c, const PickTimes& times, double t);  ///< 0...1

/// Places the weft of `pick` into the open shed, straight across the cell. Throws std::runtime_error if the shed is too low for it.
void insert_weft(const Case& c, const LoomLayout& layout, int pick, Model& model, State& state);

/// What is wrong if a warp's end has been drawn past the heddle; empty if none has.
std::string stored_warp_lack(const Case& c, const LoomLayout& layout, const Model& model, const State& state);

/// Fills up the stored warp behind the heddle to the layout's stored length. Returns the number of nodes added. Throws std::runtime_error
/// if one was used up.
std::size_t supply_warp(const Case& c, const LoomLayout& layout, Model& model, State& state);

/// Cuts the cloth at x = plane: warp nodes before it and the wefts numbered below `first_kept_weft` go, the cut ends become held ends. The
/// first `held_wefts` kept wefts are held with them, in the place of the cloth behind: blows would drive them out of the cut.
void cut_cloth(double plane, int first_kept_weft, int held_wefts, Model& model, State& state);

/// Mean position of the fibers of a weft [m].
std::optional<Vec3> weft_center(const Model& model, const State& state, int yarn);

/// The wefts that are on the wrong side of a warp by the weaving matrix.
struct OrderCheck {
  int violations = 0;
  std::string first;  ///< description of the first one
};
OrderCheck check_order(const Case& c, const LoomLayout& layout, const Model& model, const State& state);

/// x of the end of the unit cell that starts with `first_pick`: half a column behind its last column's wefts [m]. Throws
/// std::runtime_error if that cell is no longer on the loom.
double cell_end(const Case& c, const LoomLayout& layout, const Model& model, const State& state, int first_pick);

/// All fibers but the reed.
Snapshot snapshot_of_loom(const Case& c, const Engine& engine, int pick);

/// The unit cell whose wefts are picks first_pick ... first_pick + picks_per_cell - 1, cut out of a snapshot of the loom. Its faces lie in
/// the middle of the last of its weft columns and a cell's length before, where warps run level: half of that column, and of the one before
/// the first, lies outside; next to the warps' held ends, as of the first cell, it begins at these. Columns near the fell lie farther apart
/// than the taking-up: all x are drawn to the cell's length, or the gap behind the face alone would be narrower than the warps in it. Warps
/// go from where they first cross one face to where they first cross the other, and beyond it for the length of a column. Wefts are
/// numbered by their row in the weaving matrix, after the warps. Throws std::runtime_error if that cell is no longer on the loom.
Snapshot cut_cell(const Case& c, const Snapshot& loom, int first_pick);

}  // namespace weave
