#include "heddle/envelope_command.hpp"

#include <fmt/format.h>

#include <chrono>
#include <regex>
#include <stdexcept>

#include "heddle/edge_length.hpp"
#include "heddle/section_plots.hpp"
#include "heddle/section_views.hpp"
#include "heddle/surface_files.hpp"
#include "heddle/texgen_file.hpp"
#include "relax/envelope.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/version.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"
#include "weave/tables.hpp"

namespace heddle {
namespace {

std::filesystem::path cell_file(const std::filesystem::path& input) {
  if (!std::filesystem::is_directory(input)) return input;
  for (const char* name : {"relax.vtkhdf", "cell.vtkhdf"})
    if (std::filesystem::exists(input / name)) return input / name;
  throw std::runtime_error(input.string() + ": holds neither relax.vtkhdf nor cell.vtkhdf");
}

/// What keeps a relaxed cell from being a certified minimum; empty for a certified one and for a woven cell. Throws unless it is empty or
/// accepted.
std::string expect_converged(const std::filesystem::path& file, bool accepted) {
  if (!relax::is_relaxed(file)) return "";
  const relax::RelaxedFile relaxed = relax::read_relaxed(file);
  std::string blocked_by = relaxed.blocked_by ? *relaxed.blocked_by : relax::certify(relaxed.cell, relaxed.q).blocked_by;
  if (!blocked_by.empty() && !accepted) {
    throw std::runtime_error(
        fmt::format("{}: the relaxed cell is no certified minimum: {}; relax it further (heddle relax with more --iterations or "
                    "--first-order), or go on with it by --unconverged",
                    file.string(), blocked_by));
  }
  return blocked_by;
}

std::string name_of(const relax::YarnEnvelope& e) {
  return fmt::format("{}_{}", e.weft ? "weft" : "warp", e.yarn);
}

/// Takes away what the surfaces of another cell, or other formats, have left in a folder. The summary first, which comes last: none stands
/// beside new files.
void remove_old(const std::filesystem::path& output) {
  std::filesystem::remove(output / "summary.json");
  const std::regex of_yarns(
      fmt::format(R"((warp|weft)_\d+_sections\.csv|((warp|weft)_\d+|yarns)\.({}))", fmt::join(envelope_formats, "|")));
  std::vector<std::filesystem::path> old;
  for (const auto& entry : std::filesystem::directory_iterator(output))
    if (std::regex_match(entry.path().filename().string(), of_yarns)) old.push_back(entry.path());
  for (const std::filesystem::path& file : old) std::filesystem::remove(file);
}

weave::Table section_table(const relax::YarnEnvelope& e) {
  weave::Table table{name_of(e), {}};
  const auto add = [&](const char* name, const auto& value) {
    table.columns.emplace_back(name, std::vector<double>());
    for (const relax::YarnSection& s : e.sections) table.columns.back().second.push_back(value(s));
  };
  using Section = relax::YarnSection;
  add("arc_m", [](const Section& s) { return s.arc; });
  add("x_m", [](const Section& s) { return s.centroid.x(); });
  add("y_m", [](const Section& s) { return s.centroid.y(); });
  add("z_m", [](const Section& s) { return s.centroid.z(); });
  add("normal_x", [](const Section& s) { return s.normal.x(); });
  add("normal_y", [](const Section& s) { return s.normal.y(); });
  add("normal_z", [](const Section& s) { return s.normal.z(); });
  add("width_m", [](const Section& s) { return s.width; });
  add("height_m", [](const Section& s) { return s.height; });
  add("rotation_rad", [](const Section& s) { return s.rotation; });
  add("area_m2", [](const Section& s) { return s.area; });
  add("fiber_volume_fraction", [](const Section& s) { return s.fiber_volume_fraction; });
  return table;
}

/// Where a plane normal to an axis cuts a surface and its images along that axis.
YarnLines cut_surface(const relax::YarnEnvelope& e, weave::SectionAxis axis, double value, double period) {
  const int n = axis == weave::SectionAxis::x ? 0 : 1, u = 1 - n;
  YarnLines lines{e.yarn, e.weft, {}};
  for (const int image : {-1, 0, 1}) {
    const double plane = value + image * period;
    for (const auto& t : e.surface.triangles)
      for (std::size_t c = 0; c < 3; ++c) {
        const weave::Vec3 &a = e.surface.points[t[c]], &b = e.surface.points[t[(c + 1) % 3]];
        if ((a[n] < plane) == (b[n] < plane)) continue;
        const weave::Vec3 x = a + (plane - a[n]) / (b[n] - a[n]) * (b - a);
        lines.ends.push_back({x[u], x.z()});  // two for each triangle that is cut
      }
  }
  return lines;
}

/// Sections both ways.
void draw_sections(const weave::ResultsFile& results, const relax::Envelopes& envelopes, const std::filesystem::path& output) {
  const weave::ResultsFile shown{envelopes.fibers, {}, results.case_toml, results.version};
  const weave::Snapshot& s = shown.snapshot;
  for (const weave::SectionAxis axis : {weave::SectionAxis::x, weave::SectionAxis::y}) {
    const bool x = axis == weave::SectionAxis::x;
    const auto surfaces_at = [&](double value) {
      std::vector<YarnLines> lines;
      for (const relax::YarnEnvelope& e : envelopes.yarns)
        lines.push_back(cut_surface(e, axis, value, x ? s.x_max - s.x_min : s.cell_width));
      return lines;
    };
    draw_section_with_lines(shown, axis, surfaces_at, output / (x ? "section_x.png" : "section_y.png"));
  }
}

}  // namespace

int envelope_command(const EnvelopeCommandOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const std::filesystem::path file = cell_file(options.input);
  relax::EnvelopeOptions envelope;
  const EdgeLength edge_length = parse_edge_length(options.edge_length);
  (edge_length.in_diameters ? envelope.edge_length : envelope.edge_length_m) = edge_length.value;
  envelope.ring_distance = options.ring_distance;
  envelope.ball_radius = options.ball_radius;
  envelope.gap = options.gap;
  envelope.tolerance = options.tolerance;
  const std::string blocked_by = expect_converged(file, options.unconverged);
  weave::ResultsFile results = weave::read_results(file);
  results.snapshot = weave::on_axis(results.snapshot);
  const std::string case_name =
      results.case_toml.empty() ? file.stem().string() : weave::parse_case(results.case_toml, file.string() + ": /meta/case_toml").name;
  const relax::Envelopes envelopes = relax::make_envelopes(results.snapshot, envelope);

  const std::filesystem::path output = options.output.empty() ? file.parent_path() / "envelope" : options.output;
  std::filesystem::create_directories(output);
  remove_old(output);
  std::vector<NamedSurface> surfaces;
  std::vector<weave::Table> tables;
  for (const relax::YarnEnvelope& e : envelopes.yarns) {
    surfaces.push_back({name_of(e), e.yarn, &e.surface});
    tables.push_back(section_table(e));
    weave::write_text_file(output / (name_of(e) + "_sections.csv"), weave::to_csv(tables.back()));
  }
  weave::write_tables(output / "sections.h5", tables);
  weave::write_results(output / "fibers.vtkhdf", {envelopes.fibers, {}, results.case_toml, relax::version()});
  draw_sections(results, envelopes, output);
  draw_section_data(envelopes.yarns, false, output / "sections_warps.png");
  draw_section_data(envelopes.yarns, true, output / "sections_wefts.png");
  for (const std::string& format : options.formats) {
    if (format == "tg3") {  // sections, and all yarns in one
      weave::write_text_file(output / "yarns.tg3", texgen_text(envelopes, case_name));
      continue;
    }
    for (const NamedSurface& s : surfaces) write_surfaces(output / (s.name + "." + format), std::span(&s, 1));
    write_surfaces(output / ("yarns." + format), surfaces);
  }
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  weave::write_text_file(output / "summary.json",
                         relax::envelope_summary_json(results.snapshot, envelopes.options, envelopes, case_name, blocked_by, wall));

  const relax::EnvelopeReport& r = envelopes.report;
  fmt::print("{}: {} yarns in {:.2f} s, {}, {} self-intersections, {} mutual intersections\n", case_name, envelopes.yarns.size(), wall,
             r.closed ? "closed" : "NOT CLOSED", r.self_intersections, r.mutual_intersections);
  if (!blocked_by.empty()) fmt::print("  of a relaxed cell that is no certified minimum: {}\n", blocked_by);
  fmt::print("  surface to fibers {:.3f} radii (mean), {:.3f} (largest), {:.3f} (largest protrusion); least gap {:.3g} m\n",
             r.distance_mean, r.distance_max, r.protrusion_max, r.gap_min);
  fmt::print("  results in {}\n", output.string());
  return r.closed && r.self_intersections == 0 && r.mutual_intersections == 0 ? 0 : 1;
}

}  // namespace heddle
