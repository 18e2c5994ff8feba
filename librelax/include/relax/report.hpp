#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "relax/minimize.hpp"
#include "relax/refine.hpp"
#include "relax/woven_start.hpp"
#include "weave/measures.hpp"
#include "weave/snapshot.hpp"

namespace relax {

/// Fibers as poly-lines along their axes, a point beside each node and one between each two: warps from the face x = 0 to the face x =
/// length_x, wefts from a point to its image. Tensions are the means of the bars beside a node; arc is along the rest lengths given,
/// drawn-in length left out.
weave::Snapshot snapshot_of(const Cell& cell, const Eigen::VectorXd& q);

/// For each warp yarn and each weft yarn (n_warps x n_wefts, yarns by rising number): +1 where the warp passes over the weft, else -1, by
/// the mean heights of their fibers where the yarns' centers cross, seen from above.
Eigen::MatrixXi crossing_order(const Cell& cell, const Eigen::VectorXd& q);

/// Number of crossings that are not as they were.
int order_violations(const Eigen::MatrixXi& before, const Eigen::MatrixXi& after);

/// What a summary holds beside the minimization's own result.
struct ReportContext {
  std::string case_name, case_toml, start;  ///< start: "topology" or "woven"
  FaceMismatch mismatch;                    ///< of a woven start
  int violations = 0;
  double wall = 0;                            ///< [s]
  std::optional<RefinementCheck> refinement;  ///< of refined yarns
};

/// The parts of an energy and their sum by the names that they have in every summary [J].
std::vector<std::pair<std::string, double>> named(const EnergyParts& energy);

/// Calls f with the key that each finding of a certificate has in every summary, and with the finding.
template <class C, class F>
void each_finding(C& certificate, F&& f) {
  f("converged", certificate.converged);
  f("blocked_by", certificate.blocked_by);
  f("gradient_max", certificate.gradient_max);
  f("positive_definite", certificate.positive_definite);
  f("neutral", certificate.neutral);
  f("free_fibers", certificate.free_fibers);
  f("newton_step_max", certificate.newton_step_max);
  f("contacts_steady", certificate.contacts_steady);
  f("pin_force_max", certificate.pin_force_max);
}

/// The summary as JSON text, keys with units.
std::string summary_json(const Cell& cell, const MinimizeResult& result, const weave::CellMeasures& measures, const ReportContext& context);

}  // namespace relax
