#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "weave/material.hpp"
#include "weave/weaving_matrix.hpp"

namespace weave {

/// A yarn type. Solid area A = linear_density / density; a digital fiber has area A/fibers and radius sqrt(A/(fibers pi packing)).
struct YarnType {
  std::string name;
  double linear_density = 0;         ///< [kg/m]
  double density = 0;                ///< of the solid material [kg/m^3]
  double youngs_modulus = 0;         ///< along the fiber, of the solid material [Pa]
  double transverse_modulus = 1e9;   ///< E_T of the digital fiber, of the bundle and not of the solid material [Pa]
  double packing = 0.82;             ///< filaments' packing inside a digital fiber; 1 in Yang 2015
  double compression_factor = 1e-4;  ///< of the axial stiffness when a bar is shorter than its rest length
  double bending_stiffness = 0;      ///< sum of E I over the yarn's filaments [N m^2]; 0 as in Yang 2015
  int fibers = 7;                    ///< digital fibers a yarn: 1, 3, 5 or a centred hexagonal count 7, 19, 37, ...
  std::string material = {};         ///< of its fibers in a composite, one of Case::materials or known_fibers(); empty: not given
  /// Coulomb coefficient between the digital fibers of one yarn; Case::friction unless the case file gives it. They stand for packed
  /// filaments, which interlock: what it has beyond Case::friction holds across the fibers alone, whatever slides along them.
  std::optional<double> friction_within = {};

  [[nodiscard]] double fiber_area() const;    ///< solid area of one digital fiber [m^2]
  [[nodiscard]] double fiber_radius() const;  ///< contact radius of one digital fiber [m]
};

/// The warps that lie in one plane normal to y, top to bottom.
struct WarpSection {
  std::string yarn;      ///< name of its yarn type
  int dent = 0;          ///< reed dent it passes, 0-based within the unit cell
  double tension = 0;    ///< at the heddle, per yarn [N]; loom.tension where the section gives none
  WeavingMatrix matrix;  ///< (picks a cell x warps of the section)
};

struct WeftSpec {
  std::vector<std::string> yarn_of_layer;  ///< yarn type per layer, in order of insertion (top layer first)
  double length_coefficient = 1.01;        ///< rest length / nominal length
};

struct LoomSpec {
  double length = 0.0254;         ///< fell to heddle [m]
  double height = 0.7 * 0.0254;   ///< between the upper and the lower heddle position [m]
  double dent_width = 0;          ///< [m]
  double tension = 3;             ///< at the heddle, per warp yarn [N]
  double reed_bar_radius = 2e-4;  ///< [m]
};

struct InsertionSpec {
  double distance = 0;  ///< of the inserted weft from the fell [m]; default 0.45 loom lengths
  double time = 2e-3;   ///< [s]
};

struct BeatUpSpec {
  bool enabled = true;
  double travel = 0;       ///< of the reed from its rest position to the fell [m]; default 0.7 loom lengths
  double top_speed = 4.5;  ///< [m/s]; with constant acceleration the stroke takes 2 travel / top_speed
  double dwell = 0;        ///< at the fell [s]
  double return_time = 0;  ///< back to rest [s]; default the time of the stroke
  double return_delay =
      1;  ///< share (0...1) of the shedding that is done before the reed leaves the fell; 0: it leaves at once, before the shedding
};

struct SheddingSpec {
  double time = 8e-3;  ///< of a full stroke from one heddle position to the other [s]
};

struct TakeUpSpec {
  double length = 0;   ///< per weft column [m]
  int flags = 1;       ///< takings-up per weft column; each takes length / flags
  double time = 2e-3;  ///< of one taking-up [s]
};

struct NumericsSpec {
  double element_length = 2.0;      ///< [fiber diameters], of each fiber's own diameter
  std::string contact = "line";     ///< "line": conservative line contact; "node": node-to-node law of Yang 2015, eq. 3-7
  std::string integrator = "imex";  ///< "imex": tensions of the bars implicit; "explicit"
  double time_step = 0;             ///< [s]; 0: chosen from the model
  double safety = 0.95;             ///< fraction of the stability limit
  double damping = 100;             ///< mass-proportional [1/s]
  double axial_damping = 0.05;      ///< of explicit bars, fraction of critical
  double skin = 0.5;                ///< of the contacts that are evaluated [largest fiber diameters]
  double outer_skin = 1.6;          ///< of the neighbor list that they are picked from [largest fiber diameters]
};

struct OutputSpec {
  double checkpoint_interval = 60;  ///< wall time between checkpoints [s]
  double history_interval = 0;      ///< simulated time between history rows [s]; 0: 1/400 of a pick
};

/// The matrix of a composite, isotropic.
struct MatrixSpec {
  double e = 0;  ///< [Pa]
  double nu = 0;
};

/// A weaving case as read from its file: everything that a run needs, checked, in SI units.
struct Case {
  std::string name, title;
  std::map<std::string, YarnType> yarns;
  std::vector<WarpSection> sections;
  WeftSpec weft;
  int layers = 1;   ///< weft layers in a column
  int columns = 1;  ///< weft columns in a unit cell; picks a cell = layers * columns
  InsertionOrder insertion_order = InsertionOrder::top_first;
  int cells = 3;                ///< unit cells to weave
  int kept_cells = 1;           ///< woven cells that stay on the loom before the oldest is cut off and stored
  int columns_behind_fell = 1;  ///< between the fell and the unit cell that is taken, in which the cloth still settles
  double friction = 0.2;        ///< Coulomb coefficient between all fibers and with the reed
  double settle_time = 1e-3;    ///< rest after each action [s]
  LoomSpec loom;
  InsertionSpec insertion;
  BeatUpSpec beat_up;
  SheddingSpec shedding;
  TakeUpSpec take_up;
  NumericsSpec numerics;
  OutputSpec output;
  std::map<std::string, TransverseIsotropic> materials;  ///< of fibers, given in the case
  std::optional<MatrixSpec> matrix_material;             ///< none: not given

