#include "weave/cloth_order.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>

namespace weave {
namespace {

/// Means over a weft's fibers.
struct WeftPlace {
  int yarn = 0;
  double x = 0, z = 0, nodes = 0;
};

std::vector<WeftPlace> weft_places(const Snapshot& s) {
  std::map<int, WeftPlace> wefts;  // by number, which rises from the first pick of a column to its last
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    if (!s.weft[f]) continue;
    WeftPlace& weft = wefts[s.yarn[f]];
    for (auto p = s.offset[f]; p + 1 < s.offset[f + 1]; ++p) {  // the last node is the first one's image
      weft.x += s.x[p].x();
      weft.z += s.x[p].z();
      ++weft.nodes;
    }
  }
  std::vector<WeftPlace> places;
  for (const auto& [yarn, sum] : wefts) places.push_back({yarn, sum.x / sum.nodes, sum.z / sum.nodes, sum.nodes});
  return places;
}

void note_fibers(const Snapshot& s, ClothOrder& order) {
  std::map<int, std::vector<double>> lengths;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    double length = 0;
    for (auto p = s.offset[f]; p + 1 < s.offset[f + 1]; ++p) {
      const Vec3 bar = s.x[p + 1] - s.x[p];
      length += bar.norm();
      if (p == s.offset[f]) continue;
      const Vec3 before = s.x[p] - s.x[p - 1];
      const double cosine = bar.dot(before) / std::sqrt(bar.squaredNorm() * before.squaredNorm());
      order.sharpest_turn = std::max(order.sharpest_turn, std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
    lengths[s.yarn[f]].push_back(length);
  }
  for (const auto& [yarn, all] : lengths) {
    double mean = 0;
    for (const double length : all) mean += length / static_cast<double>(all.size());
    order.fiber_slack = std::max(order.fiber_slack, *std::max_element(all.begin(), all.end()) / mean - 1);
  }
}

}  // namespace

ClothOrder cloth_order(const Snapshot& s, int layers, InsertionOrder insertion) {
  if (!(s.cell_length > 0)) throw std::invalid_argument("cloth_order: the snapshot is not of a unit cell");
  const std::vector<WeftPlace> wefts = weft_places(s);
  if (layers < 1 || wefts.empty() || wefts.size() % static_cast<std::size_t>(layers) != 0)
    throw std::invalid_argument("cloth_order: the wefts do not make whole columns");
  ClothOrder order;
  order.column_spread = 0;
  std::vector<double> columns;
  for (std::size_t first = 0; first < wefts.size(); first += static_cast<std::size_t>(layers)) {
    double sum = 0, low = wefts[first].x, high = low;
    for (std::size_t i = first; i < first + static_cast<std::size_t>(layers); ++i) {
      sum += wefts[i].x;
      low = std::min(low, wefts[i].x);
      high = std::max(high, wefts[i].x);
      if (i == first) continue;
      const auto layer = [&](std::size_t pick) { return layer_of_pick(static_cast<int>(pick), layers, insertion); };
      const double below = wefts[i - 1].z - wefts[i].z;
      if ((layer(i) > layer(i - 1) ? below : -below) <= 0) ++order.wefts_out_of_layer;
    }
    order.column_spread = std::max(order.column_spread, high - low);
    columns.push_back(sum / layers);
  }
  std::sort(columns.begin(), columns.end());
  for (std::size_t i = 0; i + 1 < columns.size(); ++i) order.column_distances.push_back(columns[i + 1] - columns[i]);
  order.column_distances.push_back(columns.front() + s.cell_length - columns.back());
  note_fibers(s, order);
  return order;
}

std::vector<double> column_distances_behind_fell(const Snapshot& loom, int warps, int layers) {
  std::map<int, std::pair<double, int>> columns;  // sum of the wefts' x, and how many
  for (const WeftPlace& weft : weft_places(loom)) {
    auto& [sum, count] = columns[(weft.yarn - warps) / layers];
    sum += weft.x;
    ++count;
  }
  std::vector<double> distances;
  double nearer = 0;
  for (auto column = columns.rbegin(); column != columns.rend(); ++column) {
    const double x = column->second.first / column->second.second;
    if (column != columns.rbegin()) distances.push_back(nearer - x);
    nearer = x;
  }
  return distances;
}

}  // namespace weave
