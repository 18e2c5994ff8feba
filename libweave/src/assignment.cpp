#include "weave/assignment.hpp"

#include <limits>

namespace weave {

std::vector<Eigen::Index> cheapest_assignment(const Eigen::MatrixXd& cost) {
  const Eigen::Index n = cost.rows();
  const auto size = static_cast<std::size_t>(n) + 1;
  const double infinite = std::numeric_limits<double>::infinity();
  std::vector<double> u(size, 0), v(size, 0);
  std::vector<std::size_t> row_of(size, 0), way(size, 0);  // 1-based; 0: none
  for (std::size_t row = 1; row < size; ++row) {
    std::vector<double> slack(size, infinite);
    std::vector<bool> used(size, false);
    row_of[0] = row;
    std::size_t column = 0;
    do {
      used[column] = true;
      const std::size_t at = row_of[column];
      double least = infinite;
      std::size_t next = 0;
      for (std::size_t j = 1; j < size; ++j) {
        if (used[j]) continue;
        const double reduced = cost(static_cast<Eigen::Index>(at) - 1, static_cast<Eigen::Index>(j) - 1) - u[at] - v[j];
        if (reduced < slack[j]) {
          slack[j] = reduced;
          way[j] = column;
        }
        if (slack[j] < least) {
          least = slack[j];
          next = j;
        }
      }
      for (std::size_t j = 0; j < size; ++j) {
        if (used[j]) {
          u[row_of[j]] += least;
          v[j] -= least;
        } else {
          slack[j] -= least;
        }
      }
      column = next;
    } while (row_of[column] != 0);
    for (; column != 0; column = way[column]) row_of[column] = row_of[way[column]];
  }
  std::vector<Eigen::Index> result(static_cast<std::size_t>(n));
  for (std::size_t j = 1; j < size; ++j) result[row_of[j] - 1] = static_cast<Eigen::Index>(j) - 1;
  return result;
}

}  // namespace weave
