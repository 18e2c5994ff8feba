#include "weave/measures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <tuple>

#include "weave/assignment.hpp"
#include "weave/section.hpp"

namespace weave {
namespace {

double length_of(const Snapshot& s, std::size_t f) {
  double length = 0;
  for (auto p = s.offset[f]; p + 1 < s.offset[f + 1]; ++p) length += (s.x[p + 1] - s.x[p]).norm();
  return length;
}

/// Upper and lower envelope heights on a grid over the cell, columns that no fiber covers left out. A unit cell goes on across its faces,
/// in which yarns may lie.
double mean_envelope_distance(const Snapshot& s) {
  const double length = s.x_max - s.x_min, width = s.cell_width;
  const bool goes_on = s.cell_length > 0;
  const double r_min = *std::min_element(s.radius.begin(), s.radius.end());
  const auto count = [&](double extent) { return std::clamp(static_cast<int>(std::lround(extent / (0.5 * r_min))), 16, 600); };
  const int nx = count(length), ny = count(width);
  const double hx = length / nx, hy = width / ny;
  std::vector<double> top(static_cast<std::size_t>(nx) * ny, -1e300), bottom(top.size(), 1e300);
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    const double r = s.radius[f];
    for (auto p = s.offset[f]; p + 1 < s.offset[f + 1]; ++p) {
      const Vec3 d = s.x[p + 1] - s.x[p];
      const int pieces = std::max(1, static_cast<int>(std::ceil(d.norm() / (0.5 * std::min(hx, hy)))));
      for (int k = 0; k < pieces; ++k) {
        const Vec3 q = s.x[p] + (k + 0.5) / pieces * d;
        const int ix0 = static_cast<int>(std::ceil((q.x() - r - s.x_min) / hx - 0.5));
        const int ix1 = static_cast<int>(std::floor((q.x() + r - s.x_min) / hx - 0.5));
        const int iy0 = static_cast<int>(std::ceil((q.y() - r) / hy - 0.5)), iy1 = static_cast<int>(std::floor((q.y() + r) / hy - 0.5));
        for (int ix = ix0; ix <= ix1; ++ix) {
          if (!goes_on && (ix < 0 || ix >= nx)) continue;
          for (int iy = iy0; iy <= iy1; ++iy) {
            const double dx = s.x_min + (ix + 0.5) * hx - q.x(), dy = (iy + 0.5) * hy - q.y();
            const double h2 = r * r - dx * dx - dy * dy;
            if (h2 < 0) continue;
            const std::size_t cell = static_cast<std::size_t>(((ix % nx) + nx) % nx) * ny + ((iy % ny) + ny) % ny;
            top[cell] = std::max(top[cell], q.z() + std::sqrt(h2));
            bottom[cell] = std::min(bottom[cell], q.z() - std::sqrt(h2));
          }
        }
      }
    }
  }
  double sum = 0;
  std::size_t covered = 0;
  for (std::size_t i = 0; i < top.size(); ++i) {
    if (top[i] < bottom[i]) continue;
    sum += top[i] - bottom[i];
    ++covered;
  }
  return covered > 0 ? sum / static_cast<double>(covered) : 0;
}

Vec3 point_at_arc(const Snapshot& s, std::size_t f, double wanted) {
  const auto begin = s.offset[f], end = s.offset[f + 1];
  const auto at = std::upper_bound(s.arc.begin() + begin, s.arc.begin() + end - 1, wanted) - s.arc.begin();
  const auto p = std::max<std::int64_t>(begin, std::min<std::int64_t>(at, end - 1) - 1);
  const double span = s.arc[p + 1] - s.arc[p];
  return s.x[p] + (span > 0 ? (wanted - s.arc[p]) / span : 0) * (s.x[p + 1] - s.x[p]);
}

/// Point of a fiber at a share of its length from the cell's face: of a warp's from its first node, of a weft's, which closes on itself and
/// whose first node may be anywhere, from where it first passes a face across y.
Vec3 point_at_share(const Snapshot& s, std::size_t f, double share) {
  const double length = s.arc[s.offset[f + 1] - 1];
  if (!s.weft[f]) return point_at_arc(s, f, share * length);
  const double face = std::ceil(s.x[s.offset[f]].y() / s.cell_width) * s.cell_width;
  auto p = s.offset[f];
  while (p + 2 < s.offset[f + 1] && s.x[p + 1].y() < face) ++p;
  const double rise = s.x[p + 1].y() - s.x[p].y();
  const double start = s.arc[p] + (rise > 0 ? std::clamp((face - s.x[p].y()) / rise, 0.0, 1.0) : 0) * (s.arc[p + 1] - s.arc[p]);
  const double arc = start + share * length;
  const bool around = arc > length;
  return point_at_arc(s, f, around ? arc - length : arc) + Vec3(0, (around ? s.cell_width : 0) - face, 0);
}

/// As yarn_paths, but a yarn has no station where a plane cuts none of its fibers.
std::vector<YarnPath> cut_paths(const Snapshot& s, int stations, const Vec3& shift) {
  struct Extent {
    double low = 1e300, high = -1e300;
    void hold(double at, double half) {
      low = std::min(low, at - half);
      high = std::max(high, at + half);
    }
    [[nodiscard]] double size() const { return high - low; }
  };
  struct Cut {
    double first = 0, across = 0, z = 0;
    int count = 0;
    Extent wide, tall;
  };
  std::map<int, YarnPath> paths;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    paths[s.yarn[f]].yarn = s.yarn[f];
    paths[s.yarn[f]].weft = s.weft[f] != 0;
  }
  for (const bool weft : {false, true}) {
    const SectionAxis axis = weft ? SectionAxis::y : SectionAxis::x;
    const double period = weft ? s.cell_width : s.cell_length, period_across = section_period(s, axis);
    const double face = weft ? shift.y() : s.x_min + shift.x();
    for (int k = 0; k < stations; ++k) {
      const double along = face + (k + 0.5) / stations * period;
      std::map<int, Cut> cuts;
      for (const SectionCircle& c : cut_section(s, axis, along)) {
        if (c.weft != weft) continue;
        Cut& cut = cuts[c.yarn];
        if (cut.count == 0) cut.first = c.u;
        const double u = c.u - period_across * std::round((c.u - cut.first) / period_across);  // the image beside the first fiber
        const double cosine = std::cos(c.angle), sine = std::sin(c.angle);
        cut.wide.hold(u, c.radius * std::hypot(c.aspect * cosine, sine));
        cut.tall.hold(c.z, c.radius * std::hypot(c.aspect * sine, cosine));
        cut.across += u;
        cut.z += c.z;
        ++cut.count;
      }
      for (const auto& [yarn, cut] : cuts)
        paths[yarn].stations.push_back({along, cut.across / cut.count, cut.z / cut.count, cut.wide.size(), cut.tall.size()});
    }
  }
  std::vector<YarnPath> result;
  for (auto& [yarn, path] : paths) result.push_back(std::move(path));
  return result;
}

