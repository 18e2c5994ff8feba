#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <exception>

#include "heddle/compare_command.hpp"
#include "heddle/envelope_command.hpp"
#include "heddle/homogenize_command.hpp"
#include "heddle/mesh_command.hpp"
#include "heddle/relax_command.hpp"
#include "heddle/results_folder.hpp"
#include "heddle/run_command.hpp"
#include "heddle/study_command.hpp"
#include "heddle/view.hpp"
#include "heddle/weave_command.hpp"
#include "weave/case.hpp"
#include "weave/version.hpp"

namespace {

/// Options of the commands that mesh a composite unit cell.
void add_composite_options(CLI::App& app, heddle::CompositeOptions& o) {
  app.add_option("envelopes", o.input, "folder that `heddle envelope` wrote")->required();
  app.add_option("-o,--output", o.output, "results folder (default mesh or homogenized in the folder of the envelopes)");
  auto* voxels = app.add_option("--voxels", o.voxels, "elements along x, y and z")->expected(3)->check(CLI::Range(1, 100000));
  auto* size = app.add_option("--voxel-size", o.voxel_size, "edge of an element, about [m]")->check(CLI::PositiveNumber)->excludes(voxels);
  auto* elements = app.add_option("--elements", o.elements, "about so many, twice as long along x and y as high")
                       ->capture_default_str()
                       ->check(CLI::Range(1, 100000000))
                       ->excludes(voxels)
                       ->excludes(size);
  auto* tetrahedra = app.add_flag("--tetrahedra", o.tetrahedra, "elements that conform to the yarns' surfaces, in place of voxels")
                         ->excludes(voxels)
                         ->excludes(size)
                         ->excludes(elements);
  app.add_option("--edge-length", o.edge_length,
                 "of the tetrahedra, about, in fiber diameters, or with a unit: \"50 um\" (default: the mean of the surfaces' edges)")
      ->needs(tetrahedra);
  app.add_option("--resin-margin", o.resin_margin, "resin above and below the yarns [m] (default 0; a tenth of an edge with tetrahedra)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--kernel-radius", o.kernel_radius, "fibers within it make a point's local volume fraction [fiber diameters]")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--fiber", o.fiber,
                 "e_glass, s2_glass, aramid, carbon or a material of the case (default: that of its yarns, else e_glass)");
  app.add_option("--fiber-e1", o.fiber_e1, "along the fiber [Pa] (default: of the named fiber)")->check(CLI::PositiveNumber);
  app.add_option("--fiber-e2", o.fiber_e2, "across [Pa]")->check(CLI::PositiveNumber);
  app.add_option("--fiber-g12", o.fiber_g12, "[Pa]")->check(CLI::PositiveNumber);
  app.add_option("--fiber-nu12", o.fiber_nu12, "")->check(CLI::Range(-0.99, 5.0));
  app.add_option("--fiber-nu23", o.fiber_nu23, "")->check(CLI::Range(-0.99, 0.99));
  app.add_option("--matrix-e", o.matrix_e, "[Pa] (default: the case's, else 3.45e9)")->check(CLI::PositiveNumber);
  app.add_option("--matrix-nu", o.matrix_nu, "(default: the case's, else 0.35)")->check(CLI::Range(-0.99, 0.499));
  app.add_option("--rule", o.rule, "of micromechanics within yarns")
      ->capture_default_str()
      ->check(CLI::IsMember({"chamis", "mori_tanaka"}));
  app.add_option("--bins", o.bins, "materials by local fiber volume fraction")->capture_default_str()->check(CLI::Range(1, 10000));
  app.add_flag("--free-z", o.free_z, "top and bottom free of stress, not periodic");
}

