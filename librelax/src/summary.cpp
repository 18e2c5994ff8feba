#include <cmath>
#include <nlohmann/json.hpp>

#include "relax/report.hpp"
#include "relax/version.hpp"
#include "weave/peak_memory.hpp"

namespace relax {

std::vector<std::pair<std::string, double>> named(const EnergyParts& e) {
  return {{"bars", e.bars},       {"bending", e.bending}, {"contact", e.contact}, {"tension", e.tension},
          {"platens", e.platens}, {"loads", e.loads},     {"sum", e.sum()}};
}

std::string summary_json(const Cell& cell, const MinimizeResult& r, const weave::CellMeasures& m, const ReportContext& context) {
  using nlohmann::ordered_json;
  const Unknowns unknowns(cell);
  std::size_t fibers_of_first = 0;
  for (const int yarn : cell.yarn) fibers_of_first += yarn == cell.yarn.front();
  const Certificate& c = r.certificate;
  const StageWall& w = r.wall;
  ordered_json j;
  j["tool"] = "relax";
  j["case"] = context.case_name;
  j["start"] = context.start;
  if (context.start == "woven") {
    j["lean"] = context.mismatch.lean;
    j["face_mismatch_mean"] = context.mismatch.mean;
    j["face_mismatch_largest"] = context.mismatch.largest;
    j["fibers_that_change_place"] = context.mismatch.moved;
  }
  j["version"] = version();
  j["fibers_per_yarn"] = fibers_of_first;
  j["fibers"] = cell.fibers();
  j["nodes"] = cell.nodes();
  j["unknowns"] = unknowns.size;
  j["factor_nonzeros"] = r.factor_nonzeros;
  j["friction"] = "none";
  j["reference_tension_N"] = r.reference_tension;
  each_finding(c, [&](const char* key, const auto& value) { j[key] = value; });
  j["energy_error_J"] = std::isfinite(c.energy_error) ? ordered_json(c.energy_error) : ordered_json();
  for (const auto& [name, value] : named(r.energy)) j["energy_J"][name] = value;
  for (const auto& [name, value] : weave::named(m)) j[name] = value;
  j["cell_length_m"] = cell.length_x;
  j["cell_width_m"] = cell.length_y;
  const auto load = [](const std::optional<double>& given) { return given ? ordered_json(*given) : ordered_json(); };
  j["load_x_N"] = load(cell.load_x);
  j["load_y_N"] = load(cell.load_y);
  const Eigen::Vector2d borne = borne_loads(cell, r.q);
  j["borne_load_x_N"] = borne.x();
  j["borne_load_y_N"] = borne.y();
  j["pressure_Pa"] = cell.pressure;
  j["overlap_max"] = r.contacts.overlap_max;
  j["contact_points_touching"] = r.contacts.touching;
  j["order_violations"] = context.violations;
  if (context.refinement) {
    j["refine_area_ratio"] = context.refinement->area_ratio;
    j["refine_overlap_before_newton"] = context.refinement->overlap_before_newton;
    j["refine_order_violations"] = context.refinement->order_violations;
  }
  j["iterations"] = r.history.empty() ? 0 : r.history.size() - 1;
  j["analyses"] = r.analyses;
  j["factorizations"] = r.factorizations;
  j["wall_s"] = context.wall;
  j["stage_wall_s"] = {{"search", w.search},     {"assembly", w.assembly},           {"first_order_metric", w.first_order_metric},
                       {"analysis", w.analysis}, {"factorization", w.factorization}, {"solution", w.solution}};
  j["peak_memory_bytes"] = weave::peak_memory_bytes();
  ordered_json history = ordered_json::array();
  for (const MinimizeProgress& p : r.history)
    history.push_back({p.energy, p.gradient_max, p.step_max, p.damping, p.first_order, p.factor_kept, p.touching, p.wall, p.factorization,
                       p.solution, p.overlap_max});
  j["history_columns"] = {"energy_J", "gradient_max", "step_max_m",      "damping",    "first_order", "factor_kept",
                          "touching", "wall_s",       "factorization_s", "solution_s", "overlap_max"};
  j["history"] = history;
  j["case_toml"] = context.case_toml;
  return j.dump(2) + "\n";
}

}  // namespace relax