constexpr std::size_t stations_of_measures = 64;

/// Mean widths and heights of the yarns of one family; not_measured unless all of its yarns have all their stations.
std::pair<double, double> mean_yarn_size(const std::vector<YarnPath>& paths, bool weft) {
  double width = 0, height = 0, count = 0;
  for (const YarnPath& path : paths) {
    if (path.weft != weft) continue;
    if (path.stations.size() < stations_of_measures) return {not_measured, not_measured};
    width += path.width();
    height += path.height();
    ++count;
  }
  return {width / count, height / count};  // 0 / 0 is not_measured
}

/// Spans (low, high) of z that fibers fill, for each of equal columns over the period along y.
using Columns = std::vector<std::vector<std::pair<double, double>>>;

/// Adds what a fiber of a unit cell, and its images, fill of the plane x = `plane`: as spheres that overlap by most of their radius.
void add_spans(const Snapshot& s, std::size_t f, double plane, Columns& spans) {
  const double r = s.radius[f], sphere_distance = 0.1 * r;
  const auto columns = static_cast<int>(spans.size());
  const double h = s.cell_width / columns;
  const auto distance = [&](double x) { return x - plane - s.cell_length * std::round((x - plane) / s.cell_length); };
  for (auto p = s.offset[f]; p + 1 < s.offset[f + 1]; ++p) {
    const Vec3 d = s.x[p + 1] - s.x[p];
    if (std::abs(distance(s.x[p].x() + 0.5 * d.x())) > r + 0.5 * d.norm()) continue;
    const int pieces = std::max(1, static_cast<int>(std::ceil(d.norm() / sphere_distance)));
    for (int i = 0; i < pieces; ++i) {
      const Vec3 q = s.x[p] + (i + 0.5) / pieces * d;
      const double dx = distance(q.x());
      if (std::abs(dx) >= r) continue;
      const double reach = std::sqrt(r * r - dx * dx);
      const int from = static_cast<int>(std::ceil((q.y() - reach) / h - 0.5)), to = static_cast<int>(std::floor((q.y() + reach) / h - 0.5));
      for (int j = from; j <= to; ++j) {
        const double dy = (j + 0.5) * h - q.y(), half = std::sqrt(std::max(0.0, reach * reach - dy * dy));
        auto& column = spans[static_cast<std::size_t>(((j % columns) + columns) % columns)];
        const double low = q.z() - half, high = q.z() + half;
        // Successive pieces overlap: what a fiber fills of a column is one span.
        if (!column.empty() && low <= column.back().second && column.back().first <= high) {
          column.back() = {std::min(low, column.back().first), std::max(high, column.back().second)};
        } else {
          column.emplace_back(low, high);
        }
      }
    }
  }
}

