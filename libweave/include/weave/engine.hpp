#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "weave/bar_tensions.hpp"
#include "weave/contact.hpp"
#include "weave/contact_picking.hpp"
#include "weave/model.hpp"
#include "weave/neighbor_search.hpp"
#include "weave/yarn_turning.hpp"

namespace weave {

/// What the loom prescribes during one step.
struct Drive {
  Vec3 held_velocity = Vec3::Zero();  ///< of the warps' held ends [m/s]
  Vec3 reed_velocity = Vec3::Zero();  ///< [m/s]
  std::vector<double> guide_z;        ///< per fiber, at the step's start [m]
  std::vector<double> guide_speed;    ///< per fiber, during the step [m/s]
};

/// Energy that has flowed since the start [J].
struct Flows {
  double slip = 0, damping = 0;  ///< lost by friction and by the mass-proportional damping
  double axial = 0;   ///< lost in the bars: by the implicit scheme to axial waves faster than the time step, by dashpots if explicit
  double guides = 0;  ///< lost where the heddles catch the warp
  double tension = 0, reed = 0, heddle = 0, take_up = 0;  ///< work put in
  Flows& operator+=(const Flows& o);
};

/// Energy ledger at one time [J].
struct Ledger {
  double kinetic = 0, bars = 0, bending = 0, contact = 0, friction_store = 0, heddle = 0;
  Flows flows;
  [[nodiscard]] double stored() const { return kinetic + bars + bending + contact + friction_store + heddle; }
  [[nodiscard]] double put_in() const { return flows.tension + flows.reed + flows.heddle + flows.take_up; }
  /// stored + lost - put in; constant in exact arithmetic and time between two edits of the topology.
  [[nodiscard]] double balance() const { return stored() + flows.slip + flows.damping + flows.axial + flows.guides - put_in(); }
};

enum class StepStatus { ok, non_finite, overlap_too_deep, time_step_too_long };

/// What happened in a step.
struct StepReport {
  StepStatus status = StepStatus::ok;
  std::string message;             ///< of a failure: node, yarns, place, step
  double overlap_max = 0;          ///< largest overlap in sums of two radii
  Vec3 reed_force = Vec3::Zero();  ///< of the fibers on the reed bars [N]
};

struct EngineOptions {
  double skin = 0;           ///< of the contacts that are evaluated [m]
  double outer_skin = 0;     ///< of the neighbor list that they are picked from; at least twice `skin` [m]
  double safety = 0.95;      ///< fraction of the stability limit taken as time step
  double time_step = 0;      ///< [s]; 0: from the stability limit
  double time_step_max = 1;  ///< [s]
  double motion_max = std::numeric_limits<double>::infinity();    ///< of any node in one chosen time step [m]
  double overlap_limit = 0.6;                                     ///< deepest overlap in sums of two radii before the run is stopped
  double active_x_max = std::numeric_limits<double>::infinity();  ///< nodes beyond it touch nothing [m]
};

/// Moving part of a simulation: everything that a checkpoint has to hold, beside the model.
struct State {
  double time = 0;  ///< [s]
  std::int64_t step = 0;
  double dt = 0;                ///< of the next step [s]
  double dt_before = 0;         ///< of the last step; 0: none yet, v is at the time of x [s]
  std::vector<Vec3> x;          ///< (nodes) [m]
  std::vector<Vec3> v;          ///< (nodes), half a step behind x [m/s]
  std::vector<double> moved;    ///< (nodes) farthest that a node near this one can have gone since its neighbor search [m]
  std::vector<Vec3> x_pick;     ///< x when the active contacts were last picked [m]
  std::vector<double> travel;   ///< (nodes) longest way that a node near this one can have gone [m]
  std::vector<double> tension;  ///< of the bar from each node to the next in the last step [N]
  ContactList contacts;
  Flows flows;
  std::int64_t searches = 0, picks_of_active = 0;
  std::int64_t late_searches = 0;  ///< steps whose contacts came from a list that had run out
  int calm_steps = 0;              ///< steps since the time step was near its limit
  double frequency2 = 0;           ///< bound on the nodes' squared frequencies, smoothed over the last steps [1/s^2]
  std::vector<double> amplitude;   ///< (nodes) guess at how far each swings in the fastest oscillation, relative, at least 1
};

/// Wall time by stage since the start [s].
struct StageTimes {
  double search = 0, contact = 0, integrate = 0;
};

/// Dynamics of digital fibers with contact and friction: leapfrog, the bars' tensions implicit fiber by fiber so that the axial wave does
/// not bound the time step. One step: contact forces, reactions, loads, bars, move.
class Engine {
 public:
  Engine(Model model, State state, const EngineOptions& options);

  /// Advances by one time step. With `ledger`, fills it with the energies half way through the velocities' change: contact and bending at
  /// the step's start, bars and guides, whose loss is what they do not store, as the mean of the step's two ends.
  StepReport step(const Drive& drive, Ledger* ledger = nullptr);

  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const std::vector<double>& tension() const { return state_.tension; }  ///< per bar, at its first node [N]
  [[nodiscard]] const std::vector<Vec3>& force() const { return force_; }
  [[nodiscard]] const StageTimes& stage_times() const { return times_; }
  [[nodiscard]] FiberGeometry geometry() const;
  /// Stability limit of the time step as of the last step [s].
  [[nodiscard]] double step_limit() const { return step_limit_; }
  /// Takes model and state out for an edit of the topology; the engine is left empty.
  std::pair<Model, State> release() &&;
  void set_times(const StageTimes& times) { times_ = times; }

