#pragma once
#include "scenes/scenes.hpp"

namespace scenes {

/// Fibers posed by hand from step to step: contact forces with the friction history kept, energies and the work of the hand. The bars are
/// too soft to matter.
class PosedFibers {
 public:
  /// The scene's fibers where they are; contacts within `reach` [m] of them are listed once.
  PosedFibers(Scene scene, double reach);

  /// Moves all nodes straight to `x` within one step.
  void move_to(const std::vector<Vec3>& x);

  [[nodiscard]] const std::vector<Vec3>& x() const { return scene_.state.x; }
  [[nodiscard]] const std::vector<Vec3>& force() const { return force_; }
  [[nodiscard]] const weave::Ledger& ledger() const { return ledger_; }
  [[nodiscard]] const weave::ContactList& contacts() const { return scene_.state.contacts; }
  /// Work put in by the hand since the start, by the trapezoidal rule [J].
  [[nodiscard]] double work() const { return work_; }

 private:
  Scene scene_;
  std::vector<Vec3> force_;
  weave::Ledger ledger_;
  double work_ = 0;
};

}  // namespace scenes
