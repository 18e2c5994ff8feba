#include "cholesky.hpp"

#include <cholmod.h>

#include <array>
#include <cassert>
#include <stdexcept>
#include <string>

namespace relax {

struct Cholesky::Factor {
  cholmod_common common{};
  cholmod_factor* factor = nullptr;

  Factor() { cholmod_l_start(&common); }
  ~Factor() {
    cholmod_l_free_factor(&factor, &common);
    cholmod_l_finish(&common);
  }
  Factor(const Factor&) = delete;
  Factor& operator=(const Factor&) = delete;

  void check(const char* what) const {
    if (common.status < CHOLMOD_OK) {
      throw std::runtime_error(std::string("Cholesky: ") + what +
                               (common.status == CHOLMOD_OUT_OF_MEMORY ? ": out of memory" : ": failed") + " (status " +
                               std::to_string(common.status) + ")");
    }
  }
};

namespace {

/// Arrays of a matrix as CHOLMOD takes them; it only reads them.
cholmod_sparse view_of(std::size_t size, const std::vector<std::int64_t>& column, const std::vector<std::int64_t>& row,
                       const double* value) {
  cholmod_sparse a{};
  a.nrow = a.ncol = size;
  a.nzmax = row.size();
  a.p = const_cast<std::int64_t*>(column.data());
  a.i = const_cast<std::int64_t*>(row.data());
  a.x = const_cast<double*>(value);
  a.stype = 1;
  a.itype = CHOLMOD_LONG;
  a.xtype = value ? CHOLMOD_REAL : CHOLMOD_PATTERN;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = 1;
  a.packed = 1;
  return a;
}

cholmod_sparse view_of(const SparseHessian& h) {
  return view_of(static_cast<std::size_t>(h.size()), h.column(), h.row(), h.value().data());
}

static_assert(sizeof(SuiteSparse_long) == sizeof(std::int64_t));

/// Nested dissection of the node graph.
std::vector<SuiteSparse_long> order_nodes(const SparseHessian& h, cholmod_common* common) {
  std::vector<std::int64_t> row(h.block_row().begin(), h.block_row().end());
  std::vector<SuiteSparse_long> order(static_cast<std::size_t>(h.nodes()));
  cholmod_sparse graph = view_of(order.size(), h.block_column(), row, nullptr);
  cholmod_l_metis(&graph, nullptr, 0, 1, order.data(), common);
  return order;
}

}  // namespace

Cholesky::Cholesky(const SparseHessian& hessian) : factor_(std::make_unique<Factor>()) {
  cholmod_common* c = &factor_->common;
  c->nmethods = 1;
  c->method[0].ordering = CHOLMOD_GIVEN;
  c->postorder = 1;
  c->supernodal = CHOLMOD_SUPERNODAL;
  c->quick_return_if_not_posdef = 1;
  c->print = 0;
  const std::vector<SuiteSparse_long> nodes = order_nodes(hessian, c);
  factor_->check("ordering");
  std::vector<SuiteSparse_long> order;
  order.reserve(static_cast<std::size_t>(hessian.size()));
  for (const SuiteSparse_long node : nodes) {
    for (int axis = 0; axis < 3; ++axis) order.push_back(3 * node + axis);
  }
  for (Eigen::Index u = 3 * hessian.nodes(); u < hessian.size(); ++u) order.push_back(u);
  cholmod_sparse a = view_of(hessian);
  factor_->factor = cholmod_l_analyze_p(&a, order.data(), nullptr, 0, c);
  factor_->check("analysis");
}

Cholesky::~Cholesky() = default;

bool Cholesky::factorize(const SparseHessian& hessian, double shift) {
  cholmod_sparse a = view_of(hessian);
  std::array<double, 2> beta = {shift, 0};
  cholmod_l_factorize_p(&a, beta.data(), nullptr, 0, factor_->factor, &factor_->common);
  factor_->check("factorization");
  failed_at_ = -1;
  if (factor_->common.status != CHOLMOD_NOT_POSDEF && factor_->factor->minor >= factor_->factor->n) return true;
  failed_at_ = static_cast<const SuiteSparse_long*>(factor_->factor->Perm)[std::min(factor_->factor->minor, factor_->factor->n - 1)];
  return false;
}

Eigen::VectorXd Cholesky::solve(const Eigen::VectorXd& right) const {
  assert(static_cast<std::size_t>(right.size()) == factor_->factor->n);
  cholmod_dense b{};
  b.nrow = b.d = b.nzmax = static_cast<std::size_t>(right.size());
  b.ncol = 1;
  b.x = const_cast<double*>(right.data());
  b.xtype = CHOLMOD_REAL;
  b.dtype = CHOLMOD_DOUBLE;
  cholmod_dense* x = cholmod_l_solve(CHOLMOD_A, factor_->factor, &b, &factor_->common);
  factor_->check("solution");
  const Eigen::VectorXd result = Eigen::Map<const Eigen::VectorXd>(static_cast<const double*>(x->x), right.size());
  cholmod_l_free_dense(&x, &factor_->common);
  return result;
}

double Cholesky::nonzeros() const {
  return factor_->common.lnz;
}

}  // namespace relax
