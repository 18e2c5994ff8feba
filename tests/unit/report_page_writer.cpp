// Writes a report page of the yarns of a plain weave, for report_page_test.py: heddle_report_page_writer FOLDER
#include <fmt/format.h>

#include <filesystem>

#include "heddle/report_page.hpp"
#include "heddle/surface_files.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"
#include "weave/results.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  const std::filesystem::path folder = argv[1];
  const scenes::PosedCell start = scenes::plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.2, 1);
  const relax::Envelopes envelopes = relax::make_envelopes(relax::snapshot_of(start.cell, start.unknowns()), {});
  heddle::PageContent content;
  content.title = "plain weave";
  content.case_toml = "name = \"plain\"\n";
  weave::write_text_file(folder / "summary.json", "{\"yarns\": 4, \"wall_s\": 0.5}\n");
  content.stages = {{"Yarn envelopes", folder / "summary.json", {"yarns", "wall_s"}, {}}};
  for (const relax::YarnEnvelope& e : envelopes.yarns) {
    const heddle::NamedSurface surface{fmt::format("yarn_{}", e.yarn), e.yarn, &e.surface};
    content.yarns.push_back({folder / (surface.name + ".off"), e.weft});
    heddle::write_surfaces(content.yarns.back().surface, std::span(&surface, 1));
  }
  weave::write_text_file(folder / "page.html", heddle::report_page(content));
}
