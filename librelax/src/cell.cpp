#include "relax/cell.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "spline.hpp"

namespace relax {

void finish_types(Cell& cell) {
  cell.pair_laws.clear();
  for (const FiberType& a : cell.types) {
    for (const FiberType& b : cell.types)
      cell.pair_laws.push_back(PairLaw::of(a.radius, b.radius, a.transverse_modulus, b.transverse_modulus));
  }
}

void close_fibers(Cell& cell, const std::vector<std::uint32_t>& next) {
  constexpr std::uint32_t none = 0xffffffffu;
  std::vector<std::uint32_t> previous(cell.fibers(), none);
  bool valid = next.size() == cell.fibers();
  for (std::uint32_t f = 0; valid && f < next.size(); ++f) {
    valid = next[f] < next.size() && cell.yarn[next[f]] == cell.yarn[f] && previous[next[f]] == none;
    if (valid) previous[next[f]] = f;
  }
  if (!valid) throw std::invalid_argument("fibers of a cell must go on in one fiber each, of their own yarn");
  cell.next = next;
  cell.previous = std::move(previous);
}

void add_fiber(Cell& cell, const CellFiber& fiber, std::vector<Vec3>& x) {
  if (fiber.x.size() < 3 || fiber.rest_length.size() != fiber.x.size()) {
    throw std::invalid_argument("a fiber of a cell needs at least three nodes and as many rest lengths");
  }
  if (!std::all_of(fiber.rest_length.begin(), fiber.rest_length.end(), [](double l) { return l > 0; })) {
    throw std::invalid_argument("a fiber of a cell needs rest lengths > 0");
  }
  if (cell.first.empty()) cell.first.push_back(0);
  const auto number = static_cast<std::uint32_t>(cell.fibers());
  cell.weft.push_back(fiber.weft);
  cell.type.push_back(fiber.type);
  cell.yarn.push_back(fiber.yarn);
  cell.place.push_back(fiber.place);
  cell.next.push_back(number);
  cell.previous.push_back(number);
  cell.tension.push_back(fiber.tension);
  cell.rest_length.insert(cell.rest_length.end(), fiber.rest_length.begin(), fiber.rest_length.end());
  cell.fiber_of.insert(cell.fiber_of.end(), fiber.x.size(), number);
  cell.first.push_back(static_cast<std::uint32_t>(cell.nodes()));
  x.insert(x.end(), fiber.x.begin(), fiber.x.end());
}

Unknowns::Unknowns(const Cell& cell) : nodes(static_cast<Eigen::Index>(cell.nodes())), drawn(cell.fibers(), -1) {
  size = 3 * nodes;
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    if (cell.tension[f] > 0) drawn[f] = size++;
  }
  if (cell.pressure > 0) {
    platens = size;
    size += 2;
  }
  if (cell.load_x) length[0] = size++;
  if (cell.load_y) length[1] = size++;
}

double Unknowns::way(const Eigen::VectorXd& step) const {
  double way2 = 0, growth = 0;
  for (Eigen::Index i = 0; i < nodes; ++i) way2 = std::max(way2, step.segment<3>(3 * i).squaredNorm());
  if (platens >= 0) way2 = std::max(way2, step.segment<2>(platens).cwiseAbs2().maxCoeff());
  for (const Eigen::Index u : length) growth += u >= 0 ? std::abs(step[u]) : 0;
  return std::sqrt(way2) + growth;
}

std::vector<Vec3> nodes_through(const Cell& cell, const std::vector<Vec3>& points) {
  constexpr int rounds = 50;  // each halves the error, if not more: a wave loses at most half of its height from nodes to middles
  const double round_off = 1e-14 * (cell.length_x + cell.length_y);  // straight fibers keep their nodes
  Eigen::VectorXd q = Eigen::VectorXd::Zero(Unknowns(cell).size);
  for (std::size_t i = 0; i < points.size(); ++i) q.segment<3>(static_cast<Eigen::Index>(3 * i)) = points[i];
  std::vector<Vec3> x = points;
  for (int round = 0; round < rounds; ++round) {
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      const Vec3 off = points[i] - axis_point(cell, q, i, 0.5);
      if (off.norm() > round_off) x[i] += off;
    }
    for (std::size_t i = 0; i < points.size(); ++i) q.segment<3>(static_cast<Eigen::Index>(3 * i)) = x[i];
  }
  return x;
}

Eigen::VectorXd unknowns_at(const Cell& cell, const std::vector<Vec3>& x) {
  const Unknowns unknowns(cell);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(unknowns.size);
  for (std::size_t i = 0; i < x.size(); ++i) q.segment<3>(static_cast<Eigen::Index>(3 * i)) = x[i];
  if (unknowns.platens >= 0) {
    double low = 1e300, high = -1e300;
    for (std::uint32_t i = 0; i < cell.nodes(); ++i) {
      const double z = axis_point(cell, q, i, 0.5).z(), r = cell.type_of(cell.fiber_of[i]).radius;
      low = std::min(low, z - r);
      high = std::max(high, z + r);
    }
    q[unknowns.platens] = low;
    q[unknowns.platens + 1] = high;
  }
  return q;
}

void set_pressure(Cell& cell, double pressure, Eigen::VectorXd& q) {
  const Unknowns before(cell);
  cell.pressure = pressure;
  const Unknowns after(cell);
  std::vector<Vec3> x(cell.nodes());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = q.segment<3>(static_cast<Eigen::Index>(3 * i));
  Eigen::VectorXd pressed = unknowns_at(cell, x);
  const Eigen::Index drawn = before.platens >= 0 ? before.platens : after.platens >= 0 ? after.platens : q.size();
  pressed.head(drawn) = q.head(drawn);
  if (before.platens >= 0 && after.platens >= 0) pressed.segment<2>(after.platens) = q.segment<2>(before.platens);
  for (const std::size_t k : {0, 1}) {
    if (after.length[k] >= 0) pressed[after.length[k]] = q[before.length[k]];
  }
  q = std::move(pressed);
}

void settle_lengths(Cell& cell, Eigen::VectorXd& q) {
  const double area = cell.length_x * cell.length_y;
  cell.length_x = cell.length_x_at(q);
  cell.length_y = cell.length_y_at(q);
  cell.pressure *= area / (cell.length_x * cell.length_y);
  for (const Eigen::Index u : Unknowns(cell).length) {
    if (u >= 0) q[u] = 0;
  }
}

Vec3 axis_point(const Cell& cell, const Eigen::VectorXd& q, std::uint32_t node, double share) {
  return Span(cell, q, node).point(share);
}

}  // namespace relax
