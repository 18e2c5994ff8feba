#include <algorithm>
#include <cmath>
#include <map>

#include "relax/report.hpp"
#include "spline.hpp"

namespace relax {
namespace {

/// A fiber's axis at the middles of its spans, over `count` of them from span `from` of the endless chain.
struct AxisPoint {
  Vec3 x;
  double tension, arc;
};

AxisPoint axis_at(const Cell& cell, const Eigen::VectorXd& q, const std::vector<double>& tension, std::size_t f, int index) {
  const auto n = static_cast<int>(cell.nodes_of(f));
  const int wrap = static_cast<int>(std::floor(static_cast<double>(index) / n));
  const auto node = cell.first[f] + static_cast<std::uint32_t>(index - wrap * n);
  double arc = 0, all = 0;
  for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) {
    if (i < node) arc += cell.rest_length[i];
    all += cell.rest_length[i];
  }
  return {axis_point(cell, q, node, 0.5) + wrap * cell.period(f), 0.5 * (tension[node] + tension[cell.before(node).node]), arc + wrap * all};
}

/// Point between two where their x passes `value`.
AxisPoint at_x(const AxisPoint& a, const AxisPoint& b, double value) {
  const double u = (value - a.x.x()) / (b.x.x() - a.x.x());
  AxisPoint p{a.x + u * (b.x - a.x), a.tension + u * (b.tension - a.tension), a.arc + u * (b.arc - a.arc)};
  p.x.x() = value;
  return p;
}

}  // namespace

weave::Snapshot snapshot_of(const Cell& cell, const Eigen::VectorXd& q) {
  const std::vector<double> tension = bar_tensions(cell, Unknowns(cell), q);
  weave::Snapshot s;
  s.cell_width = cell.length_y;
  s.cell_length = s.x_max = cell.length_x;
  s.offset.push_back(0);
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    s.yarn.push_back(cell.yarn[f]);
    s.fiber.push_back(cell.place[f]);
    s.weft.push_back(cell.weft[f]);
    s.radius.push_back(cell.type_of(f).radius);
    s.area.push_back(cell.type_of(f).area);
    const auto n = static_cast<int>(cell.nodes_of(f));
    std::vector<AxisPoint> points;
    if (cell.weft[f]) {
      for (int i = 0; i <= n; ++i) points.push_back(axis_at(cell, q, tension, f, i));
    } else {
      int i = 0;
      while (axis_at(cell, q, tension, f, i).x.x() >= 0) --i;
      while (axis_at(cell, q, tension, f, i + 1).x.x() < 0) ++i;
      points.push_back(at_x(axis_at(cell, q, tension, f, i), axis_at(cell, q, tension, f, i + 1), 0));
      for (int k = i + 1; k < i + n + 1; ++k) {
        points.push_back(axis_at(cell, q, tension, f, k));
        if (points.back().x.x() <= 1e-9 * cell.length_x && points.size() == 2) points.erase(points.begin());  // a node on the face
      }
      if (points.back().x.x() < cell.length_x) {
        AxisPoint last = points.front();
        last.x.x() += cell.length_x;
        last.arc += axis_at(cell, q, tension, f, n).arc - axis_at(cell, q, tension, f, 0).arc;
        points.push_back(last);
      }
    }
    const double start = points.front().arc;
    for (const AxisPoint& p : points) {
      s.x.push_back(p.x);
      s.tension.push_back(p.tension);
      s.arc.push_back(p.arc - start);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
  }
  return s;
}

namespace {

/// Mean over a yarn's fibers of where they pass a coordinate (axis 0 or 1, modulo the cell).
Vec3 yarn_at(const Cell& cell, const Eigen::VectorXd& q, const std::vector<std::size_t>& fibers, int axis, double value) {
  const double period = axis == 0 ? cell.length_x : cell.length_y;
  Vec3 sum = Vec3::Zero();
  for (const std::size_t f : fibers) {
    double nearest = 1e300;
    Vec3 best = Vec3::Zero();
    for (std::uint32_t i = cell.first[f]; i < cell.first[f + 1]; ++i) {
      const Span span(cell, q, i);
      const double low = span.start[axis], high = span.point(1)[axis];
      const double wanted = value + period * std::round((0.5 * (low + high) - value) / period);
      const double share = std::clamp((wanted - low) / (high - low), 0.0, 1.0);
      const Vec3 point = span.point(share);
      if (std::abs(point[axis] - wanted) >= nearest) continue;
      nearest = std::abs(point[axis] - wanted);
      best = point;
      best[axis] = value;
    }
    sum += best;
  }
  return sum / static_cast<double>(fibers.size());
}

}  // namespace

Eigen::MatrixXi crossing_order(const Cell& cell, const Eigen::VectorXd& q) {
  std::map<int, std::vector<std::size_t>> warps, wefts;
  for (std::size_t f = 0; f < cell.fibers(); ++f) (cell.weft[f] ? wefts : warps)[cell.yarn[f]].push_back(f);
  Eigen::MatrixXi order(static_cast<Eigen::Index>(warps.size()), static_cast<Eigen::Index>(wefts.size()));
  Eigen::Index row = 0;
  for (const auto& [warp, warp_fibers] : warps) {
    Eigen::Index column = 0;
    const double warp_y = yarn_at(cell, q, warp_fibers, 0, 0).y();
    for (const auto& [weft, weft_fibers] : wefts) {
      const Vec3 on_weft = yarn_at(cell, q, weft_fibers, 1, warp_y);
      const Vec3 on_warp = yarn_at(cell, q, warp_fibers, 0, on_weft.x());
      order(row, column++) = on_warp.z() > on_weft.z() ? 1 : -1;
    }
    ++row;
  }
  return order;
}

int order_violations(const Eigen::MatrixXi& before, const Eigen::MatrixXi& after) {
  return static_cast<int>((before.array() != after.array()).count());
}

}  // namespace relax