/// Length between the spans of a column that none of them covers, and how far it is from the lowest to the highest of them.
std::pair<double, double> gaps_and_whole(std::vector<std::pair<double, double>>& spans) {
  if (spans.empty()) return {0, 0};
  std::sort(spans.begin(), spans.end());
  double gaps = 0, end = spans.front().first;
  for (const auto& [low, high] : spans) {
    gaps += std::max(0.0, low - end);
    end = std::max(end, high);
  }
  return {gaps, end - spans.front().first};
}

/// Number of a yarn's fibers that lie within the outermost ring, and so come first; 0: all are alike.
int fibers_in_middle(int fibers) {
  if (fibers <= 3) return 0;
  int middle = 1;
  for (int ring = 1; middle + 6 * ring < fibers; ++ring) middle += 6 * ring;
  return middle;
}

}  // namespace

CellMeasures measure_cell(const Snapshot& nodes) {
  const Snapshot s = on_axis(nodes);
  CellMeasures m;
  double high = -std::numeric_limits<double>::infinity(), low = -high;
  double warp_length = 0, weft_length = 0, warp_stress = 0, weft_stress = 0;
  std::size_t warps = 0, wefts = 0, warp_nodes = 0, weft_nodes = 0;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    const double length = length_of(s, f);
    m.fiber_volume += length * s.area[f];
    (s.weft[f] ? weft_length : warp_length) += length;
    ++(s.weft[f] ? wefts : warps);
    for (auto p = s.offset[f]; p < s.offset[f + 1]; ++p) {
      high = std::max(high, s.x[p].z() + s.radius[f]);
      low = std::min(low, s.x[p].z() - s.radius[f]);
      const double stress = s.stress(f, p);
      m.stress_max = std::max(m.stress_max, stress);
      (s.weft[f] ? weft_stress : warp_stress) += stress;
      ++(s.weft[f] ? weft_nodes : warp_nodes);
    }
  }
  const double length = s.x_max - s.x_min, area = length * s.cell_width;
  m.thickness = high - low;
  m.thickness_mean = mean_envelope_distance(s);
  m.fiber_volume_fraction = m.fiber_volume / (area * m.thickness);
  m.fiber_volume_fraction_mean = m.fiber_volume / (area * m.thickness_mean);
  if (warps > 0) {
    m.crimp_warp = warp_length / (static_cast<double>(warps) * length) - 1;
    m.stress_mean_warp = warp_stress / static_cast<double>(warp_nodes);
  }
  if (wefts > 0) {
    m.crimp_weft = weft_length / (static_cast<double>(wefts) * s.cell_width) - 1;
    m.stress_mean_weft = weft_stress / static_cast<double>(weft_nodes);
  }
  if (s.cell_length > 0) {
    const std::vector<YarnPath> paths = cut_paths(s, stations_of_measures, Vec3::Zero());
    std::tie(m.yarn_width_warp, m.yarn_height_warp) = mean_yarn_size(paths, false);
    std::tie(m.yarn_width_weft, m.yarn_height_weft) = mean_yarn_size(paths, true);
  }
  return m;
}

std::vector<std::pair<std::string, double>> named(const CellMeasures& m) {
  return {{"thickness_m", m.thickness},
          {"thickness_mean_m", m.thickness_mean},
          {"fiber_volume_m3", m.fiber_volume},
          {"fiber_volume_fraction", m.fiber_volume_fraction},
          {"fiber_volume_fraction_mean", m.fiber_volume_fraction_mean},
          {"crimp_warp", m.crimp_warp},
          {"crimp_weft", m.crimp_weft},
          {"stress_max_Pa", m.stress_max},
          {"stress_mean_warp_Pa", m.stress_mean_warp},
          {"stress_mean_weft_Pa", m.stress_mean_weft},
          {"yarn_width_warp_m", m.yarn_width_warp},
          {"yarn_height_warp_m", m.yarn_height_warp},
          {"yarn_width_weft_m", m.yarn_width_weft},
          {"yarn_height_weft_m", m.yarn_height_weft}};
}

