#include "relax/minimize.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <random>
#include <stdexcept>

#include "cholesky.hpp"
#include "first_order.hpp"
#include "hessian_bound.hpp"
#include "limited_memory.hpp"

namespace relax {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) {
  return std::chrono::duration<double>(Clock::now() - t).count();
}

/// Adds the time until its end to a stage.
class Timed {
 public:
  explicit Timed(double& stage) : stage_(stage) {}
  ~Timed() { stage_ += seconds_since(start_); }
  Timed(const Timed&) = delete;
  Timed& operator=(const Timed&) = delete;

 private:
  double& stage_;
  Clock::time_point start_ = Clock::now();
};

constexpr double armijo = 1e-4;  ///< share of the predicted fall in energy that a step must bring (Nocedal & Wright 2006, 3.4)
constexpr int halvings = 14;
constexpr double round_off = 1e-11;   ///< of the energy: a predicted fall below it can not be seen
constexpr double shift_least = 1e-6;  ///< for slack fibers that nothing holds [reference tension / diameter]
constexpr double damping_least = 1e-6, damping_most = 1e6;
constexpr double damping_after_failure = 1e-2, damping_when_indefinite = 8, damping_when_nowhere = 16;  ///< the least; factors
constexpr int steps_by_factor = 60;                                                                     ///< at most, before it is made anew
constexpr int patience = 50;           ///< factors without the gradient or the energy coming down, after which it is given up
constexpr double gradient_fall = 0.1;  ///< of its least value: what counts as coming down
constexpr double energy_fall = 1e-7;   ///< likewise, in Newton's method
constexpr double worn_out = 1e-3;      ///< share of the first predicted fall in energy, from which on a factor is not used further
constexpr int halvings_by_factor = 6;  ///< of a step by a factor that is kept
constexpr double poor_share = 0.25;    ///< of a step: less of it a few times in a row, and the factor is made anew
constexpr int poor_in_a_row = 3;
constexpr int dynamic_patience = 400;  ///< of the first-order phase alone
constexpr double dynamic_energy_fall = 0.01;
constexpr double dynamic_tolerance_least = 1e-13;  ///< gradient, over the reference tension, below which round-off is all that is left
constexpr double release_below = 1;                ///< gradient, over the reference tension, from which on free lengths of the cell move
constexpr int inverse_iterations = 12, inverse_iterations_most = 300;  ///< for the direction of negative curvature, as many until it is one

struct Scale {
  double diameter_min = 1e300, diameter_max = 0;
  explicit Scale(const Cell& cell) {
    for (std::size_t f = 0; f < cell.fibers(); ++f) {
      diameter_min = std::min(diameter_min, 2 * cell.type_of(f).radius);
      diameter_max = std::max(diameter_max, 2 * cell.type_of(f).radius);
    }
  }
};

std::string name_of(const Cell& cell, const Unknowns& unknowns, Eigen::Index u) {
  if (u < 3 * unknowns.nodes) {
    const auto node = static_cast<std::uint32_t>(u / 3);
    const std::uint32_t f = cell.fiber_of[node];
    return std::string(1, "xyz"[u % 3]) + " of node " + std::to_string(node - cell.first[f]) + " of fiber " +
           std::to_string(cell.place[f]) + " of yarn " + std::to_string(cell.yarn[f]);
  }
  if (u == unknowns.length[0]) return "length of the cell along x";
  if (u == unknowns.length[1]) return "length of the cell along y";
  const auto f = std::find(unknowns.drawn.begin(), unknowns.drawn.end(), u);
  if (f == unknowns.drawn.end()) return u == unknowns.platens ? "the lower platen" : "the upper platen";
  const auto number = static_cast<std::size_t>(f - unknowns.drawn.begin());
  return "rest length of fiber " + std::to_string(cell.place[number]) + " of yarn " + std::to_string(cell.yarn[number]);
}

