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
constexpr double round_off = 1e-11;                      ///< of the energy: a predicted fall below it can not be seen
constexpr double shift_first = 1e-4;                     ///< [reference tension / diameter]
constexpr double shift_least = 1e-6, shift_largest = 1;  ///< of the true Hessian [reference tension / diameter]
constexpr int far_steps = 3;                    ///< of Newton's method as long as the list allows, one after the other: far from a minimum
constexpr int far_steps_after_stagnation = 40;  ///< and where the cheap steps have not come down
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
  for (const std::size_t k : {0, 1}) {
    if (u == unknowns.length[k]) return std::string("length of the cell along ") + "xy"[k];
  }
  const auto f = std::find(unknowns.drawn.begin(), unknowns.drawn.end(), u);
  if (f == unknowns.drawn.end()) return u == unknowns.platens ? "the lower platen" : "the upper platen";
  const auto number = static_cast<std::size_t>(f - unknowns.drawn.begin());
  return "rest length of fiber " + std::to_string(cell.place[number]) + " of yarn " + std::to_string(cell.yarn[number]);
}

class Minimization {
 public:
  Minimization(const Cell& cell, MinimizeState state, const MinimizeOptions& options)
      : cell_(cell), options_(options), unknowns_(cell), scale_(cell), pins_(pinned_unknowns(cell)), at_(std::move(state)) {
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
    for (bool again = true; again;) {
      if (!at_.newton) {
        const FirstOrderEnd end = calm_down(cell_, still_, options_, at_.tolerance, at_.steps_left, pause, at_.first_order, result_);
        if (end == FirstOrderEnd::paused) return leave_off();
        at_.steps_left -= at_.first_order.step;
        at_.first_order = {};
        at_.stagnated = end == FirstOrderEnd::stagnated;
        at_.newton = true;
        at_.far = 0;
        find_contacts_anew();
        evaluate(false);
        noted_ = result_.wall;
        note(0, 0, false);
      }
      again = false;
      for (; at_.iterations_left > 0; --at_.iterations_left) {
        if (pause()) return leave_off();
        if (step()) break;
        at_.far = at_.went_far ? at_.far + 1 : 0;
        // The fibers slide away from a saddle: that way is long, and goes faster in many cheap steps than in a few dear ones.
        const bool patient = at_.stagnated || (at_.lengths_free && still_.size() > pins_.size());
        again = at_.far == (patient ? far_steps_after_stagnation : far_steps) && at_.steps_left > 0;
        if (again) break;
      }
      at_.newton = false;
      at_.tolerance = std::max(0.5 * at_.tolerance, options_.first_order_tolerance_least);
    }
    certify_state();
    return std::move(result_);
  }

