#include "weave/model.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace weave {

std::uint16_t add_type(Model& model, const FiberType& type) {
  model.types.push_back(type);
  return static_cast<std::uint16_t>(model.types.size() - 1);
}

void finish_types(Model& model) {
  model.pair_laws.clear();
  for (const FiberType& a : model.types) {
    for (const FiberType& b : model.types) {
      model.pair_laws.push_back(PairLaw::of(a.radius, b.radius, a.transverse_modulus, b.transverse_modulus));
    }
  }
}

bool Model::has_friction() const {
  return friction > 0 || std::any_of(types.begin(), types.end(), [](const FiberType& t) { return t.friction_within.value_or(0) > 0; });
}

void add_fiber(Model& model, const FiberSpec& spec, std::vector<Vec3>& x) {
  assert(spec.rest_length.size() + (spec.periodic ? 0 : 1) == spec.x.size());
  if (model.first.empty()) model.first.push_back(0);
  const auto fiber = static_cast<std::uint32_t>(model.fibers());
  const FiberType& type = model.types[spec.type];
  const std::size_t n = spec.x.size();
  const std::size_t base = model.nodes();

  model.role.push_back(spec.role);
  model.periodic.push_back(spec.periodic);
  model.type.push_back(spec.type);
  model.yarn.push_back(spec.yarn);
  model.place.push_back(spec.place);
  model.end_force.push_back(spec.end_force);
  model.guide_stiffness.push_back(spec.guide_stiffness);
  model.guide_y.push_back(spec.guide_y);
  model.points.push_back(static_cast<std::uint32_t>(std::max(1.0, std::ceil(spec.rest_length.front() / type.radius - 1e-6))));
  model.point_length.push_back(spec.rest_length.front() / model.points.back());
  model.first.push_back(static_cast<std::uint32_t>(base + n + (spec.periodic ? 1 : 0)));

  x.insert(x.end(), spec.x.begin(), spec.x.end());
  if (spec.periodic) x.push_back(spec.x.front() + Vec3(0, model.period_y, 0));
  for (std::size_t i = 0; i < n; ++i) {
    const bool has_bar = i < spec.rest_length.size();
    const double before = i > 0 ? spec.rest_length[i - 1] : (spec.periodic ? spec.rest_length.back() : 0);
    const double after = has_bar ? spec.rest_length[i] : 0;
    model.rest_length.push_back(after);
    model.tributary.push_back(0.5 * (before + after));
    model.mass.push_back(type.density * type.area * model.tributary.back());
    const bool held = spec.hold_all || (spec.hold_first && i == 0);
    model.inverse_mass.push_back(held ? 0 : 1 / model.mass.back());
    model.fiber_of.push_back(fiber);
  }
  if (spec.periodic) {
    model.rest_length.push_back(0);
    model.tributary.push_back(0);
    model.mass.push_back(0);
    model.inverse_mass.push_back(0);
    model.fiber_of.push_back(fiber);
  }
}

}  // namespace weave
