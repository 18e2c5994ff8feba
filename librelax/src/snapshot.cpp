#include <algorithm>
#include <cmath>
#include <map>

#include "relax/report.hpp"
#include "spline.hpp"

namespace relax {
namespace {

/// A point of a fiber's axis.
struct AxisPoint {
  Vec3 x;
  double tension, arc;
};

/// The endless axis of a fiber, by the middles of its spans, beside the nodes, and the joints between these.
class Walk {
 public:
  Walk(const Cell& cell, const Eigen::VectorXd& q, const std::vector<double>& tension, std::size_t f)
      : cell_(cell), q_(q), tension_(tension), node_(cell.first[f]), period_(cell.period(f, q)) {}
  [[nodiscard]] AxisPoint here() const {
    const Vec3 x = axis_point(cell_, q_, node_, at_joint_ ? 1 : 0.5) + wrap_ * period_;
    if (at_joint_) return {x, tension_[node_], arc_ + 0.5 * cell_.rest_length[node_]};
    return {x, 0.5 * (tension_[node_] + tension_[cell_.before(node_).node]), arc_};
  }
  void forward() {
    at_joint_ = !at_joint_;
    if (at_joint_) return;
    arc_ += cell_.rest_length[node_];
    const Cell::ChainNode n = cell_.after(node_);
    node_ = n.node;
    wrap_ += n.wrap;
  }
  void back() {
    at_joint_ = !at_joint_;
    if (!at_joint_) return;
    const Cell::ChainNode n = cell_.before(node_);
    node_ = n.node;
    wrap_ += n.wrap;
    arc_ -= cell_.rest_length[node_];
  }

 private:
  const Cell& cell_;
  const Eigen::VectorXd& q_;
  const std::vector<double>& tension_;
  std::uint32_t node_;
  bool at_joint_ = false;  ///< after the node
  int wrap_ = 0;
  double arc_ = 0;
  Vec3 period_;
};

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
  const double length_x = cell.length_x_at(q);
  s.cell_width = cell.length_y_at(q);
  s.cell_length = s.x_max = length_x;
  s.along_axis = true;
  s.offset.push_back(0);
  for (std::size_t f = 0; f < cell.fibers(); ++f) {
    s.yarn.push_back(cell.yarn[f]);
    s.fiber.push_back(cell.place[f]);
    s.weft.push_back(cell.weft[f]);
    s.radius.push_back(cell.type_of(f).radius);
    s.area.push_back(cell.type_of(f).area);
    std::vector<AxisPoint> points;
    Walk walk(cell, q, tension, f);
    if (cell.weft[f]) {
      for (std::uint32_t i = 0; i <= 2 * cell.nodes_of(f); ++i, walk.forward()) points.push_back(walk.here());
    } else {
      while (walk.here().x.x() >= 0) walk.back();
      AxisPoint before = walk.here();
      for (walk.forward(); before.x.x() < length_x; walk.forward()) {
        const AxisPoint now = walk.here();
        for (const double face : {0.0, length_x}) {
          if (before.x.x() < face && now.x.x() >= face) points.push_back(at_x(before, now, face));
        }
        if (now.x.x() > 0 && now.x.x() < length_x) points.push_back(now);
        before = now;
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
  const double period = axis == 0 ? cell.length_x_at(q) : cell.length_y_at(q);
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