class Minimization {
 public:
  Minimization(const Cell& cell, MinimizeState state, const MinimizeOptions& options)
      : cell_(cell),
        options_(options),
        unknowns_(cell),
        scale_(cell),
        bound_(cell, 1),
        pins_(pinned_unknowns(cell)),
        at_(std::move(state)) {
    still_ = pins_;
    std::copy_if(unknowns_.length.begin(), unknowns_.length.end(), std::back_inserter(still_), [](Eigen::Index u) { return u >= 0; });
    const bool newton = at_.newton, first_order = !newton && at_.first_order.step > 0;
    for (const auto& [wanted, vector] : {std::pair{true, &at_.q},
                                         {newton, &at_.list_at},
                                         {newton, &at_.pattern_at},
                                         {first_order, &at_.first_order.velocity},
                                         {first_order, &at_.first_order.list_at}}) {
      if (wanted && (vector->size() != unknowns_.size || !vector->allFinite()))
        throw std::invalid_argument("minimize: the start has the wrong size or is not finite");
    }
    result_.q = at_.q;
    result_.reference_tension = at_.reference_tension;
    result_.history = std::move(at_.history);
    result_.wall = noted_ = at_.stages;
  }

  MinimizeResult run() {
    if (at_.newton) take_up_newton();
    result_.analyses = at_.analyses;
    result_.factorizations = at_.factorizations;
    const auto pause = [&] { return pause_wanted(); };
    if (options_.method == MinimizeMethod::dynamic) return run_dynamic(pause);
    if (!at_.newton) {
      if (calm_down(cell_, still_, options_, at_.tolerance, at_.steps_left, pause, at_.first_order, result_) == FirstOrderEnd::paused)
        return leave_off();
      at_.first_order = {};
      at_.newton = true;
      find_contacts_anew();
      renew_pattern(list_);
      evaluate();
      noted_ = result_.wall;
      note(0, false);
    }
    for (; at_.iterations_left > 0; --at_.iterations_left) {
      if (pause()) return leave_off();
      if (step()) break;
    }
    certify_state();
    return std::move(result_);
  }

  /// The first-order phase alone. Where the gradient has come down but the Newton step has not, or the contacts had other shares, it goes
  /// on to a lower one, with the shares that they have now.
  MinimizeResult run_dynamic(const std::function<bool()>& pause) {
    MinimizeOptions fine = options_;
    fine.first_order_sampling = options_.sampling;
    fine.first_order_patience = dynamic_patience;
    fine.first_order_energy_fall = dynamic_energy_fall;
    for (;;) {
      const FirstOrderEnd end = calm_down(cell_, pins_, fine, at_.tolerance, at_.steps_left, pause, at_.first_order, result_);
      if (end == FirstOrderEnd::paused) return leave_off();
      find_contacts_anew();
      certify_state();
      noted_ = result_.wall;
      note(0, false);
      const Certificate& c = result_.certificate;
      const bool there = c.gradient_max <= options_.gradient_tolerance &&
                         (!c.positive_definite || (c.newton_step_max <= options_.step_tolerance && c.contacts_steady));
      if (there || end == FirstOrderEnd::stagnated || at_.first_order.step >= at_.steps_left || at_.tolerance <= dynamic_tolerance_least)
        return std::move(result_);
      at_.tolerance *= 0.1;
      at_.first_order.list_at = result_.q;
    }
  }