/// Options that change what a case says; a value that is set goes before the accuracy's.
void add_case_changes(CLI::App& app, std::vector<std::string>& overrides) {
  app.add_option("--set", overrides, "change a value of the case: key.path=value")->type_name("KEY=VALUE");
  app.add_option_function<std::string>(
         "--accuracy",
         [&overrides](const std::string& level) {
           const std::vector<std::string> changes = weave::accuracy_overrides(level);
           overrides.insert(overrides.begin(), changes.begin(), changes.end());
         },
         "draft, normal or reference: elements of 3, 2 or 0.5 fiber diameters, and for the last half the time step")
      ->check(CLI::IsMember({"draft", "normal", "reference"}));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Heddle weaves a fabric on a simulated loom, fiber by fiber."};
  app.set_version_flag("--version", weave::version());
  app.require_subcommand(1);

  heddle::CheckOptions check;
  CLI::App* check_app = app.add_subcommand("check", "Read a case and say what would be run");
  check_app->add_option("case", check.case_file, "case file (TOML), or a folder with a case.toml")->required();
  add_case_changes(*check_app, check.overrides);
  check_app->add_option("--draft", check.draft, "draw the weave into this file (.png, .svg, .pdf)");

  heddle::WeaveOptions weave_options;
  CLI::App* weave_app = app.add_subcommand("weave", "Weave a case");
  weave_app->add_option("case", weave_options.case_file, "case file (TOML), or a folder with a case.toml")->required();
  weave_app->add_option("-o,--output", weave_options.output, "results folder (default results/NAME)");
  add_case_changes(*weave_app, weave_options.overrides);
  weave_app->add_option("-j,--threads", weave_options.threads, "threads (default all)")->check(CLI::Range(1, 1024));
  weave_app->add_flag("--resume", weave_options.resume, "go on from the checkpoint in the results folder");
  weave_app->add_option("--picks", weave_options.picks, "stop after so many picks, to look at the cloth; --resume goes on")
      ->check(CLI::Range(1, 1000000));
  weave_app->add_flag("-q,--quiet", weave_options.quiet, "no progress");

  heddle::RelaxOptions relax;
  CLI::App* relax_app = app.add_subcommand("relax", "Relax a unit cell to a certified minimum of its energy");
  relax_app->add_option("input", relax.input, "results folder or .vtkhdf file of a woven cell; or a case, to start from its topology")
      ->required();
  relax_app->add_option("-o,--output", relax.output, "results folder (default results/NAME_relaxed)");
  add_case_changes(*relax_app, relax.overrides);
  relax_app->add_option("--fibers", relax.fibers, "digital fibers a yarn, e.g. 37, 61, 127, refined from those of the start")
      ->check(CLI::Range(1, 1000));
  relax_app->add_option("--start-fibers", relax.start_fibers, "digital fibers a yarn of a start from topology (default as in the case)")
      ->check(CLI::Range(1, 1000));
  relax_app
      ->add_option("--starts", relax.starts, "relax as many starts, all but the first with fibers moved at random, and compare the minima")
      ->check(CLI::Range(1, 1000));
  relax_app->add_option("--warp-tension", relax.warp_tension, "per yarn [N] (default: woven tensions; from topology the case's)")
      ->check(CLI::PositiveNumber);
  relax_app
      ->add_option("--weft-tension", relax.weft_tension, "per yarn [N] (default: woven tensions; from topology the warp's or the loom's)")
      ->check(CLI::PositiveNumber);
  relax_app->add_option("--pressure", relax.pressure, "of platens above and below [Pa]")->check(CLI::NonNegativeNumber);
  relax_app
      ->add_option("--pressures", relax.pressures,
                   "of platens, one after the other, each from the minimum of the one before, e.g. 0,1000,5000,25000 [Pa]")
      ->delimiter(',')
      ->check(CLI::NonNegativeNumber);
  relax_app
      ->add_option("--load-x", relax.load_x, "force that pulls the cell along x, whose length is free then [N] (default: given length)")
      ->check(CLI::NonNegativeNumber);
  relax_app->add_option("--load-y", relax.load_y, "the same along y [N]")->check(CLI::NonNegativeNumber);
  relax_app
      ->add_option("--element-length", relax.element_length,
                   "[fiber diameters] (default 2; of more than 19 fibers a yarn as long as of 19)")
      ->check(CLI::PositiveNumber);
  relax_app
      ->add_option(
          "--method", relax.method,
          "dynamic: damped motion (first-order phase) alone; newton: Newton's method alone; auto: the one until contacts calm down, "
          "then the other")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "dynamic", "newton"}));
  relax_app
      ->add_option("--tolerance", relax.tolerance,
                   "at which to stop: gradient over the reference tension, Newton step in fiber diameters; above the default no minimum is "
                   "certified")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  relax_app->add_option("--iterations", relax.iterations, "of Newton's method, at most")->check(CLI::Range(0, 100000));
  relax_app->add_option("--first-order", relax.first_order, "steps of the first-order phases, at most")->check(CLI::Range(0, 1000000));
  relax_app->add_option("--series", relax.series, "relax the same start at several counts of digital fibers a yarn, e.g. 19,37,61")
      ->delimiter(',')
      ->check(CLI::Range(1, 1000));
  relax_app->add_option("-j,--threads", relax.threads, "threads (default all)")->check(CLI::Range(1, 1024));
  relax_app->add_flag("--resume", relax.resume, "go on from the checkpoint in the results folder; keep what is finished of a series");
  relax_app->add_flag("-q,--quiet", relax.quiet, "no progress");

  heddle::CompareOptions compare;
  CLI::App* compare_app = app.add_subcommand("compare", "Compare relaxed states of one cell with one another and with the woven one");
  compare_app->add_option("results", compare.results, "folders that `heddle relax` wrote")->required();
  compare_app->add_option("--woven", compare.woven, "results folder or .vtkhdf file of the woven cell that they started from");
  compare_app->add_option("-o,--output", compare.output, "folder (default results/comparison)");

  heddle::EnvelopeCommandOptions envelope;
  CLI::App* envelope_app = app.add_subcommand("envelope", "Make closed surfaces of the yarns of a unit cell");
  envelope_app->add_option("result", envelope.input, "results folder or .vtkhdf file of a relaxed or a woven cell")->required();
  envelope_app->add_option("-o,--output", envelope.output, "folder (default RESULT/envelope)");
  envelope_app->add_option("--edge-length", envelope.edge_length, "around a section, in fiber diameters, or with a unit: \"5 um\"")
      ->capture_default_str();
  envelope_app->add_option("--ring-distance", envelope.ring_distance,
                           "along a yarn [fiber diameters] (default two edge lengths, at most 1)");
  envelope_app->add_option("--ball-radius", envelope.ball_radius, "of the ball rolled around a section [fiber diameters]")
      ->capture_default_str();
  envelope_app->add_option("--gap", envelope.gap, "least distance between yarns [fiber diameters]")->capture_default_str();
  envelope_app
      ->add_option("--tolerance", envelope.tolerance,
                   "largest distance of the surfaces from the fibers, for which edges and ring distance are shortened [fiber radii] "
                   "(default: as the edge length leaves it)")
      ->check(CLI::PositiveNumber);
  envelope_app->add_option("--formats", envelope.formats, "of the surfaces: stl, obj, ply, off, vtp; tg3: sections for TexGen")
      ->delimiter(',')
      ->check(CLI::IsMember(heddle::envelope_formats))
      ->capture_default_str();
  envelope_app->add_flag("--unconverged", envelope.unconverged, "go on with a relaxed cell that is no certified minimum");

  heddle::CompositeOptions mesh;
  CLI::App* mesh_app = app.add_subcommand("mesh", "Mesh a composite unit cell; write VTU, Gmsh, Abaqus and CalculiX files");
  add_composite_options(*mesh_app, mesh);
  mesh_app->add_flag("--quadratic", mesh.quadratic, "tetrahedra with nodes at the middles of their edges, as homogenize takes them")
      ->needs("--tetrahedra");

  heddle::HomogenizeCommandOptions homogenize;
  CLI::App* homogenize_app = app.add_subcommand("homogenize", "Stiffness of a composite unit cell, by CalculiX");
  add_composite_options(*homogenize_app, homogenize);
  homogenize_app->add_option("--ccx", homogenize.ccx, "CalculiX")->capture_default_str();
  homogenize_app->add_flag("!--no-mesh-error", homogenize.mesh_error, "do not also solve on a coarser mesh");

  heddle::PipelineOptions pipeline;
  CLI::App* run_app = app.add_subcommand(
      "run", "Weave a case, relax its cell, make the yarns' surfaces, the meshes and the composite's stiffness, and a page of it all");
  run_app->add_option("case", pipeline.case_file, "case file (TOML), or a folder with a case.toml")->required();
  run_app->add_option("-o,--output", pipeline.output, "results folder (default results/NAME)");
  add_case_changes(*run_app, pipeline.overrides);
  run_app->add_option("--until", pipeline.until, "last stage")
      ->capture_default_str()
      ->check(CLI::IsMember({"weave", "relax", "envelope", "mesh", "homogenize"}));
  run_app->add_option("--fibers", pipeline.fibers, "digital fibers a yarn of the relaxed cell (default as woven)")
      ->check(CLI::Range(1, 1000));
  run_app->add_option("--pressure", pipeline.pressure, "of platens above and below the relaxed cell [Pa]")->check(CLI::NonNegativeNumber);
  run_app
      ->add_option("--load-x", pipeline.load_x,
                   "force that pulls the relaxed cell along x, whose length is free then [N] (default: as woven)")
      ->check(CLI::NonNegativeNumber);
  run_app->add_option("--load-y", pipeline.load_y, "the same along y [N]")->check(CLI::NonNegativeNumber);
  run_app->add_option("--edge-length", pipeline.edge_length, "of the yarns' surfaces, in fiber diameters, or with a unit: \"5 um\"")
      ->capture_default_str();
  auto* pipeline_elements = run_app->add_option("--elements", pipeline.elements, "of the homogenized mesh, about")
                                ->capture_default_str()
                                ->check(CLI::Range(8, 10000000));
  run_app->add_flag("--tetrahedra", pipeline.tetrahedra, "a mesh that conforms to the yarns' surfaces, in place of voxels")
      ->excludes(pipeline_elements);
  run_app->add_option("--fiber", pipeline.fiber,
                      "e_glass, s2_glass, aramid, carbon or a material of the case (default: that of its yarns, else e_glass)");
  run_app->add_flag("--minima", pipeline.minima,
                    "also relax the start from the weaving matrix alone, and compare both with the woven cell");
  run_app->add_flag("--unconverged", pipeline.unconverged, "go on with a relaxed cell that is no certified minimum");
  run_app->add_flag("-q,--quiet", pipeline.quiet, "no progress");

  heddle::StudyOptions study;
  bool resume_study = false;
  CLI::App* study_app = app.add_subcommand("study", "Run a case with many values and collect the figures");
  study_app->add_option("study", study.study_file, "study file (TOML), or a folder with a study.toml")->required();
  study_app->add_option("-o,--output", study.output, "results folder (default results/NAME)");
  study_app->add_flag("--list", study.list, "say what would be run, with time and memory; run nothing");
  study_app->add_option("--only", study.only, "a single run of the study, by its name");
  study_app->add_option("--jobs", study.jobs, "runs at a time (default from cores and memory)")->check(CLI::Range(1, 100000));
  study_app->add_option("-j,--threads", study.threads, "threads of each run (default from cores and jobs)")->check(CLI::Range(1, 1024));
  study_app
      ->add_option("--reuse", study.reuse,
                   "folder of another study, or of `heddle run`, to take cloths from instead of weaving them again; may be repeated")
      ->allow_extra_args(false);
  study_app->add_flag("--resume", resume_study, "go on with what is not finished; this is done without it too");
  study_app->add_flag("--retry", study.retry, "run those again that failed");
  study_app->add_option("--engine", study.engine, "local, or slurm: a job array on a cluster")->check(CLI::IsMember({"local", "slurm"}));
  study_app->add_option("--sbatch", study.sbatch, "option for sbatch, e.g. --sbatch=--partition=long; may be repeated")
      ->type_name("OPTION");
  study_app->add_option("--program", study.program)->group("");
  study_app->add_option("--poll", study.poll)->group("");
  study_app->add_flag("-q,--quiet", study.quiet, "no progress");

  heddle::ViewOptions view;
  CLI::App* view_app = app.add_subcommand("view", "Draw pictures of a result");
  view_app->add_option("result", view.results, "results folder or .vtkhdf file")->required();
  view_app->add_option("-o,--output", view.output, "folder for the pictures (default RESULT/pictures)");
  view_app->add_option("--format", view.format, "png, svg or pdf")->check(CLI::IsMember({"png", "svg", "pdf"}));
  view_app->add_option("--color", view.color, "yarn or stress")->check(CLI::IsMember({"yarn", "stress"}));
  view_app->add_option("--x", view.sections_x, "cut at x [m]");
  view_app->add_option("--y", view.sections_y, "cut at y [m]");
  view_app->add_option("--width", view.width_px, "picture width [px]")->check(CLI::Range(400, 16000));
  CLI11_PARSE(app, argc, argv);

  try {
    relax.input = heddle::stage_folder(relax.input, "weave");
    for (std::filesystem::path& result : compare.results) result = heddle::stage_folder(result, "relax");
    compare.woven = heddle::stage_folder(compare.woven, "weave");
    envelope.input = heddle::stage_folder(envelope.input, "relax");
    mesh.input = heddle::stage_folder(mesh.input, "envelope");
    homogenize.input = heddle::stage_folder(homogenize.input, "envelope");
    view.results = heddle::stage_folder(view.results, "weave");
    if (*check_app) return heddle::check_command(check);
    if (*weave_app) return heddle::weave_command(weave_options);
    if (*relax_app) return heddle::relax_command(relax);
    if (*compare_app) return heddle::compare_command(compare);
    if (*envelope_app) return heddle::envelope_command(envelope);
    if (*mesh_app) return heddle::mesh_command(mesh);
    if (*run_app) return heddle::run_command(pipeline);
    if (*homogenize_app) return heddle::homogenize_command(homogenize);
    if (*study_app) return heddle::study_command(study);
    if (view.output.empty()) {
      view.output = (std::filesystem::is_directory(view.results) ? view.results : view.results.parent_path()) / "pictures";
    }
    for (const auto& file : heddle::view(view)) fmt::print("{}\n", file.string());
    return 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 2;
  }
}
