#pragma once
#include <Eigen/Core>
#include <vector>

namespace weave {

/// Column for each row of a square matrix such that the sum of the costs is least (Kuhn 1955, by shortest augmenting paths with
/// potentials).
std::vector<Eigen::Index> cheapest_assignment(const Eigen::MatrixXd& cost);

}  // namespace weave
