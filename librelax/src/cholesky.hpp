#pragma once
#include <memory>

#include "relax/sparse_hessian.hpp"

namespace relax {

/// Supernodal Cholesky factorization of a cell's Hessian. The order of elimination is that of the node graph by nested dissection (METIS),
/// the borders last.
class Cholesky {
 public:
  /// Analyzes the pattern; lasts as long as that.
  explicit Cholesky(const SparseHessian& hessian);
  ~Cholesky();
  Cholesky(const Cholesky&) = delete;
  Cholesky& operator=(const Cholesky&) = delete;

  /// Factorizes hessian + shift I [N/m]. False: not positive definite. Throws std::runtime_error when memory runs out.
  bool factorize(const SparseHessian& hessian, double shift);
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& right) const;

  /// Unknown at which the last factorization met a pivot that is not positive; -1: none.
  [[nodiscard]] Eigen::Index failed_at() const { return failed_at_; }
  [[nodiscard]] double nonzeros() const;  ///< of the factor

 private:
  struct Factor;
  std::unique_ptr<Factor> factor_;
  Eigen::Index failed_at_ = -1;
};

}  // namespace relax
