#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "scenes/cells.hpp"

namespace {

using namespace scenes;
using relax::Cell;
using relax::Derivatives;
using relax::Unknowns;
using Term = std::function<double(const Eigen::VectorXd&, Derivatives)>;

struct Errors {
  double gradient = 0, hessian = 0;  ///< largest difference over the largest component
};

/// Gradient and Hessian of a term against central differences of its energy and of its gradient.
Errors errors_of(const Term& term, const Eigen::VectorXd& q, relax::SparseHessian hessian, double h) {
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(q.size());
  hessian.set_zero();
  term(q, {&gradient, &hessian, false});
  EXPECT_TRUE(hessian.complete());
  Eigen::MatrixXd exact(q.size(), q.size()), differences(q.size(), q.size());
  Errors errors;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    exact.col(i) = hessian.times(Eigen::VectorXd::Unit(q.size(), i));
    Eigen::VectorXd above = q, below = q, g_above = Eigen::VectorXd::Zero(q.size()), g_below = g_above;
    above[i] += h;
    below[i] -= h;
    const double rise = term(above, {&g_above, nullptr, false}) - term(below, {&g_below, nullptr, false});
    errors.gradient = std::max(errors.gradient, std::abs(rise / (2 * h) - gradient[i]));
    differences.col(i) = (g_above - g_below) / (2 * h);
  }
  EXPECT_GT(gradient.cwiseAbs().maxCoeff(), 0);
  errors.gradient /= gradient.cwiseAbs().maxCoeff();
  errors.hessian = (exact - differences).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff();
  return errors;
}

constexpr double d = 1e-4;  ///< fiber diameter [m]
constexpr double h = 1e-6 * d;

/// Plain weave with everything in it: bending, one family by tension and one by rest lengths, platens; shaken.
struct Shaken {
  PosedCell posed;
  Eigen::VectorXd q;
  relax::ContactList list;
  Unknowns unknowns;

  explicit Shaken(int fibers, std::uint64_t seed, bool free_lengths = false)
      : posed(make(fibers, free_lengths)), q(posed.unknowns()), unknowns(posed.cell) {
    shake(q, 0.03 * d, seed);
    if (unknowns.platens >= 0) q[unknowns.platens] += 0.15 * d;
    list = relax::find_contacts(posed.cell, q, 0.3 * d);
  }
  static PosedCell make(int fibers, bool free_lengths) {
    PosedCell p = plain_weave_cell({.fibers = fibers, .pitch = fibers == 1 ? 4e-4 : 7e-4}, 0.5, 1.4);
    for (std::size_t f = 0; f < p.cell.fibers(); ++f) {
      if (p.cell.weft[f]) p.cell.tension[f] = 0;
    }
    p.cell.pressure = 1e4;
    if (free_lengths) p.cell.load_x = p.cell.load_y = 0.3;
    p.cell.slack_strain = 0.2;  // so that most bars are within it
    p.cell.types[0].bending_stiffness = 1e-9;
    for (weave::Vec3& x : p.x) x.z() *= 0.9;
    return p;
  }
  [[nodiscard]] relax::SparseHessian hessian() const { return relax::hessian_for(posed.cell, list, q); }
};

Errors errors_of_bars(const Shaken& s) {
  return errors_of(
      [&](const Eigen::VectorXd& q, Derivatives want) {
        double work = 0;
        const double bars = relax::bar_energy(s.posed.cell, s.unknowns, q, want, &work);
        return bars + work;
      },
      s.q, s.hessian(), h);
}

TEST(relax_derivatives, bars) {
  const Shaken s(1, 1);
  const Errors e = errors_of_bars(s);
  EXPECT_LT(e.gradient, 1e-7);  // round-off of the energy over h
  EXPECT_LT(e.hessian, 1e-6);   // round-off of the force over h, and the bounds of the slack
}

