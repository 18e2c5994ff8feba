#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "hessian_bound.hpp"
#include "limited_memory.hpp"
#include "scenes/cells.hpp"

namespace {

using namespace scenes;
constexpr double d = 1e-4;  ///< fiber diameter [m]

/// A vector of standard normal deviates.
Eigen::VectorXd deviates(Eigen::Index size, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return Eigen::VectorXd::NullaryExpr(size, [&] { return normal(random); });
}

/// A symmetric positive definite matrix with eigenvalues of 1 to 1000.
Eigen::MatrixXd quadratic(Eigen::Index size, std::mt19937_64& random) {
  Eigen::MatrixXd any(size, size);
  for (Eigen::Index i = 0; i < size; ++i) any.col(i) = deviates(size, random);
  const Eigen::MatrixXd turned = any.householderQr().householderQ();
  return turned * Eigen::VectorXd::LinSpaced(size, 0, 3).unaryExpr([](double e) { return std::pow(10, e); }).asDiagonal() *
         turned.transpose();
}

const auto same = [](const Eigen::VectorXd& v) { return v; };

TEST(relax_steps, limited_memory_knows_the_last_step_exactly) {
  std::mt19937_64 random(1);
  const Eigen::MatrixXd a = quadratic(8, random);
  relax::LimitedMemory memory(3);
  const Eigen::VectorXd v = deviates(8, random);
  EXPECT_EQ(memory.times(v, same), v);
  for (int i = 0; i < 5; ++i) {
    const Eigen::VectorXd way = deviates(8, random), change = a * way;
    memory.learn(way, change);
    EXPECT_LT((memory.times(change, same) - way).norm(), 1e-12 * way.norm());
  }
  const Eigen::VectorXd before = memory.times(v, same);
  memory.learn(v, -v);  // the gradient falls on the way: no Hessian with a minimum does that
  EXPECT_EQ(memory.times(v, same), before);
}

TEST(relax_steps, limited_memory_finds_the_bottom_of_a_parabola_in_as_many_steps_as_it_has_axes) {
  constexpr Eigen::Index size = 8;  // with exact line searches (Nocedal & Wright 2006, theorem 6.4)
  std::mt19937_64 random(2);
  const Eigen::MatrixXd a = quadratic(size, random);
  relax::LimitedMemory memory(size);
  Eigen::VectorXd x = deviates(size, random), gradient = a * x;
  const double first = gradient.norm();
  for (Eigen::Index i = 0; i < size; ++i) {
    const Eigen::VectorXd direction = memory.times(-gradient, same);
    const Eigen::VectorXd way = -gradient.dot(direction) / direction.dot(a * direction) * direction;
    x += way;
    memory.learn(way, a * x - gradient);
    gradient = a * x;
    if (i < size - 1) {
      EXPECT_GT(gradient.norm(), 1e-6 * first);
    }
  }
  EXPECT_LT(gradient.norm(), 1e-9 * first);  // round-off times the spread of eigenvalues
}

TEST(relax_steps, bound_is_not_less_than_the_hessian) {
  PosedCell p = plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0, 1.4);
  p.cell.types[0].bending_stiffness = 1e-9;
  p.cell.pressure = 1e4;
  for (weave::Vec3& x : p.x) x.z() *= 0.8;  // presses fibers together and leaves bars slack
  Eigen::VectorXd q = p.unknowns();
  shake(q, 0.03 * d, 3);
  const relax::Unknowns unknowns(p.cell);
  const relax::ContactList list = relax::find_contacts(p.cell, q, 0.3 * d);
  const auto dense = [&](const relax::SparseHessian& h) {
    Eigen::MatrixXd m(h.size(), h.size());
    for (Eigen::Index i = 0; i < h.size(); ++i) m.col(i) = h.times(Eigen::VectorXd::Unit(h.size(), i));
    return m;
  };
  relax::SparseHessian convex = relax::hessian_for(p.cell, list, q);
  relax::ContactState contacts;
  relax::potential(p.cell, unknowns, list, q, {nullptr, &convex, true}, &contacts);
  ASSERT_GT(contacts.touching, 20U);
  const Eigen::MatrixXd hessian = dense(convex);
  // What couples fibers in contact is k (a - b)^2 <= 2 k (a^2 + b^2): without it, contact has to count twice.
  for (const auto& [contact_factor, fiber_wise] : {std::pair{1.0, false}, std::pair{2.0, true}}) {
    relax::SparseHessian sparse = relax::hessian_for(p.cell, list, q);
    relax::HessianBound(p.cell, contact_factor).add_to(sparse, unknowns, list, q, fiber_wise);
    const Eigen::MatrixXd bound = dense(sparse);
    const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(bound - hessian).eigenvalues().minCoeff();
    EXPECT_GT(least, -1e-9 * bound.diagonal().maxCoeff()) << fiber_wise;
  }
}

}  // namespace