  /// Gradient, Hessian and Newton step of the present state, which is kept.
  void certify_state() {
    at_.lengths_free = true;
    if (!hessian_ || !shares_settled()) find_contacts_anew();
    if (!hessian_) renew_pattern(list_);
    evaluate();
    Certificate& c = result_.certificate;
    c = {};
    c.energy_error = std::numeric_limits<double>::infinity();
    c.gradient_max = gradient_max(gradient_);
    for (const Eigen::Index pin : pins_)
      c.pin_force_max = std::max(c.pin_force_max, std::abs(force_of_pins_[pin]) / result_.reference_tension);
    c.free_fibers = hold_free_fibers();
    c.positive_definite = factorize(0);
    Eigen::Index at = 0;
    if (c.positive_definite) {
      const Eigen::VectorXd newton = solve();
      c.newton_step_max = newton.cwiseAbs().maxCoeff(&at) / scale_.diameter_min;
      c.energy_error = -0.5 * gradient_.dot(newton);
      c.contacts_steady = same_contacts(overlaps_at(result_.q), overlaps_at(result_.q + newton));
    }
    if (!std::isfinite(result_.energy.sum()) || !gradient_.allFinite()) {
      c.blocked_by = "the state is not finite";
    } else if (!(c.gradient_max <= std::min(options_.gradient_tolerance, certificate_tolerance))) {
      gradient_.cwiseAbs().maxCoeff(&at);
      c.blocked_by = fmt::format("gradient of {:.2e} of the reference tension, at most {:.0e}, at {}", c.gradient_max,
                                 std::min(options_.gradient_tolerance, certificate_tolerance), name_of(cell_, unknowns_, at));
    } else if (!c.positive_definite) {
      const std::string place = name_of(cell_, unknowns_, cholesky_->failed_at());
      c.neutral = factorize(shift_least * unit());
      c.blocked_by = c.neutral ? "no strict minimum: nothing holds a slack or free fiber, at " + place
                               : "no minimum: the Hessian is not positive definite at " + place;
    } else if (!(c.newton_step_max <= std::min(options_.step_tolerance, certificate_tolerance))) {
      c.blocked_by = fmt::format("Newton step of {:.2e} fiber diameters, at most {:.0e}, at {}", c.newton_step_max,
                                 std::min(options_.step_tolerance, certificate_tolerance), name_of(cell_, unknowns_, at));
    } else if (!c.contacts_steady) {
      c.blocked_by = fmt::format("contacts open or close in the last step, of {:.2e} fiber diameters", c.newton_step_max);
    }
    c.converged = c.blocked_by.empty();
  }
  [[nodiscard]] const Certificate& certificate() const { return result_.certificate; }

 private:
  [[nodiscard]] const std::vector<Eigen::Index>& held() const { return at_.lengths_free ? pins_ : still_; }
  [[nodiscard]] double wall() const { return at_.wall + seconds_since(start_); }

  [[nodiscard]] MinimizeState state() const {
    MinimizeState state = at_;
    state.q = result_.q;
    state.history = result_.history;
    state.reference_tension = result_.reference_tension;
    state.analyses = result_.analyses;
    state.factorizations = result_.factorizations;
    state.stages = result_.wall;
    state.wall = wall();
    return state;
  }

  /// Writes a checkpoint where one is due. Whether to leave off.
  bool pause_wanted() {
    if (options_.on_checkpoint && seconds_since(last_checkpoint_) >= options_.checkpoint_interval) {
      options_.on_checkpoint(state());
      last_checkpoint_ = Clock::now();
    }
    const bool reached = options_.stop_at_iteration >= 0 && result_.history.size() >= static_cast<std::size_t>(options_.stop_at_iteration);
    return reached || (options_.stop && *options_.stop);
  }

  MinimizeResult leave_off() {
    result_.state = state();
    result_.interrupted = true;
    result_.certificate.blocked_by = "interrupted";
    return std::move(result_);
  }

  /// Contact list, Hessian and gradient of a state in Newton's method.
  void take_up_newton() {
    list_ = contacts_at(at_.list_at);
    renew_pattern(contacts_at(at_.pattern_at));
    evaluate();
  }

  [[nodiscard]] ContactList contacts_at(const Eigen::VectorXd& q) const {
    return find_contacts(cell_, q, options_.skin * scale_.diameter_max, options_.sampling);
  }

  void find_contacts_anew() {
    const Timed timed(result_.wall.search);
    list_ = contacts_at(result_.q);
    at_.list_at = result_.q;
  }

  /// By less than which nothing counts as moved [m].
  [[nodiscard]] double touch() const { return std::min(options_.step_tolerance, certificate_tolerance) * scale_.diameter_min; }

  /// Whether the contacts have the shares that they would get at the present state.
  [[nodiscard]] bool shares_settled() const {
    return (result_.q - list_.built_at).cwiseAbs().maxCoeff() <= touch() ||
           std::all_of(list_.contacts.begin(), list_.contacts.end(), [](const SpanContact& c) { return c.share == 0.5; });
  }

  /// The pattern of the Hessian, with room for the contacts where a list was built, which it may outlast.
  void renew_pattern(const ContactList& list) {
    const Timed timed(result_.wall.analysis);
    at_.pattern_at = list.built_at;
    hessian_.emplace(hessian_for(cell_, list, list.built_at));
    cholesky_ = std::make_unique<Cholesky>(*hessian_);
    result_.factor_nonzeros = cholesky_->nonzeros();
    ++result_.analyses;
  }

