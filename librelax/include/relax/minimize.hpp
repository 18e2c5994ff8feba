#pragma once
#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "relax/energy.hpp"

namespace relax {

enum class MinimizeMethod {
  automatic,  ///< a first-order phase until it is near or does not get nearer, then Newton's method
  dynamic,    ///< the first-order phase alone, with the contact sampling of Newton's method; the cell's lengths have to be given
  newton,     ///< Newton's method alone
};

/// What the gradient, over the reference tension, and the Newton step, in fiber diameters, of a certified minimum are at most.
constexpr double certificate_tolerance = 1e-8;

struct MinimizeOptions {
  MinimizeMethod method = MinimizeMethod::automatic;
  int first_order_max = 20000;  ///< steps of the first-order phase
  /// Gradient at which that hands over to Newton's method, and, while fibers overlap deeper than `first_order_overlap` [sums of two radii],
  /// the least one: largest component over the reference tension.
  double first_order_tolerance = 2e-2, first_order_tolerance_least = 1e-3;
  double first_order_overlap = 0.09;
  int first_order_patience = 200;         ///< steps without the gradient or the energy coming down, after which the phase is given up
  double first_order_energy_fall = 0.05;  ///< of the energy: what counts as coming down
  int iterations_max = 1000;              ///< of Newton's method: factors
  double skin = 0.3;                      ///< of the contact list [largest fiber diameters]
  /// At which to stop: largest component of the gradient over the reference tension, and of the Newton step in smallest fiber diameters.
  /// Beyond the certificate's tolerance no state is certified; below it, one has to meet these.
  double gradient_tolerance = certificate_tolerance, step_tolerance = certificate_tolerance;
  bool leave_saddles = true;  ///< at a saddle, go on along the direction of negative curvature
  ContactSampling sampling;
  ContactSampling first_order_sampling{1, 0.25};  ///< coarser: Newton's method goes on from there
  std::function<void(const struct MinimizeProgress&)> on_progress;
  std::function<void(const struct MinimizeState&)> on_checkpoint;  ///< to write it down, every `checkpoint_interval`
  double checkpoint_interval = 60;                                 ///< wall time [s]
  const std::atomic<bool>* stop = nullptr;                         ///< set from outside: leave off and return
  int stop_at_iteration = -1;                                      ///< same from this one on
};

/// One iteration of the minimization.
struct MinimizeProgress {
  int iteration = 0;
  double energy = 0;         ///< [J]
  double gradient_max = 0;   ///< over the reference tension
  double step_max = 0;       ///< largest way of a node in the step to here, and what the cell grew by [m]
  double damping = 0;        ///< share of a bound on the Hessian that was added to it for that step
  bool first_order = false;  ///< energy and gradient are those before the step of the first-order phase
  bool factor_kept = false;  ///< the step was made with the factor of the one before
  std::size_t touching = 0;  ///< contact points
  double overlap_max = 0;    ///< in sums of two radii
  double factorization = 0;  ///< since the iteration before; of the first-order phase, to assemble and factorize its metric [s]
  double solution = 0;       ///< with the factor, since the iteration before [s]
  double wall = 0;           ///< since the start [s]
};

/// How a minimization comes down: its least gradient and energy so far, and for how long neither has fallen clearly.
struct Descent {
  double gradient_least = 1e300, energy_least = 1e300;
  int fruitless = 0;  ///< times that neither did

  /// Takes note of where it is. What counts is a gradient a tenth below the least one, or an energy that share below the least one.
  void note(double gradient, double energy, double fall);
};

/// What the first-order phase keeps from step to step, beside the positions.
struct FirstOrderState {
  int step = 0;              ///< made; 0: at the start
  Eigen::VectorXd velocity;  ///< (unknowns)
  Eigen::VectorXd list_at;   ///< unknowns at which the contact list was built
  double time_step = 0, mixing = 0;
  int downhill = 0;  ///< steps since the motion last turned uphill
  Descent descent;
};

struct StageWall {
  double search = 0, assembly = 0, first_order_metric = 0, analysis = 0, factorization = 0, solution = 0;  ///< [s]
};

/// Where a minimization is between two iterations: all that it needs to go on to the same bits, beside the cell and the options.
struct MinimizeState {
  Eigen::VectorXd q;
  std::vector<MinimizeProgress> history;
  double reference_tension = 0;  ///< [N]
  int steps_left = 0, iterations_left = 0;
  double tolerance = 0;  ///< of the present first-order phase
  bool newton = false;   ///< in Newton's method; else in a first-order phase
  FirstOrderState first_order;