  /// The first-order phase alone. Where the gradient has come down but the Newton step has not, or the contacts had other shares, it goes
  /// on to a lower one, with the shares that they have now.
  MinimizeResult run_dynamic(const std::function<bool()>& pause) {
    MinimizeOptions fine = options_;
    fine.first_order_sampling = options_.sampling;
    for (;;) {
      const FirstOrderEnd end = calm_down(cell_, pins_, fine, at_.tolerance, at_.steps_left, pause, at_.first_order, result_);
      if (end == FirstOrderEnd::paused) return leave_off();
      find_contacts_anew();
      certify_state();
      noted_ = result_.wall;
      note(0, 0, false);
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
    evaluate(false);
    Certificate& c = result_.certificate;
    c = {};
    c.energy_error = std::numeric_limits<double>::infinity();
    c.gradient_max = gradient_max(gradient_);
    for (const Eigen::Index pin : pins_)
      c.pin_force_max = std::max(c.pin_force_max, std::abs(force_of_pins_[pin]) / result_.reference_tension);
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
      c.neutral = factorize(shift_least * result_.reference_tension / scale_.diameter_min);
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
    list_ = find_contacts(cell_, at_.list_at, options_.skin * scale_.diameter_max, options_.sampling);
    renew_pattern(at_.pattern_at);
    evaluate(false);
  }

  void find_contacts_anew() {
    {
      const Timed timed(result_.wall.search);
      list_ = find_contacts(cell_, result_.q, options_.skin * scale_.diameter_max, options_.sampling);
      at_.list_at = result_.q;
    }
    renew_pattern(result_.q);
  }

  /// By less than which nothing counts as moved [m].
  [[nodiscard]] double touch() const { return std::min(options_.step_tolerance, certificate_tolerance) * scale_.diameter_min; }

  /// Whether the contacts have the shares that they would get at the present state.
  [[nodiscard]] bool shares_settled() const {
    return (result_.q - list_.built_at).cwiseAbs().maxCoeff() <= touch() ||
           std::all_of(list_.contacts.begin(), list_.contacts.end(), [](const SpanContact& c) { return c.share == 0.5; });
  }

  void renew_pattern(const Eigen::VectorXd& q) {
    const Timed timed(result_.wall.analysis);
    at_.pattern_at = q;
    hessian_.emplace(hessian_for(cell_, list_, q));
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
  void evaluate(bool convex) {
    for (int attempt = 0;; ++attempt) {
      {
        const Timed timed(result_.wall.assembly);
        result_.contacts = {};
        result_.energy = potential(cell_, unknowns_, list_, result_.q, {&gradient_, &*hessian_, convex}, &result_.contacts);
      }
      if (hessian_->complete()) break;
      if (attempt > 0) throw std::logic_error("minimize: contacts outside the pattern that was made for them");
      renew_pattern(result_.q);
    }
    convex_ = convex;
    force_of_pins_ = gradient_;
    release_pins_from(gradient_);
    hessian_->pin(held(), result_.reference_tension / scale_.diameter_min);
  }

  bool factorize(double shift) {
    const Timed timed(result_.wall.factorization);
    ++result_.factorizations;
    return cholesky_->factorize(*hessian_, shift);
  }

  Eigen::VectorXd solve() {
    const Timed timed(result_.wall.solution);
    return cholesky_->solve(-gradient_);
  }

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

  void note(double step_max, double shift, bool convex) {
    MinimizeProgress p;
    p.iteration = static_cast<int>(result_.history.size());
    p.energy = result_.energy.sum();
    p.gradient_max = gradient_max(gradient_);
    p.step_max = step_max;
    p.shift = shift;
    p.convex = convex;
    p.touching = result_.contacts.touching;
    p.overlap_max = result_.contacts.overlap_max;
    p.factorization = result_.wall.factorization - noted_.factorization;
    p.solution = result_.wall.solution - noted_.solution;
    p.wall = wall();
    noted_ = result_.wall;
    result_.history.push_back(p);
    if (options_.on_progress) options_.on_progress(p);
  }

  /// Factorizes so that the step goes downhill: the true Hessian, if need be with a shift, where the last step stayed near; else without
  /// its indefinite terms, and shifted.
  void factorize_for_descent() {
    if (at_.true_in > 0) {
      --at_.true_in;
    } else if (at_.shift == 0 && factorize(0)) {
      at_.true_wait = 0;
      at_.true_shift = 0;
      return;
    } else if (!at_.went_far && factorize_shifted()) {
      return;
    } else {
      at_.true_in = at_.true_wait = std::min(2 * at_.true_wait + 1, 7);
    }
    evaluate(true);
    while (!factorize(at_.shift)) at_.shift = std::max(10 * at_.shift, shift_first * result_.reference_tension / scale_.diameter_min);
  }

  /// The true Hessian with the least shift that makes it positive definite, within a factor of ten.
  bool factorize_shifted() {
    const double unit = result_.reference_tension / scale_.diameter_min;
    for (double shift = std::max(0.1 * at_.true_shift, shift_least * unit); shift <= shift_largest * unit; shift *= 10) {
      if (!factorize(shift)) continue;
      at_.true_shift = shift;
      return true;
    }
    return false;
  }

  /// One Newton step. True if there is nothing more to do.
  bool step() {
    const double gradient_before = gradient_max(gradient_);
    if (!at_.lengths_free && gradient_before <= release_below) {
      at_.lengths_free = true;
      if (still_.size() > pins_.size()) {
        evaluate(false);
        note(0, 0, false);
        return false;
      }
    }
    if (gradient_before <= options_.gradient_tolerance) {
      if (!shares_settled()) {
        find_contacts_anew();
        evaluate(false);
        note(0, 0, false);
        return false;
      }
      at_.shift = 0;
      at_.true_in = 0;
      if (!factorize(0)) return !options_.leave_saddles || !leave_saddle();
      const Eigen::VectorXd newton = solve();
      if (newton.cwiseAbs().maxCoeff() <= options_.step_tolerance * scale_.diameter_min) return true;
    }
    factorize_for_descent();
    Eigen::VectorXd direction = solve();
    return !descend(direction);
  }

  /// Goes along a direction as far as it lowers the energy, or, where energies are lost in round-off, as far as the gradient says so or
  /// becomes less. False: nowhere.
  bool descend(Eigen::VectorXd& direction) {
    const double limit = 0.5 * list_.skin, way = unknowns_.way(direction);
    at_.went_far = way > limit;
    if (at_.went_far) direction *= limit / way;
    const Eigen::VectorXd before = result_.q;
    if (list_.late(cell_, before + direction)) find_contacts_anew();
    const double slope = gradient_.dot(direction), energy_before = result_.energy.sum();
    const double gradient_before = gradient_max(gradient_);
    const double size = result_.energy.bars + result_.energy.bending + result_.energy.contact + std::abs(result_.energy.tension) +
                        std::abs(result_.energy.platens) + std::abs(result_.energy.loads);
    double share = 1;
    Eigen::VectorXd gradient;
    for (int i = 0; i < halvings; ++i, share *= 0.5) {
      const Eigen::VectorXd trial = before + share * direction;
      double energy = 0;
      {
        const Timed timed(result_.wall.assembly);
        energy = potential(cell_, unknowns_, list_, trial, {&gradient, nullptr, false}).sum();
      }
      release_pins_from(gradient);
      const bool falls = energy <= energy_before + armijo * share * slope;
      const bool lost = std::abs(share * slope) < round_off * size;
      const bool goes_on_down = gradient.dot(direction) < 0;
      if (!(falls || (lost && (gradient_max(gradient) < gradient_before || goes_on_down)))) continue;
      result_.q = trial;
      const bool convex = convex_;
      const double shift = convex ? at_.shift : at_.true_shift;
      if (share == 1 && !at_.went_far) {
        at_.shift = at_.shift > 1e-3 * shift_first * result_.reference_tension / scale_.diameter_min ? 0.1 * at_.shift : 0;
      } else if (share < 0.25) {
        at_.shift = std::max(4 * at_.shift, shift_first * result_.reference_tension / scale_.diameter_min);
      }
      evaluate(false);
      note(share * unknowns_.way(direction), shift, convex);
      return true;
    }
    if (convex_ && at_.shift > 1e6 * shift_first * result_.reference_tension / scale_.diameter_min) return false;
    if (!convex_) {  // the step of the true Hessian leads nowhere
      at_.true_in = at_.true_wait = std::min(2 * at_.true_wait + 1, 7);
      if (++at_.stalled > 3) return false;
    }
    at_.shift = std::max(10 * at_.shift, shift_first * result_.reference_tension / scale_.diameter_min);
    evaluate(false);
    return true;
  }

  /// From a saddle along the eigenvector of the most negative curvature, by inverse iteration on the Hessian shifted to be positive
  /// definite.
  bool leave_saddle() {
    double shift = 1e-3 * shift_first * result_.reference_tension / scale_.diameter_min;
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
    return descend(v);
  }

  const Cell& cell_;
  const MinimizeOptions& options_;
  Unknowns unknowns_;
  Scale scale_;
  std::vector<Eigen::Index> pins_;
  std::vector<Eigen::Index> still_;  ///< the pins and the cell's lengths
  ContactList list_;
  std::optional<SparseHessian> hessian_;
  std::unique_ptr<Cholesky> cholesky_;
  Eigen::VectorXd gradient_, force_of_pins_;
  bool convex_ = false;
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