std::vector<double> void_shares(const Snapshot& nodes, int sections) {
  if (!(nodes.cell_length > 0)) throw std::invalid_argument("void_shares: the snapshot is not of a unit cell");
  constexpr double column_width = 0.05;  // of the smallest fiber's radius
  const Snapshot s = on_axis(nodes);
  const double r_min = *std::min_element(s.radius.begin(), s.radius.end());
  const auto columns = static_cast<std::size_t>(std::clamp(s.cell_width / (column_width * r_min), 64.0, 1e4));
  std::vector<double> shares;
  for (int k = 0; k < sections; ++k) {
    const double plane = s.x_min + (k + 0.5) / sections * s.cell_length;
    Columns spans(columns);
    for (std::size_t f = 0; f < s.fibers(); ++f) add_spans(s, f, plane, spans);
    double voids = 0, whole = 0;
    for (auto& column : spans) {
      const auto [gaps, height] = gaps_and_whole(column);
      voids += gaps;
      whole += height;
    }
    shares.push_back(voids / whole);
  }
  return shares;
}

StressByPlace warp_stress_by_place(const Snapshot& nodes) {
  const Snapshot s = on_axis(nodes);
  std::map<int, int> fibers;
  for (const int yarn : s.yarn) ++fibers[yarn];
  double sum[2] = {}, count[2] = {};  // in the middle, at the edge
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    const int middle = fibers_in_middle(fibers[s.yarn[f]]);
    if (s.weft[f] || middle == 0) continue;
    const int place = s.fiber[f] < middle ? 0 : 1;
    for (auto p = s.offset[f]; p < s.offset[f + 1]; ++p) {
      sum[place] += s.stress(f, p);
      ++count[place];
    }
  }
  return {sum[0] / count[0], sum[1] / count[1]};  // 0 / 0 is not_measured
}

std::vector<double> warp_stress_behind_fell(const Snapshot& s, double length, int count) {
  const auto lengths = static_cast<std::size_t>(std::clamp(static_cast<int>(-s.x_min / length), 0, count));
  std::vector<double> sum(lengths), nodes(lengths);
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    if (s.weft[f]) continue;
    for (auto p = s.offset[f]; p < s.offset[f + 1]; ++p) {
      if (s.x[p].x() >= 0) continue;
      const auto k = static_cast<std::size_t>(-s.x[p].x() / length);
      if (k >= lengths) continue;
      sum[k] += s.stress(f, p);
      ++nodes[k];
    }
  }
  for (std::size_t k = 0; k < lengths; ++k) sum[k] /= nodes[k];
  return sum;
}

namespace {

constexpr int steadiness_samples = 64;  ///< of a fiber

/// A cell as it lay on the loom, before it was drawn to the cell's length.
Snapshot as_on_loom(Snapshot cell) {
  if (!(cell.length_on_loom > 0)) return cell;
  const double factor = cell.length_on_loom / cell.cell_length;
  for (Vec3& x : cell.x) x.x() = cell.x_max + factor * (x.x() - cell.x_max);
  cell.x_min = cell.x_max - cell.length_on_loom;
  cell.cell_length = cell.length_on_loom;
  return cell;
}

/// The k-th of steadiness_samples points of a fiber, at even shares of its length from the cell's face, of a warp that has slid along
/// itself by a share `slide`; behind the cell's end a warp goes on as its own image.
Vec3 point_from_face(const Snapshot& s, std::size_t f, int k, double slide) {
  const double share = (k + 0.5) / steadiness_samples + slide, cells = s.weft[f] ? 0 : std::floor(share);
  return point_at_share(s, f, share - cells) + Vec3(cells * s.cell_length - s.x_min, 0, 0);
}

std::vector<Vec3> paths_from_face(const Snapshot& s, const std::vector<double>& slide) {
  std::vector<Vec3> path;
  path.reserve(s.fibers() * steadiness_samples);
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    for (int k = 0; k < steadiness_samples; ++k) path.push_back(point_from_face(s, f, k, slide[f]));
  }
  return path;
}

/// First fiber after those of the yarn that begins with fiber `first`.
std::size_t end_of_yarn(const Snapshot& s, std::size_t first) {
  std::size_t end = first + 1;
  while (end < s.fibers() && s.yarn[end] == s.yarn[first]) ++end;
  return end;
}