  // of Newton's method
  Eigen::VectorXd list_at, pattern_at;  ///< unknowns at which the contact list and the pattern of the Hessian were built
  double damping = 1;                   ///< share of the bound on the Hessian that is added to it
  bool lengths_free = false;            ///< free lengths of the cell move; before, the rest has to be near its minimum
  Descent descent;                      ///< by factors

  int analyses = 0, factorizations = 0;
  StageWall stages;
  double wall = 0;  ///< since the start [s]
};

/// Proof that a state is a strict minimum of the potential, without friction, but for rigid translations and the sliding of closed fibers
/// along themselves, which are held by pins: each fiber's first node along its fiber, and one node of the cell along each axis, and of each
/// fiber that touches nothing.
struct Certificate {
  double gradient_max = 0;         ///< largest component of the gradient over the reference tension, pins left out
  bool positive_definite = false;  ///< the Hessian as it is, pins left out
  bool neutral = false;  ///< it is not, but is with a millionth of the reference tension over the diameter added to its diagonal: a fiber
                         ///< that is slack, or that nothing touches, is not held
  int free_fibers = 0;   ///< that touch nothing; fibers that go on in one another count as one
  double newton_step_max = 0;    ///< largest component of its Newton step [smallest fiber diameters]
  bool contacts_steady = false;  ///< no contact point opens or closes in that step, from or to farther than the tolerance of the step
  double pin_force_max = 0;      ///< largest force of a pin over the reference tension: what the pins against sliding hold
  double energy_error = 0;       ///< 1/2 g H^-1 g, by which the energy lies above the minimum of its parabola; infinite without one [J]
  bool converged = false;        ///< all of it holds
  std::string blocked_by;        ///< what does not, by how much and where; empty if converged
};

struct MinimizeResult {
  Eigen::VectorXd q;
  Certificate certificate;
  EnergyParts energy;
  ContactState contacts;
  std::vector<MinimizeProgress> history;
  double reference_tension = 0;  ///< [N]
  double factor_nonzeros = 0;
  int analyses = 0, factorizations = 0;
  StageWall wall;
  bool interrupted = false;
  MinimizeState state;  ///< where it was interrupted; else empty
};

/// Largest prescribed tension of a fiber, or, where there is none, the largest share of a fiber in the loads on the cell, or, where there
/// is none, the mean tension of the pulled bars at `q`, or, where there is none of these either, the tension at a strain of 1e-6 [N].
double reference_tension(const Cell& cell, const Eigen::VectorXd& q);

/// Unknowns that pins hold.
std::vector<Eigen::Index> pinned_unknowns(const Cell& cell);

/// With the automatic method a first-order phase (preconditioned FIRE), until it is near or does not get nearer, then Newton's method from
/// `q` to a certified minimum. The Hessian is damped by a share of a bound on it (Levenberg-Marquardt), which goes to zero as the steps do
/// what the Hessian predicts; each factor is used for a step and, until it is worn out, for more of them by limited-memory BFGS. Each
/// step's energy is less than the one before, or, where round-off hides that, its gradient. No node moves farther than half the skin in a
/// step. Free lengths of the cell move last. At a saddle it goes on along the direction of negative curvature. A state that is no certified
/// minimum is returned with what blocks it. Throws std::invalid_argument for a `q` of wrong size or not finite, and for free lengths with
/// the dynamic method.
MinimizeResult minimize(const Cell& cell, const Eigen::VectorXd& q, const MinimizeOptions& options = {});

/// Goes on from where a minimization of the same cell with the same options was interrupted, to the same bits. Throws std::invalid_argument
/// for a state of wrong size or not finite.
MinimizeResult resume(const Cell& cell, const MinimizeState& state, const MinimizeOptions& options = {});

/// The certificate of a state, whatever made it.
Certificate certify(const Cell& cell, const Eigen::VectorXd& q, const MinimizeOptions& options = {});

}  // namespace relax
