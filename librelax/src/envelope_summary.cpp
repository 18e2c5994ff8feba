#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "relax/envelope.hpp"
#include "relax/version.hpp"
#include "weave/measures.hpp"
#include "weave/peak_memory.hpp"

namespace relax {
namespace {

/// Mean and extremes over the sections of a yarn, of which the last is the first one's image.
nlohmann::ordered_json spread_of(const std::vector<double>& values) {
  const auto [least, largest] = std::minmax_element(values.begin(), values.end());
  const double mean = std::accumulate(values.begin(), values.end() - 1, 0.0) / static_cast<double>(values.size() - 1);
  return {{"mean", std::clamp(mean, *least, *largest)},  // that of equal values is one of them but for round-off
          {"min", *least},
          {"max", *largest}};
}

nlohmann::ordered_json sections_json(const std::vector<YarnSection>& sections) {
  const auto each = [&](double YarnSection::*value) {
    std::vector<double> values;
    for (const YarnSection& s : sections) values.push_back(s.*value);
    return spread_of(values);
  };
  return {{"width_m", each(&YarnSection::width)},
          {"height_m", each(&YarnSection::height)},
          {"area_m2", each(&YarnSection::area)},
          {"fiber_volume_fraction", each(&YarnSection::fiber_volume_fraction)},
          {"rotation_rad", spread_of(continuous_rotation(sections))}};
}

}  // namespace

std::string envelope_summary_json(const weave::Snapshot& cell, const EnvelopeOptions& options, const Envelopes& envelopes,
                                  const std::string& case_name, const std::string& blocked_by, double wall) {
  using nlohmann::ordered_json;
  const weave::CellMeasures measures = weave::measure_cell(cell);
  std::size_t triangles = 0;
  double volume = 0, space = 0, solid = 0;
  ordered_json yarns = ordered_json::array();
  for (const YarnEnvelope& e : envelopes.yarns) {
    triangles += e.surface.triangles.size();
    volume += e.volume;
    space += e.fiber_space;
    solid += e.fiber_volume;
    yarns.push_back({{"yarn", e.yarn},
                     {"weft", e.weft},
                     {"rings", e.rings},
                     {"ring_points", e.ring_points},
                     {"triangles", e.surface.triangles.size()},
                     {"ball_radius_m", e.ball_radius},
                     {"volume_m3", e.volume},
                     {"volume_moved_m3", e.volume_moved},
                     {"volume_ratio", e.volume / e.fiber_space},
                     {"fiber_volume_fraction", e.fiber_volume / e.volume},
                     {"sections", sections_json(e.sections)}});
  }
  const double cell_volume = (cell.x_max - cell.x_min) * cell.cell_width * measures.thickness;
  const EnvelopeReport& r = envelopes.report;
  const EnvelopeWall& w = envelopes.wall;
  ordered_json j;
  j["tool"] = "envelope";
  j["case"] = case_name;
  j["version"] = version();
  j["cell_blocked_by"] = blocked_by;
  j["yarns"] = envelopes.yarns.size();
  j["triangles"] = triangles;
  j["closed"] = r.closed;
  j["self_intersections"] = r.self_intersections;
  j["mutual_intersections"] = r.mutual_intersections;
  j["periodic_mismatch_m"] = r.periodic_mismatch;
  j["gap_min_m"] = r.gap_min;
  j["distance_mean_radii"] = r.distance_mean;
  j["distance_max_radii"] = r.distance_max;
  j["protrusion_max_radii"] = r.protrusion_max;
  j["volume_ratio"] = volume / space;
  j["yarn_volume_fraction"] = volume / cell_volume;
  j["fiber_volume_fraction"] = solid / cell_volume;
  j["fiber_volume_fraction_in_yarns"] = solid / volume;
  j["thickness_m"] = measures.thickness;
  j["lean"] = envelopes.lean;
  j["intrusion"] = envelopes.intrusion;
  j["stray_share"] = envelopes.stray_share;
  j["face_mismatch_largest"] = envelopes.face_mismatch;
  j["edge_length"] = options.edge_length;
  j["edge_length_m"] = options.edge_length_m;
  j["ring_distance"] = options.ring_distance;
  j["ball_radius"] = options.ball_radius;
  j["gap"] = options.gap;
  j["tolerance_radii"] = options.tolerance > 0 ? ordered_json(options.tolerance) : ordered_json();
  j["wall_s"] = wall;
  j["stage_wall_s"] = {
      {"sections", w.sections}, {"separation", w.separation}, {"caps", w.caps}, {"check", w.check}, {"distance", w.distance}};
  j["peak_memory_bytes"] = weave::peak_memory_bytes();
  j["by_yarn"] = yarns;
  return j.dump(2) + "\n";
}

}  // namespace relax
