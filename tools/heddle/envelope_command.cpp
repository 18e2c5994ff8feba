#include "envelope_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <stdexcept>

#include "heddle/surface_files.hpp"
#include "relax/envelope.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"
#include "weave/units.hpp"

namespace heddle {
namespace {

std::filesystem::path cell_file(const std::filesystem::path& input) {
  if (!std::filesystem::is_directory(input)) return input;
  for (const char* name : {"relax.vtkhdf", "cell.vtkhdf"})
    if (std::filesystem::exists(input / name)) return input / name;
  throw std::runtime_error(input.string() + ": holds neither relax.vtkhdf nor cell.vtkhdf");
}

/// A bare number counts fiber diameters.
void set_edge_length(relax::EnvelopeOptions& options, const std::string& text) {
  try {
    if (text.find_first_not_of("0123456789.eE+-") == std::string::npos)
      options.edge_length = weave::parse_quantity(text, weave::Dimension::number);
    else
      options.edge_length_m = weave::parse_quantity(text, weave::Dimension::length);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument(fmt::format("--edge-length {}: {}", text, e.what()));
  }
}

std::string name_of(const relax::YarnEnvelope& e) {
  return fmt::format("{}_{}", e.weft ? "weft" : "warp", e.yarn);
}

std::string sections_csv(const relax::YarnEnvelope& e) {
  std::string text = "arc_m,x_m,y_m,z_m,width_m,height_m,area_m2,fiber_volume_fraction,rotation_rad\n";
  for (const relax::YarnSection& s : e.sections)
    text += fmt::format("{},{},{},{},{},{},{},{},{}\n", s.arc, s.centroid.x(), s.centroid.y(), s.centroid.z(), s.width, s.height, s.area,
                        s.fiber_volume_fraction, s.rotation);
  return text;
}

}  // namespace

int envelope_command(const EnvelopeCommandOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const std::filesystem::path file = cell_file(options.input);
  relax::EnvelopeOptions envelope;
  set_edge_length(envelope, options.edge_length);
  envelope.ring_distance = options.ring_distance;
  envelope.ball_radius = options.ball_radius;
  envelope.gap = options.gap;
  const weave::ResultsFile results = weave::read_results(file);
  const std::string case_name =
      results.case_toml.empty() ? file.stem().string() : weave::parse_case(results.case_toml, file.string() + ": /meta/case_toml").name;
  const relax::Envelopes envelopes = relax::make_envelopes(results.snapshot, envelope);

  const std::filesystem::path output = options.output.empty() ? file.parent_path() / "envelope" : options.output;
  std::filesystem::create_directories(output);
  std::vector<NamedSurface> surfaces;
  for (const relax::YarnEnvelope& e : envelopes.yarns) {
    surfaces.push_back({name_of(e), e.yarn, &e.surface});
    weave::write_text_file(output / (name_of(e) + "_sections.csv"), sections_csv(e));
  }
  for (const std::string& format : options.formats) {
    for (const NamedSurface& s : surfaces) write_surfaces(output / (s.name + "." + format), std::span(&s, 1));
    write_surfaces(output / ("yarns." + format), surfaces);
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  weave::write_text_file(output / "summary.json", relax::envelope_summary_json(results.snapshot, envelope, envelopes, case_name, wall));

  const relax::EnvelopeReport& r = envelopes.report;
  fmt::print("{}: {} yarns in {:.2f} s, {}, {} self-intersections, {} mutual intersections\n", case_name, envelopes.yarns.size(), wall,
             r.closed ? "closed" : "NOT CLOSED", r.self_intersections, r.mutual_intersections);
  fmt::print("  surface to fibers {:.3f} radii (mean), {:.3f} (largest), {:.3f} (largest protrusion); least gap {:.3g} m\n",
             r.distance_mean, r.distance_max, r.protrusion_max, r.gap_min);
  fmt::print("  results in {}\n", output.string());
  return r.closed && r.self_intersections == 0 && r.mutual_intersections == 0 ? 0 : 1;
}

}  // namespace heddle