  [[nodiscard]] int picks_per_cell() const { return layers * columns; }
  [[nodiscard]] int layer_of_pick(int pick) const;  ///< from the top, from 0; pick counted from 0 within the cell
  [[nodiscard]] int warps() const;                  ///< warp yarns in a unit cell
  [[nodiscard]] double warp_tension() const;        ///< of all warps of a unit cell, at the heddles [N]
  [[nodiscard]] int dents() const;                  ///< reed dents in a unit cell
  [[nodiscard]] double cell_width() const;          ///< along y [m]
  [[nodiscard]] double cell_length() const;         ///< along x: columns * take_up.length [m]
  [[nodiscard]] WeavingMatrix matrix() const;       ///< whole fabric's, sections side by side (picks a cell x warps)
};

/// The user's mistake in a case: the message reads "FILE:LINE: KEY = VALUE: what is wrong and the bound".
class CaseError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads and checks a TOML case file. Unknown keys, missing keys, wrong units, contradictions and values out of range throw CaseError,
/// with all the mistakes found, one a line.
/// A folder stands for the case.toml in it. `overrides` are "key.path=value" assignments (TOML values) applied before checking, as given
/// on a command line.
Case load_case(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});

/// Overrides that set the lengths of elements and steps for a level of accuracy: "draft", "normal" (the defaults) or "reference". Where the
/// levels lie between run time and error is measured by tests/benchmark/ladder.cpp. Throws std::invalid_argument for another level.
std::vector<std::string> accuracy_overrides(const std::string& level);

/// Same from text; `file` only names the source in messages.
Case parse_case(const std::string& text, const std::string& file, const std::vector<std::string>& overrides = {});

/// The case as TOML with every default written out, in SI units, materials only where the case gives them; parse_case(to_toml(c)) gives c
/// back to the bit.
std::string to_toml(const Case& c);

}  // namespace weave
