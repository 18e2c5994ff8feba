#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "heddle/envelope_command.hpp"

namespace heddle {

struct PipelineOptions {
  std::filesystem::path case_file;
  std::filesystem::path output;          ///< default ./results/NAME
  std::vector<std::string> overrides;    ///< key.path=value
  std::string until = "homogenize";      ///< last stage: "weave", "relax", "envelope", "mesh" or "homogenize"
  int fibers = 0;                        ///< per yarn, of the relaxed cell; 0: as woven
  double pressure = 0;                   ///< of platens, in the relaxation [Pa]
  std::optional<double> load_x, load_y;  ///< under which the lengths of the relaxed cell are free [N]; none: as woven
  std::string edge_length = EnvelopeCommandOptions{}.edge_length;  ///< of the yarns' surfaces, in fiber diameters, or with a unit of length
  int elements = 12000;                                            ///< of the homogenized mesh, about
  bool tetrahedra = false;                                         ///< in place of voxels, as fine as the yarns' surfaces
  std::string fiber;         ///< material of the fibers, one of weave::known_fibers(); empty: as the case says, else "e_glass"
  bool minima = false;       ///< also relax the start from the weaving matrix alone, and compare both minima with the woven cell
  bool unconverged = false;  ///< go on with a relaxed cell that is no certified minimum
  bool quiet = false;
};

/// Weaves a case, relaxes its last unit cell, makes the yarns' surfaces in all formats, the meshes and decks and the stiffness of the
/// composite, each stage with its pictures in a folder of its own, summary.json with the wall time of each stage's last run, and
/// report.html, which shows all of them. With `minima`, a folder minima has the other minimum and the comparison. A stage whose inputs
/// (case, options, program version, the stages before) are those of its last finished run is kept as it is; an interrupted weave or
/// relaxation goes on from its checkpoint. Returns the exit status: 0 done, else that of the stage that stopped it, 2 where it threw, with
/// its name and message on standard error; the page then shows the stages before.
int run_command(const PipelineOptions& options);

}  // namespace heddle
