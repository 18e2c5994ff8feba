#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "relax/minimize.hpp"
#include "relax/refine.hpp"

namespace relax {

/// A relaxed cell on file: a results file as weave::read_results reads it, with the fibers as relax::snapshot_of gives them, and beside it
/// the cell and its unknowns, from which relaxation can be taken up again, and the history of the minimization.
struct RelaxedFile {
  Cell cell;
  Eigen::VectorXd q;
  std::vector<MinimizeProgress> history;
  std::string case_toml;                  ///< resolved case
  std::string options;                    ///< of the command, a line "name = value" for each
  std::string version;                    ///< program version and source revision
  std::optional<std::string> blocked_by;  ///< as in its Certificate: empty for a certified minimum; none where the file does not say
  Eigen::VectorXd start = {};             ///< unknowns of the cell that the command started from; none where the file does not say
};

/// Writes aside and renames. Throws std::runtime_error naming file and cause.
void write_relaxed(const std::filesystem::path& file, const RelaxedFile& relaxed);

/// Whether the file is of a relaxed cell; false for one of a woven cell. Throws std::runtime_error naming the file if it is no HDF5 file.
bool is_relaxed(const std::filesystem::path& file);

/// Throws std::runtime_error naming file and cause if it is not of a relaxed cell.
RelaxedFile read_relaxed(const std::filesystem::path& file);

/// A relaxation that was interrupted: a cell on its way to a minimum, and what it is a relaxation of.
struct Checkpoint {
  std::string case_toml;
  std::string options;    ///< as in RelaxedFile
  Eigen::VectorXd start;  ///< unknowns of the cell that the command starts from, before any refinement
  bool refined = false;   ///< past the coarse cell's way, on the refined cell
  Cell cell;
  Eigen::VectorXd cell_start;  ///< its unknowns at the start
  MinimizeState state;
  double wall = 0;             ///< of the command [s]
  RefinementCheck refinement;  ///< area and order, where refined
};

/// Writes aside and renames. Throws std::runtime_error naming file and cause.
void write_checkpoint(const std::filesystem::path& file, const Checkpoint& checkpoint);

/// Throws std::runtime_error naming file and cause.
Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace relax