  [[nodiscard]] double gradient_max(const Eigen::VectorXd& gradient) const {
    return gradient.cwiseAbs().maxCoeff() / result_.reference_tension;
  }

  void release_pins_from(Eigen::VectorXd& gradient) const {
    for (const Eigen::Index pin : held()) gradient[pin] = 0;
  }

  /// Energy, gradient and Hessian at the present state.
  void evaluate() {
    for (int attempt = 0;; ++attempt) {
      {
        const Timed timed(result_.wall.assembly);
        result_.contacts = {};
        result_.energy = potential(cell_, unknowns_, list_, result_.q, {&gradient_, &*hessian_, false}, &result_.contacts);
      }
      if (hessian_->complete()) break;
      if (attempt > 0) throw std::logic_error("minimize: contacts outside the pattern that was made for them");
      find_contacts_anew();
      renew_pattern(list_);
    }
    force_of_pins_ = gradient_;
    release_pins_from(gradient_);
    pin();
  }

  void pin() { hessian_->pin(held(), unit()); }

  /// What stiffnesses are measured in [N/m].
  [[nodiscard]] double unit() const { return result_.reference_tension / scale_.diameter_min; }

  bool factorize(double shift) {
    const Timed timed(result_.wall.factorization);
    ++result_.factorizations;
    return cholesky_->factorize(*hessian_, shift);
  }

  Eigen::VectorXd solve(const Eigen::VectorXd& right) {
    const Timed timed(result_.wall.solution);
    return cholesky_->solve(right);
  }
  Eigen::VectorXd solve() { return solve(-gradient_); }

  std::vector<double> overlaps_at(const Eigen::VectorXd& q) const {
    ContactState state;
    state.want_overlaps = true;
    contact_energy(cell_, list_, q, {}, &state);
    return state.overlaps;
  }

  /// Whether no contact opens or closes from one state to another. One that just touches in both, by less than the tolerance of a step, has
  /// neither force nor stiffness that counts.
  [[nodiscard]] bool same_contacts(const std::vector<double>& a, const std::vector<double>& b) const {
    for (std::size_t i = 0; i < a.size(); ++i) {
      if ((a[i] > 0) != (b[i] > 0) && std::max(std::abs(a[i]), std::abs(b[i])) > touch()) return false;
    }
    return true;
  }

  void note(double step_max, bool factor_kept) {
    MinimizeProgress p;
    p.iteration = static_cast<int>(result_.history.size());
    p.energy = result_.energy.sum();
    p.gradient_max = gradient_max(gradient_);
    p.step_max = step_max;
    p.damping = at_.damping;
    p.factor_kept = factor_kept;
    p.touching = result_.contacts.touching;
    p.overlap_max = result_.contacts.overlap_max;
    p.factorization = result_.wall.factorization - noted_.factorization;
    p.solution = result_.wall.solution - noted_.solution;
    p.wall = wall();
    noted_ = result_.wall;
    result_.history.push_back(p);
    if (options_.on_progress) options_.on_progress(p);
  }

  /// First nodes of the fibers that touch no other one; of fibers that go on in one another, of one of them.
  [[nodiscard]] std::vector<std::uint32_t> nodes_of_free_fibers() const {
    std::vector<std::uint8_t> touched(cell_.fibers(), 0);
    const std::vector<double> overlaps = overlaps_at(result_.q);
    const auto touch_loop = [&](std::uint32_t node) {
      for (std::uint32_t f = cell_.fiber_of[node]; !touched[f]; f = cell_.next[f]) touched[f] = 1;
    };
    for (std::size_t i = 0; i < list_.contacts.size(); ++i) {
      const auto first = overlaps.begin() + static_cast<std::ptrdiff_t>(list_.first_sample[i]);
      const auto end = overlaps.begin() + static_cast<std::ptrdiff_t>(list_.first_sample[i + 1]);
      if (std::none_of(first, end, [](double overlap) { return overlap > 0; })) continue;
      touch_loop(list_.contacts[i].span);
      touch_loop(list_.contacts[i].other);
    }
    std::vector<std::uint32_t> nodes;
    for (std::size_t f = 0; f < cell_.fibers(); ++f) {
      if (touched[f]) continue;
      nodes.push_back(cell_.first[f]);
      touch_loop(cell_.first[f]);
    }
    return nodes;
  }