/// How far the axis of each warp of b has to slide along itself to lie on that of path_a best, in shares of its length, by fiber: where a
/// steep leg lies near the face, a little of x moves the place where it crosses the face by much of its length.
std::vector<double> slides_of_warps(const std::vector<Vec3>& path_a, const Snapshot& b, const Vec3& shift) {
  constexpr int candidates = 256;  // to either side
  constexpr double farthest = 0.5;
  std::vector<double> best(b.fibers(), 0);
  for (std::size_t first = 0, end = 0; first < b.fibers(); first = end) {
    end = end_of_yarn(b, first);
    if (b.weft[first]) continue;
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 2 * candidates; ++i) {
      const double slide = farthest * ((i + 1) / 2) * (i % 2 == 0 ? 1 : -1) / candidates;  // none first
      double distance = 0;
      for (int k = 0; k < steadiness_samples; ++k) {
        Vec3 apart = Vec3::Zero();
        for (std::size_t f = first; f < end; ++f)
          apart += point_from_face(b, f, k, slide) - path_a[f * steadiness_samples + static_cast<std::size_t>(k)] - shift;
        distance += apart.norm();
      }
      if (distance < least) {
        least = distance;
        std::fill(best.begin() + static_cast<std::ptrdiff_t>(first), best.begin() + static_cast<std::ptrdiff_t>(end), slide);
      }
    }
  }
  return best;
}

}  // namespace

Steadiness steadiness(const Snapshot& before, const Snapshot& after) {
  const Snapshot a = as_on_loom(before), b = as_on_loom(after);
  if (a.yarn != b.yarn || a.fiber != b.fiber) throw std::invalid_argument("steadiness: the two cells do not hold the same fibers");
  Steadiness result;
  constexpr int samples = steadiness_samples;
  const std::size_t fibers = a.fibers();
  const double total = static_cast<double>(fibers);
  const std::vector<Vec3> path_a = paths_from_face(a, std::vector<double>(fibers, 0));
  std::vector<double> slide(fibers, 0);
  std::vector<Vec3> path_b;
  for (int pass = 0; pass < 3; ++pass) {  // the shift of the cells and the slides of their warps tell on one another
    path_b = paths_from_face(b, slide);
    result.shift.setZero();
    for (std::size_t i = 0; i < path_a.size(); ++i) result.shift += (path_b[i] - path_a[i]) / (total * samples);
    if (pass < 2) slide = slides_of_warps(path_a, b, result.shift);
  }
  const auto distance = [&](std::size_t of_a, std::size_t of_b, double* largest) {
    double sum = 0;
    for (std::size_t k = 0; k < samples; ++k) {
      const double d = (path_b[of_b * samples + k] - path_a[of_a * samples + k] - result.shift).norm() / (2 * a.radius[of_a]);
      sum += d;
      if (largest) *largest = std::max(*largest, d);
    }
    return sum / samples;
  };
  for (std::size_t first = 0; first < fibers;) {
    const std::size_t end = end_of_yarn(a, first);
    const auto n = static_cast<Eigen::Index>(end - first);
    Eigen::MatrixXd cost(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j)
        cost(i, j) = distance(first + static_cast<std::size_t>(i), first + static_cast<std::size_t>(j), nullptr);
    }
    const std::vector<Eigen::Index> partner = cheapest_assignment(cost);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t f = first + static_cast<std::size_t>(i);
      result.mean += distance(f, first + static_cast<std::size_t>(partner[static_cast<std::size_t>(i)]), &result.largest) / total;
      result.mean_by_label += cost(i, i) / total;
    }
    first = end;
  }
  return result;
}

double YarnPath::width() const {
  double sum = 0;
  for (const YarnStation& s : stations) sum += s.width;
  return sum / static_cast<double>(stations.size());
}

double YarnPath::height() const {
  double sum = 0;
  for (const YarnStation& s : stations) sum += s.height;
  return sum / static_cast<double>(stations.size());
}

std::vector<YarnPath> yarn_paths(const Snapshot& s, int stations, const Vec3& shift) {
  if (!(s.cell_length > 0)) throw std::invalid_argument("yarn_paths: the snapshot is not of a unit cell");
  std::vector<YarnPath> paths = cut_paths(s, stations, shift);
  for (const YarnPath& path : paths) {
    if (path.stations.size() < static_cast<std::size_t>(stations))
      throw std::invalid_argument("yarn_paths: a plane cuts no fiber of yarn " + std::to_string(path.yarn));
  }
  return paths;
}

}  // namespace weave
