#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>

#include "weave/peak_memory.hpp"
#include "weave/version.hpp"
#include "weave/weaving_run.hpp"

namespace weave {
namespace {

const char* name_of(RunStatus status) {
  switch (status) {
    case RunStatus::completed:
      return "completed";
    case RunStatus::interrupted:
      return "interrupted";
    case RunStatus::failed:
      return "failed";
  }
  return "";
}

double mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace

std::string summary_json(const Case& c, const WeaveResult& r) {
  using nlohmann::ordered_json;
  const WeaveSummary& s = r.summary;
  const StageTimes& t = s.stages;
  const Ledger& e = s.energy;
  ordered_json j;
  j["tool"] = "weave";
  j["case"] = c.name;
  j["title"] = c.title;
  j["version"] = version();
  j["completed"] = r.status == RunStatus::completed;
  j["status"] = name_of(r.status);
  j["message"] = r.message;
  j["picks"] = s.picks;
  j["fibers"] = s.fibers;
  j["nodes"] = s.nodes;
  j["nodes_max"] = s.nodes_max;
  j["contacts_near_max"] = s.contacts_max;
  j["steps"] = s.steps;
  j["dt_s"] = s.dt_mean;
  j["dt_min_s"] = s.dt_min;
  j["threads"] = s.threads;
  j["wall_s"] = s.wall;
  j["stage_wall_s"] = {
      {"search", t.search}, {"contact", t.contact}, {"bars_and_motion", t.integrate}, {"loom", s.wall_loom}, {"output", s.wall_output}};
  j["ns_per_node_step"] = s.contact_node_steps > 0 ? 1e9 * s.wall / s.contact_node_steps : 0;
  j["ns_per_near_contact"] = s.contact_steps > 0 ? 1e9 * t.contact / s.contact_steps : 0;
  j["peak_memory_bytes"] = peak_memory_bytes();
  j["reed_load_max_N"] = s.reed_load_max;
  j["reed_load_mean_N"] = s.reed_load_mean;
  j["reed_load_over_warp_tension"] = s.reed_load_mean / c.warp_tension();
  j["reed_load_per_beat_N"] = r.history.reed_load_per_beat_N;
  j["warp_tension_mean_N"] = s.warp_tension_mean;
  j["cell_length_m"] = c.cell_length();
  j["cell_length_on_loom_m"] = r.cell.length_on_loom;
  j["cell_width_m"] = c.cell_width();
  for (const auto& [name, value] : named(s.cell)) j[name] = value;
  j["void_share_mean"] = s.void_shares.empty() ? ordered_json() : ordered_json(mean(s.void_shares));
  j["void_share_per_section"] = s.void_shares;
  j["stress_middle_warp_Pa"] = s.warp_stress.middle;
  j["stress_edge_warp_Pa"] = s.warp_stress.edge;
  j["stress_mean_warp_per_cell_Pa"] = s.warp_stress_behind_fell;
  j["steadiness"] = s.steadiness.empty() ? ordered_json() : ordered_json(s.steadiness.back().mean);
  j["steadiness_largest"] = s.steadiness.empty() ? ordered_json() : ordered_json(s.steadiness.back().largest);
  ordered_json per_cell = ordered_json::array(), by_label = ordered_json::array(), shift = ordered_json::array();
  for (const Steadiness& k : s.steadiness) {
    per_cell.push_back(k.mean);
    by_label.push_back(k.mean_by_label);
    shift.push_back(k.shift.z());
  }
  j["steadiness_per_cell"] = per_cell;
  j["steadiness_by_label_per_cell"] = by_label;
  j["cell_shift_z_m"] = shift;
  j["order_violations"] = s.order_violations;
  j["weft_column_spread_m"] = s.order.column_spread;
  j["weft_column_distances_m"] = s.order.column_distances;
  j["weft_column_distances_behind_fell_m"] = s.column_distances_behind_fell;
  j["wefts_out_of_layer"] = s.order.wefts_out_of_layer;
  j["fiber_slack_max"] = s.order.fiber_slack;
  j["fiber_turn_max_deg"] = s.order.sharpest_turn * 180 / std::numbers::pi;
  j["searches"] = s.searches;
  j["late_rebuilds"] = s.late_searches;
  j["overlap_max"] = s.overlap_max;
  j["energy_residual"] = s.energy_residual;
  j["energy_J"] = {{"kinetic", e.kinetic},
                   {"bars", e.bars},
                   {"bending", e.bending},
                   {"contact", e.contact},
                   {"friction_store", e.friction_store},
                   {"heddle_guides", e.heddle},
                   {"slip", e.flows.slip},
                   {"damping", e.flows.damping},
                   {"axial_waves", e.flows.axial},
                   {"guides_lost", e.flows.guides},
                   {"work_tension", e.flows.tension},
                   {"work_reed", e.flows.reed},
                   {"work_heddles", e.flows.heddle},
                   {"work_take_up", e.flows.take_up},
                   {"edits", s.energy_removed}};
  j["case_toml"] = to_toml(c);
  return j.dump(2) + "\n";
}

}  // namespace weave