  /// Holds fibers that touch nothing, and may lie anywhere, by a node each, as the whole cell is. Returns their number.
  int hold_free_fibers() {
    const std::vector<std::uint32_t> nodes = nodes_of_free_fibers();
    std::vector<Eigen::Index> held;
    for (const std::uint32_t node : nodes)
      for (Eigen::Index axis = 0; axis < 3; ++axis) held.push_back(3 * Eigen::Index{node} + axis);
    hessian_->pin(held, unit());
    return static_cast<int>(nodes.size());
  }

  /// Factorizes the Hessian, with as much of a bound on it added as it takes to be positive definite, and as the last steps have shown to
  /// be of use: a Levenberg-Marquardt step in the metric of the bound, in which fibers that are slack or nearly touch resist what would
  /// make them taut or press them together. What makes the Hessian indefinite goes as the bound comes.
  void factorize_for_descent() {
    if (at_.damping <= damping_least) {
      at_.damping = 0;
      if (factorize(0)) return;
    }
    at_.damping = std::max(at_.damping, damping_least);
    const Damping damping = damping_here();
    double added = 0, shift = shift_least * unit();
    for (;;) {
      hessian_->add(damping.to_convex, std::min(at_.damping, 1.0) - std::min(added, 1.0));
      hessian_->add(damping.bound, at_.damping - added);
      pin();
      added = at_.damping;
      if (factorize(shift)) return;
      if (at_.damping < 1) {
        at_.damping = std::min(damping_when_indefinite * at_.damping, 1.0);
      } else {
        shift *= 10;  // what nothing holds is lost in round-off
      }
    }
  }

  struct Damping {
    SparseHessian to_convex;  ///< from the Hessian to its convex part
    SparseHessian bound;
  };

  Damping damping_here() {
    for (int attempt = 0;; ++attempt) {
      Damping damping{*hessian_, *hessian_};
      {
        const Timed timed(result_.wall.assembly);
        potential(cell_, unknowns_, list_, result_.q, {nullptr, &damping.to_convex, true});
        damping.to_convex.add(*hessian_, -1);
        damping.bound.set_zero();
        bound_.add_to(damping.bound, unknowns_, list_, result_.q, false);
      }
      if (damping.bound.complete()) return damping;
      if (attempt > 0) throw std::logic_error("minimize: fibers that nearly touch outside the pattern that was made for them");
      find_contacts_anew();
      renew_pattern(list_);
      evaluate();
    }
  }

  /// One step of Newton's method, and more with its factor. True if there is nothing more to do.
  bool step() {
    const double gradient_before = gradient_max(gradient_), energy_before = result_.energy.sum();
    if (!std::isfinite(energy_before) || !gradient_.allFinite()) return true;
    at_.descent.note(gradient_before, energy_before, energy_fall);
    if (at_.descent.fruitless > patience) return true;
    if (!at_.lengths_free && gradient_before <= release_below) {
      at_.lengths_free = true;
      if (still_.size() > pins_.size()) {
        evaluate();
        note(0, false);
        return false;
      }
    }
    Eigen::VectorXd direction;
    if (gradient_before <= options_.gradient_tolerance) {
      if (!shares_settled()) {
        find_contacts_anew();
        evaluate();
        note(0, false);
        return false;
      }
      hold_free_fibers();
      if (!factorize(0)) return !options_.leave_saddles || !leave_saddle();
      at_.damping = 0;
      direction = solve();
      if (direction.cwiseAbs().maxCoeff() <= options_.step_tolerance * scale_.diameter_min) return true;
    } else {
      factorize_for_descent();
      direction = solve();
    }
    const Gone gone = descend(std::move(direction), halvings);
    if (gone.share == 0) {
      at_.damping = std::max(damping_when_nowhere * at_.damping, damping_after_failure);
      evaluate();
      return at_.damping > damping_most;
    }
    note(gone.way, false);
    if (at_.damping > 0 || gone.share < 1) {
      const double whole = go_on_by_factor(gone.share == 1);
      at_.damping = std::max(at_.damping, damping_least) * (whole > 0.7 ? 0.25 : whole > 0.5 ? 0.5 : whole > 0.35 ? 1 : 2);
    }
    evaluate();
    return false;
  }