/// A fiber's last bar ends in the fiber that goes on, and its rest length goes with what its own fiber draws in.
TEST(relax_derivatives, bars_of_fibers_that_change_places) {
  Shaken s(3, 1);
  std::vector<std::uint32_t> next(s.posed.cell.fibers());
  for (std::uint32_t f = 0; f < next.size(); ++f) next[f] = f / 3 * 3 + (f + 1) % 3;  // of each yarn's three
  relax::close_fibers(s.posed.cell, next);
  s.list = relax::find_contacts(s.posed.cell, s.q, 0.3 * d);
  const Errors e = errors_of_bars(s);
  EXPECT_LT(e.gradient, 1e-6);
  EXPECT_LT(e.hessian, 1e-6);
}

TEST(relax_derivatives, bending) {
  const Shaken s(1, 2);
  const Errors e = errors_of([&](const Eigen::VectorXd& q, Derivatives want) { return relax::bending_energy(s.posed.cell, q, want); }, s.q,
                             s.hessian(), h);
  EXPECT_LT(e.gradient, 1e-8);
  EXPECT_LT(e.hessian, 1e-8);
}

TEST(relax_derivatives, platens) {
  const Shaken s(1, 3);
  const Errors e =
      errors_of([&](const Eigen::VectorXd& q, Derivatives want) { return relax::platen_energy(s.posed.cell, s.unknowns, q, want); }, s.q,
                s.hessian(), h);
  EXPECT_LT(e.gradient, 1e-7);
  EXPECT_LT(e.hessian, 1e-4);  // slope like the root of the overlap at touch
}

TEST(relax_derivatives, contact_of_crossing_fibers) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Shaken s(1, seed);
    const Errors e =
        errors_of([&](const Eigen::VectorXd& q, Derivatives want) { return relax::contact_energy(s.posed.cell, s.list, q, want); }, s.q,
                  s.hessian(), h);
    EXPECT_LT(e.gradient, 1e-7);
    EXPECT_LT(e.hessian, 1e-3);  // slope like the root of the overlap at touch, and jumps of the axis' curvature at joints
  }
}

TEST(relax_derivatives, contact_within_and_between_yarns) {
  const Shaken s(3, 5);
  const Errors e =
      errors_of([&](const Eigen::VectorXd& q, Derivatives want) { return relax::contact_energy(s.posed.cell, s.list, q, want); }, s.q,
                s.hessian(), h);
  EXPECT_LT(e.gradient, 1e-7);
  EXPECT_LT(e.hessian, 1e-3);
}

TEST(relax_derivatives, of_the_cells_lengths) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Shaken s(seed % 2 == 0 ? 3 : 1, seed, true);
    // The corner of the unit cell within the yarns: warps and wefts touch one another's images across every face.
    const auto check = [&](const char* name, double tolerance, const Term& term) {
      SCOPED_TRACE(name);
      const Errors e = errors_of(term, s.q, s.hessian(), h);
      EXPECT_LT(e.gradient, 1e-7);
      EXPECT_LT(e.hessian, tolerance);
      Eigen::VectorXd gradient = Eigen::VectorXd::Zero(s.q.size());
      term(s.q, {&gradient, nullptr, false});
      for (const Eigen::Index length : s.unknowns.length) EXPECT_NE(gradient[length], 0);
    };
    const Cell& cell = s.posed.cell;
    check("bars", 1e-6, [&](const Eigen::VectorXd& q, Derivatives want) {
      double work = 0;
      const double bars = relax::bar_energy(cell, s.unknowns, q, want, &work);
      return bars + work;
    });
    check("bending", 1e-8, [&](const Eigen::VectorXd& q, Derivatives want) { return relax::bending_energy(cell, q, want); });
    check("contact", 1e-3, [&](const Eigen::VectorXd& q, Derivatives want) { return relax::contact_energy(cell, s.list, q, want); });
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(s.q.size());
    const double energy = relax::load_energy(cell, s.unknowns, s.q, {&gradient, nullptr, false});
    EXPECT_NEAR(energy / gradient.dot(s.q), 1, 1e-12);  // it is linear
  }
}

