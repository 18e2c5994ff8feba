#include "scenes/posed_fibers.hpp"

namespace scenes {

PosedFibers::PosedFibers(Scene scene, double reach) : scene_(std::move(scene)) {
  for (weave::FiberType& type : scene_.model.types) type.youngs_modulus = 1e-6;
  scene_.options.skin = reach;
  scene_.options.time_step = 1e-9;
  scene_.options.overlap_limit = 1;
  scene_.state.dt = scene_.state.dt_before = scene_.options.time_step;
  scene_.state = scene_.engine().state();  // with its contact list
  force_.assign(scene_.state.x.size(), Vec3::Zero());
}

void PosedFibers::move_to(const std::vector<Vec3>& x) {
  weave::State& s = scene_.state;
  const std::vector<Vec3> before = s.x, force_before = force_;
  for (std::size_t p = 0; p < x.size(); ++p) s.v[p] = (x[p] - s.x[p]) / s.dt;
  s.x = x;
  wake_contacts(s);
  weave::Engine engine = scene_.engine();
  engine.step(at_rest(scene_.model), &ledger_);
  force_ = engine.force();
  s.contacts = engine.state().contacts;
  s.flows = engine.state().flows;
  for (std::size_t p = 0; p < x.size(); ++p) work_ -= 0.5 * (force_before[p] + force_[p]).dot(x[p] - before[p]);
}

}  // namespace scenes