  /// What came of going along a direction.
  struct Gone {
    double share = 0;      ///< of it, or of what is left of it where it went too far; 0: it led nowhere
    double way = 0;        ///< largest of a node [m]
    double predicted = 0;  ///< fall in energy, for the whole of it and to first order [J]
  };

  /// Steps by the factor at hand and what they teach about the Hessian, each for a small part of a factor's price, while they go on well.
  /// Returns the share of the steps, with the first one, that were made as a whole.
  double go_on_by_factor(bool first_whole) {
    LimitedMemory memory(steps_by_factor);
    int steps = 1, whole = first_whole;
    double first_fall = 0;
    for (int poor = 0; steps <= steps_by_factor && poor < poor_in_a_row;) {
      const Eigen::VectorXd before = result_.q, gradient = gradient_;
      const Gone gone = descend(memory.times(-gradient_, [this](const Eigen::VectorXd& v) { return solve(v); }), halvings_by_factor);
      if (gone.share == 0) break;
      note(gone.way, true);
      ++steps;
      whole += gone.share == 1;
      first_fall = std::max(first_fall, gone.predicted);
      if (gone.predicted < worn_out * first_fall) break;
      poor = gone.share < poor_share ? poor + 1 : 0;
      memory.learn(result_.q - before, gradient_ - gradient);
    }
    return static_cast<double>(whole) / steps;
  }

  /// Goes along a direction as far as it lowers the energy, or, where energies are lost in round-off, as far as the gradient says so or
  /// becomes less.
  Gone descend(Eigen::VectorXd direction, int halvings_most) {
    const double limit = 0.5 * list_.skin, way = unknowns_.way(direction);
    if (way > limit) direction *= limit / way;
    const Eigen::VectorXd before = result_.q;
    if (list_.late(cell_, before + direction)) {
      find_contacts_anew();
      look_at(before);
    }
    const EnergyParts parts = result_.energy;
    const ContactState contacts = result_.contacts;
    const Eigen::VectorXd gradient = gradient_;
    const double slope = gradient.dot(direction), gradient_before = gradient_max(gradient);
    const double size =
        parts.bars + parts.bending + parts.contact + std::abs(parts.tension) + std::abs(parts.platens) + std::abs(parts.loads);
    double share = 1;
    for (int i = 0; slope < 0 && i < halvings_most; ++i, share *= 0.5) {
      look_at(before + share * direction);
      const double energy = result_.energy.sum();
      const bool falls = energy <= parts.sum() + armijo * share * slope;
      const bool lost = std::abs(share * slope) < round_off * size;
      const bool goes_on_down = gradient_.dot(direction) < 0;
      if (!(falls || (lost && (gradient_max(gradient_) < gradient_before || goes_on_down)))) continue;
      return {share, share * unknowns_.way(direction), -slope};
    }
    result_.q = before;
    result_.energy = parts;
    result_.contacts = contacts;
    gradient_ = gradient;
    return {};
  }

  /// Makes a state the present one: its energy, contacts and gradient, without the Hessian.
  void look_at(const Eigen::VectorXd& q) {
    const Timed timed(result_.wall.assembly);
    result_.q = q;
    result_.contacts = {};
    result_.energy = potential(cell_, unknowns_, list_, q, {&gradient_, nullptr, false}, &result_.contacts);
    release_pins_from(gradient_);
  }

  /// From a saddle along the eigenvector of the most negative curvature, by inverse iteration on the Hessian shifted to be positive
  /// definite.
  bool leave_saddle() {
    double shift = 1e-7 * unit();
    while (!factorize(shift)) shift *= 4;
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    Eigen::VectorXd v(unknowns_.size);
    for (double& component : v) component = normal(random);
    for (const Eigen::Index pin : held()) v[pin] = 0;
    double curvature = 0;
    for (int i = 0; i < inverse_iterations || (curvature >= 0 && i < inverse_iterations_most); ++i) {
      v = cholesky_->solve(v).normalized();
      curvature = v.dot(hessian_->times(v));
    }
    if (curvature >= 0) return false;
    if (gradient_.dot(v) > 0) v = -v;
    v *= 0.05 * scale_.diameter_min / unknowns_.way(v);
    const Gone gone = descend(v, halvings);
    if (gone.share == 0) return false;
    note(gone.way, false);
    evaluate();
    return true;
  }