TEST(relax_potential, does_not_change_when_the_cell_is_shifted) {
  const Shaken s(3, 6);
  const auto energy = [&](const Eigen::VectorXd& q) {
    return relax::potential(s.posed.cell, s.unknowns, relax::find_contacts(s.posed.cell, q, 0.3 * d), q, {}).sum();
  };
  Eigen::VectorXd shifted = s.q;
  for (Eigen::Index i = 0; i < s.unknowns.nodes; ++i) shifted.segment<3>(3 * i) += weave::Vec3(1.234e-3, -0.777e-3, 0.31e-3);
  for (Eigen::Index k = 0; k < 2; ++k) shifted[s.unknowns.platens + k] += 0.31e-3;
  EXPECT_NEAR(energy(shifted) / energy(s.q), 1, 1e-10);
}

TEST(relax_potential, doubles_with_the_cell) {
  const auto energy = [&](int repeat_x, int repeat_y) {
    PosedCell p = plain_weave_cell({.fibers = 3, .pitch = 7e-4, .repeat_x = repeat_x, .repeat_y = repeat_y}, 0.5, 1.4);
    p.cell.types[0].bending_stiffness = 1e-9;
    for (weave::Vec3& x : p.x) x.z() *= 0.8;
    const Eigen::VectorXd q = p.unknowns();
    const relax::EnergyParts parts = relax::potential(p.cell, Unknowns(p.cell), relax::find_contacts(p.cell, q, 0.3 * d), q, {});
    EXPECT_GT(parts.contact, 0);
    EXPECT_GT(parts.bending, 0);
    return parts.sum();
  };
  EXPECT_NEAR(energy(2, 1) / energy(1, 1), 2, 1e-10);
  EXPECT_NEAR(energy(1, 2) / energy(1, 1), 2, 1e-10);
}

TEST(relax_potential, list_misses_no_contact_while_it_lasts) {
  const Shaken s(7, 7);
  Eigen::VectorXd q = s.q;
  shake(q, 0.03 * d, 8);
  ASSERT_FALSE(s.list.late(s.posed.cell, q));
  const auto contact = [&](const relax::ContactList& list) { return relax::contact_energy(s.posed.cell, list, q, {}); };
  EXPECT_NEAR(contact(s.list) / contact(relax::find_contacts(s.posed.cell, q, 3 * d)), 1, 1e-12);
}

TEST(relax_potential, fibers_that_change_places_are_one_fiber_of_a_longer_cell) {
  // Two warps that run into each other's places, once round the cell, against the one fiber that they are in a cell twice as long.
  constexpr int nodes = 6;
  const double length = 9 * d;
  const auto path = [&](int k) {  // over two lengths
    const double phase = 2 * 3.14159265358979 * k / (2 * nodes);
    return weave::Vec3(k * length / nodes, 0.47 * d * std::cos(phase), 0.47 * d * std::sin(phase));
  };
  const auto energy = [&](bool doubled) {
    relax::Cell cell = empty_cell(doubled ? 2 * length : length, 20 * d);
    cell.types[0].bending_stiffness = 1e-9;
    std::vector<weave::Vec3> x;
    for (int f = 0; f < 2; ++f) {
      relax::CellFiber fiber;
      for (int k = 0; k < (doubled ? 2 * nodes : nodes); ++k) {
        weave::Vec3 at = path(k + f * nodes);
        at.x() -= f * length;
        fiber.x.push_back(at);
      }
      fiber.rest_length.assign(fiber.x.size(), 0.9 * length / nodes);
      relax::add_fiber(cell, fiber, x);
    }
    if (!doubled) relax::close_fibers(cell, {1, 0});
    const Eigen::VectorXd q = relax::unknowns_at(cell, x);
    const relax::EnergyParts parts = relax::potential(cell, Unknowns(cell), relax::find_contacts(cell, q, 0.3 * d), q, {});
    EXPECT_GT(parts.contact, 0);
    return parts.sum();
  };
  EXPECT_NEAR(energy(true) / energy(false), 2, 1e-10);
}

}  // namespace
