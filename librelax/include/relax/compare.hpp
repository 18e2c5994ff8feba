#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "relax/minimize.hpp"
#include "weave/measures.hpp"
#include "weave/snapshot.hpp"
#include "weave/weaving_matrix.hpp"

namespace relax {

/// What is compared: a relaxed cell, or the woven one that relaxation starts from.
struct ComparedState {
  std::string name;            ///< of its folder
  std::filesystem::path file;  ///< results file that it was read from
  std::string case_name, case_toml;
  weave::WeavingMatrix matrix;
  Cell cell;
  Eigen::VectorXd q;  ///< unknowns
  weave::Snapshot snapshot;
  weave::CellMeasures measures;

  bool relaxed = false;  ///< what follows is of a relaxed state only
  EnergyParts energy;
  Certificate certificate;

  [[nodiscard]] double diameter() const;              ///< of its thickest fiber [m]
  [[nodiscard]] std::size_t fibers_per_yarn() const;  ///< of the first yarn
  /// The potential of which it is a minimum [J]: its energy, but with the work of loads counted from a cell of no length, so that states
  /// that started from other lengths can be compared.
  [[nodiscard]] double potential() const;
  /// By which its energy may differ from that of its minimum: the certificate's error, and the round-off of the sum of its parts; infinite
  /// where the Hessian is not positive definite [J].
  [[nodiscard]] double energy_error() const;
};

/// Reads the relaxed cell in a folder of `heddle relax` (relax.vtkhdf and summary.json). Throws std::runtime_error naming the file and what
/// is wrong with it.
ComparedState read_relaxed_state(const std::filesystem::path& folder);

/// Reads a woven cell from a folder of `heddle weave` (cell.vtkhdf) or a results file, and makes it periodic as cell_from_woven does, with
/// its woven tensions. Throws std::runtime_error naming the file and what is wrong with it.
ComparedState read_woven_state(const std::filesystem::path& input);

/// Throws std::runtime_error naming both files unless two states have the same weave and the same yarns.
void expect_comparable(const ComparedState& a, const ComparedState& b);

/// Fibers of a state brought onto another one: drawn out evenly along x and y to the lengths of its cell, translated by -shift, so that on
/// the average the yarns' centroids do not differ along x, y or z, and each yarn shifted by the periods that bring it next to its
/// counterpart.
struct Aligned {
  Vec3 shift = Vec3::Zero();  ///< [m]
  weave::Snapshot snapshot;
  std::vector<weave::YarnPath> paths;  ///< of `snapshot`
};
Aligned align(const ComparedState& onto, const ComparedState& state);

/// Mean and largest of a difference [diameters of the coarser state's fibers].
struct MeanAndLargest {
  double mean = 0, largest = 0;
};

/// How b differs from a once it is aligned onto it.
struct Difference {
  double cell_length = 0, cell_width = 0;  ///< of b's cell over a's, less one: drawn out before anything else is compared
  Vec3 shift = Vec3::Zero();               ///< that was removed [m]
  MeanAndLargest path;                     ///< distance of the yarns' centroids in sections normal to their periods
  MeanAndLargest width, height;            ///< absolute difference of the yarns' extents in these sections
  std::optional<MeanAndLargest> fibers;    ///< distance of the fibers at equal shares of their length; where both have the same fibers
};
Difference difference(const ComparedState& a, const ComparedState& b);
/// The same with `aligned` = align(a, b), where it is needed for other things too.
Difference difference(const ComparedState& a, const ComparedState& b, const Aligned& aligned);

enum class Verdict {
  same,         ///< nowhere farther apart than 0.01 diameters, their cells neither, or energies that differ by no more than their errors
  different,    ///< farther apart, and energies that differ by more
  other_nodes,  ///< the same, but so do the numbers of nodes: the discretization's error is part of the difference
  other_potential,  ///< fibers, loads, given or rest lengths differ: their energies can not be compared
  not_certified,    ///< one of the two is no certified minimum
};

/// Whether two relaxed states are different minima.
Verdict verdict(const ComparedState& a, const ComparedState& b, const Difference& difference);
std::string text_of(Verdict verdict);

}  // namespace relax