  const Cell& cell_;
  const MinimizeOptions& options_;
  Unknowns unknowns_;
  Scale scale_;
  HessianBound bound_;
  std::vector<Eigen::Index> pins_;
  std::vector<Eigen::Index> still_;  ///< the pins and the cell's lengths
  ContactList list_;
  std::optional<SparseHessian> hessian_;
  std::unique_ptr<Cholesky> cholesky_;
  Eigen::VectorXd gradient_, force_of_pins_;
  MinimizeState at_;  ///< but for what stands in the result until it is asked for
  MinimizeResult result_;
  StageWall noted_;  ///< those at the last iteration
  Clock::time_point start_ = Clock::now(), last_checkpoint_ = start_;
};

MinimizeState start_at(const Cell& cell, const Eigen::VectorXd& q, const MinimizeOptions& options) {
  if (q.size() != Unknowns(cell).size || !q.allFinite())
    throw std::invalid_argument("minimize: the start has the wrong size or is not finite");
  if (options.method == MinimizeMethod::dynamic && (cell.load_x || cell.load_y))
    throw std::invalid_argument("minimize: the dynamic method moves no free length of the cell");
  MinimizeState state;
  state.q = q;
  state.reference_tension = reference_tension(cell, q);
  state.steps_left = options.method == MinimizeMethod::newton ? 0 : options.first_order_max;
  state.iterations_left = options.iterations_max;
  state.tolerance = options.method == MinimizeMethod::dynamic ? options.gradient_tolerance : options.first_order_tolerance;
  return state;
}

}  // namespace

void Descent::note(double gradient, double energy, double fall) {
  if (gradient < (1 - gradient_fall) * gradient_least || energy < energy_least - fall * std::abs(energy)) {
    gradient_least = std::min(gradient_least, gradient);
    energy_least = std::min(energy_least, energy);
    fruitless = 0;
  } else {
    ++fruitless;
  }
}

double reference_tension(const Cell& cell, const Eigen::VectorXd& q) {
  const double prescribed = cell.tension.empty() ? 0 : *std::max_element(cell.tension.begin(), cell.tension.end());
  if (prescribed > 0) return prescribed;
  double axial = 0;
  for (const FiberType& type : cell.types) axial = std::max(axial, type.youngs_modulus * type.area);
  const double least = 1e-6 * axial;
  const double wefts = std::accumulate(cell.weft.begin(), cell.weft.end(), 0.0), warps = static_cast<double>(cell.fibers()) - wefts;
  const double share = std::max(cell.load_x && warps > 0 ? *cell.load_x / warps : 0, cell.load_y && wefts > 0 ? *cell.load_y / wefts : 0);
  if (cell.load_x || cell.load_y) return std::max(share, least);
  double sum = 0;
  int pulled = 0;
  for (const double t : bar_tensions(cell, Unknowns(cell), q)) {
    if (t <= 0) continue;
    sum += t;
    ++pulled;
  }
  return std::max(pulled > 0 ? sum / pulled : 0, least);
}

std::vector<Eigen::Index> pinned_unknowns(const Cell& cell) {
  std::vector<Eigen::Index> pins;
  std::optional<Eigen::Index> warp, weft;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    const Eigen::Index first = 3 * Eigen::Index{cell.first[f]};
    pins.push_back(first + (cell.weft[f] ? 1 : 0));
    (cell.weft[f] ? weft : warp) = (cell.weft[f] ? weft : warp).value_or(first);
  }
  if (weft) pins.push_back(*weft);
  if (warp) pins.push_back(*warp + 1);
  if (warp || weft) pins.push_back(warp.value_or(*weft) + 2);
  return pins;
}

MinimizeResult minimize(const Cell& cell, const Eigen::VectorXd& q, const MinimizeOptions& options) {
  return Minimization(cell, start_at(cell, q, options), options).run();
}

MinimizeResult resume(const Cell& cell, const MinimizeState& state, const MinimizeOptions& options) {
  return Minimization(cell, state, options).run();
}

Certificate certify(const Cell& cell, const Eigen::VectorXd& q, const MinimizeOptions& options) {
  Minimization state(cell, start_at(cell, q, options), options);
  state.certify_state();
  return state.certificate();
}

}  // namespace relax