 private:
  struct alignas(64) PerFiber {
    Flows flows;
    ContactSums contact;
    Ledger stored;
    double frequency2 = 0;   ///< bound on the squared frequencies of its nodes [1/s^2]
    double moved_pick2 = 0;  ///< largest squared distance from x_pick
    double speed2 = 0;
    bool finite = true;
  };
  /// Largest of the fibers' figures of a step.
  struct Extremes {
    double frequency2 = 0, speed2 = 0, overlap = 0;
    std::array<double, 2> moved2{};  ///< moved_pick2 of fibers and of reed bars
    bool finite = true;
    Extremes& operator|=(const Extremes& o);
  };
  /// Fibers of a thread, which others take over as it is late; there may be more of them than threads come.
  struct alignas(64) Share {
    std::uint32_t begin = 0, end = 0;  ///< in shared_out_
    Extremes extremes;
    alignas(64) std::atomic<std::uint32_t> next_contact = 0;  ///< how many have been begun, or more
    alignas(64) std::atomic<std::uint32_t> next_motion = 0;
  };
  void note_extremes(std::uint32_t fiber, Extremes& extremes) const;
  /// What the motion of one fiber needs for a moment, from its first node, bar or block on. Each thread has one, which stays in its cache.
  struct Workspace {
    explicit Workspace(std::size_t nodes)
        : bar_tangent(nodes),
          change(nodes),
          stiffness(nodes),
          inverse_length(nodes),
          taut_stiffness(nodes),
          even_stiffness(nodes),
          bar_energy(nodes),
          block_speed2(nodes),
          block_way(nodes),
          tensions(nodes) {}
    std::vector<Vec3> bar_tangent;                ///< at the step's start
    std::vector<Vec3> change;                     ///< of the velocities [m/s]
    std::vector<DirectionalStiffness> stiffness;  ///< that the nodes feel
    std::vector<double> inverse_length;           ///< of the bars [1/m]
    std::vector<double> taut_stiffness;           ///< of the bars [N/m]
    std::vector<double> even_stiffness;           ///< that the nodes feel beside `stiffness`, alike in all directions [N/m]
    std::vector<double> bar_energy, block_speed2, block_way;
    BarTensions tensions;
  };
  void refresh_geometry(std::uint32_t fiber);
  void take_contact_stiffness(std::uint32_t fiber, NodeRange touched, Workspace& work);
  void find_ways(std::uint32_t fiber, double dt, Workspace& work) const;
  void add_travel(std::uint32_t fiber, Workspace& work);
  void look_ahead(std::uint32_t fiber, const Workspace& work);
  double bound_frequency(std::uint32_t node, const DirectionalStiffness& stiffness, double even_stiffness);
  void move_fiber(std::uint32_t fiber, const Drive& drive, bool with_energy, Workspace& work);
  void add_bar_forces(std::uint32_t fiber, bool with_energy, Workspace& work);
  struct GuideHold {
    double share, slope;
  };
  [[nodiscard]] GuideHold guide_hold(double x) const;
  struct GuideWork {
    double stored = 0;  ///< in the guides at the step's start [J]
    double taken = 0;   ///< from the heddles and the nodes [J]
  };
  [[nodiscard]] double guide_energy(std::uint32_t fiber, double z) const;
  GuideWork hold_in_guides(std::uint32_t fiber, const Drive& drive, std::span<Vec3> change_of_velocity);
  [[nodiscard]] double axial_damping(const FiberType& type) const;
  void pick();
  void pick_reed();
  void share_out();
  template <typename Work>
  void each_fiber(std::atomic<std::uint32_t> Share::*next, Work&& work);
  /// From the middle of the last step to the middle of the next: for how long the forces at x act on v [s].
  [[nodiscard]] double kick_time() const { return 0.5 * (state_.dt_before + state_.dt); }
  [[nodiscard]] double longest_step(double speed2) const;
  void choose_time_step(double frequency2, double speed2);
  [[nodiscard]] std::string describe_failure(StepStatus status) const;

  Model model_;
  State state_;
  EngineOptions options_;
  NeighborSearch neighbor_search_;
  YarnTurning turning_;
  StageTimes times_;
  double step_limit_ = 0;
  double moved_max_ = 0;             ///< largest of state().moved
  bool list_is_late_ = false;        ///< nodes have moved farther than the contact list in use allows
  std::uint32_t longest_fiber_ = 0;  ///< [nodes]
  std::vector<Vec3> force_;          ///< of the last step; of the fiber's own contacts alone from their evaluation until the fiber moves
  std::vector<double> bar_length_, reach_ahead_;
  std::vector<DirectionalStiffness> stiffness_;  ///< of contacts, from their evaluation until the fiber moves; else zero
  std::vector<Workspace> workspace_;             ///< by thread
  std::vector<PerFiber> per_fiber_;
  std::vector<std::uint32_t> shared_out_;  ///< fibers by share
  std::vector<Share> shares_;
};

}  // namespace weave
