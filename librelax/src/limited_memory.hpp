#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <deque>
#include <ranges>
#include <vector>

namespace relax {

/// Inverse of a Hessian by limited-memory BFGS (Nocedal & Wright 2006, algorithm 7.4): one that is known, mended by what the last steps did
/// to the gradient.
class LimitedMemory {
 public:
  /// most: steps to remember.
  explicit LimitedMemory(std::size_t most) : most_(most) {}

  /// The inverse times v; `known` gives the known one times a vector.
  template <class Known>
  [[nodiscard]] Eigen::VectorXd times(Eigen::VectorXd v, Known&& known) const {
    std::vector<double> share;
    for (const Step& s : std::views::reverse(steps_)) {
      share.push_back(s.way.dot(v) / s.curvature);
      v -= share.back() * s.change;
    }
    v = known(v);
    for (const Step& s : steps_) {
      v += (share.back() - s.change.dot(v) / s.curvature) * s.way;
      share.pop_back();
    }
    return v;
  }

  /// Learns from a step and the change of the gradient along it, if that has grown on the way.
  void learn(const Eigen::VectorXd& way, const Eigen::VectorXd& change) {
    constexpr double least_growth = 1e-10;  // of what the lengths of the two allow
    const double curvature = way.dot(change);
    if (!(curvature > least_growth * way.norm() * change.norm())) return;
    steps_.push_back({way, change, curvature});
    if (steps_.size() > most_) steps_.pop_front();
  }

 private:
  struct Step {
    Eigen::VectorXd way, change;
    double curvature;
  };
  std::size_t most_;
  std::deque<Step> steps_;
};

}  // namespace relax
