#include "first_order.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>

#include "cholesky.hpp"
#include "hessian_bound.hpp"

namespace relax {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

constexpr double step_first = 0.5, step_max = 1.5;  ///< time step, in units of 1/frequency
constexpr double mixing_first = 0.1, mixing_decay = 0.99, step_growth = 1.1, step_fall = 0.5;
constexpr double step_least = 0.3;  ///< below the limit of stability anyway, as M is not less than the Hessian
constexpr int steps_before_growth = 5;
constexpr double way_limit = 0.1;    ///< of a node in one step [smallest diameters]
constexpr int metric_interval = 10;  ///< steps for which M is kept, unless the motion turns uphill before
constexpr double list_skin =
    1.5;  ///< of the contact list [largest fiber diameters]: nodes go far, and what does not touch costs next to nothing
constexpr double regular = 1e-6;  ///< added to M: of the reference tension over the diameter, for slack fibers that nothing holds

/// M with its factor.
class Metric {
 public:
  explicit Metric(const Cell& cell)
      : bound_(cell, 2), matrix_(hessian_for(cell, ContactList{}, Eigen::VectorXd::Zero(Unknowns(cell).size))), factor_(matrix_) {}

  void renew(const Unknowns& unknowns, const ContactList& list, const Eigen::VectorXd& q, const std::vector<Eigen::Index>& pins,
             double scale) {
    matrix_.set_zero();
    bound_.add_to(matrix_, unknowns, list, q, true);
    matrix_.pin(pins, scale);
    double shift = regular * scale;
    while (!factor_.factorize(matrix_, shift)) shift *= 10;
  }
  [[nodiscard]] Eigen::VectorXd times(const Eigen::VectorXd& v) const { return matrix_.times(v); }
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& f) const { return factor_.solve(f); }

 private:
  HessianBound bound_;
  SparseHessian matrix_;
  Cholesky factor_;
};

}  // namespace

FirstOrderEnd calm_down(const Cell& cell, const std::vector<Eigen::Index>& pins, const MinimizeOptions& options, double tolerance,
                        int steps_max, const std::function<bool()>& pause, FirstOrderState& state, MinimizeResult& result) {
  if (steps_max <= 0) return FirstOrderEnd::near;
  const Clock::time_point start = Clock::now();
  const double wall_before = result.history.empty() ? 0 : result.history.back().wall;
  const Unknowns unknowns(cell);
  double d_min = 1e300, d_max = 0;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    d_min = std::min(d_min, 2 * cell.type_of(f).radius);
    d_max = std::max(d_max, 2 * cell.type_of(f).radius);
  }
  const double scale = result.reference_tension / d_min;
  if (state.step == 0) {
    state.velocity = Eigen::VectorXd::Zero(unknowns.size);
    state.list_at = result.q;
    state.time_step = step_first;
    state.mixing = mixing_first;
    state.descent = {};
  }
  Eigen::VectorXd& v = state.velocity;
  ContactList list = find_contacts(cell, state.list_at, list_skin * d_max, options.first_order_sampling);
  Metric metric(cell);
  Eigen::VectorXd gradient(unknowns.size);
  int metric_age = metric_interval;
  for (; state.step < steps_max; ++state.step) {
    if (metric_age >= metric_interval && pause()) return FirstOrderEnd::paused;
    Clock::time_point stage = Clock::now();
    if (list.late(cell, result.q)) {
      list = find_contacts(cell, result.q, list_skin * d_max, options.first_order_sampling);
      state.list_at = result.q;
      result.wall.search += seconds_since(stage);
      stage = Clock::now();
    }
    ContactState contacts;
    const double energy = potential(cell, unknowns, list, result.q, {&gradient, nullptr, false}, &contacts).sum();
    for (const Eigen::Index pin : pins) gradient[pin] = 0;
    const double gradient_max = gradient.cwiseAbs().maxCoeff() / result.reference_tension;
    result.wall.assembly += seconds_since(stage);
    double factorization = 0;
    if (metric_age++ >= metric_interval) {
      stage = Clock::now();
      metric.renew(unknowns, list, result.q, pins, scale);
      factorization = seconds_since(stage);
      result.wall.first_order_metric += factorization;
      metric_age = 1;
    }
    const bool deep = contacts.overlap_max > options.first_order_overlap;
    const double wanted = deep ? std::min(tolerance, options.first_order_tolerance_least) : tolerance;
    if (gradient_max <= wanted || !std::isfinite(energy)) return FirstOrderEnd::near;
    state.descent.note(gradient_max, energy, options.first_order_energy_fall);
    if (state.descent.fruitless >= options.first_order_patience) return FirstOrderEnd::stagnated;

    stage = Clock::now();
    const Eigen::VectorXd pull = metric.solve(-gradient);  // M^-1 F
    const double solution = seconds_since(stage);
    result.wall.solution += solution;
    const double power = -gradient.dot(v);
    if (power > 0) {
      const double speed = std::sqrt(std::max(v.dot(metric.times(v)), 0.0)), size = std::sqrt(std::max(-gradient.dot(pull), 1e-300));
      v = (1 - state.mixing) * v + state.mixing * speed / size * pull;
      if (++state.downhill > steps_before_growth) {
        state.time_step = std::min(step_growth * state.time_step, step_max);
        state.mixing *= mixing_decay;
      }
    } else {
      v.setZero();
      state.time_step = std::max(step_fall * state.time_step, step_least);
      metric_age = metric_interval;
      state.mixing = mixing_first;
      state.downhill = 0;
    }
    v += state.time_step * pull;
    Eigen::VectorXd step = state.time_step * v;
    const double way = unknowns.way(step), limit = way_limit * d_min;
    if (way > limit) {
      step *= limit / way;
      v *= limit / way;
    }
    result.q += step;
    MinimizeProgress p;
    p.iteration = static_cast<int>(result.history.size());
    p.energy = energy;
    p.gradient_max = gradient_max;
    p.step_max = std::min(way, limit);
    p.first_order = true;
    p.touching = contacts.touching;
    p.overlap_max = contacts.overlap_max;
    p.factorization = factorization;
    p.solution = solution;
    p.wall = wall_before + seconds_since(start);
    result.history.push_back(p);
    if (options.on_progress) options.on_progress(p);
  }
  return FirstOrderEnd::near;
}

}  // namespace relax
