#include "relax/compare.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "relax/woven_start.hpp"
#include "weave/case.hpp"
#include "weave/results.hpp"

namespace relax {
namespace {

constexpr int stations = 64;          ///< sections of each yarn
constexpr int looks = 3;              ///< the planes lie elsewhere on yarns that have been moved: after two the shift is settled
constexpr double same_place = 0.01;   ///< [fiber diameters]
constexpr double round_off = 1e-13;   ///< of an energy, relative to its parts: sums of up to 1e5 terms
constexpr double same_length = 1e-6;  ///< of cells, relative

std::string name_of(const std::filesystem::path& input) {
  const std::filesystem::path clean = input.lexically_normal();
  return (clean.has_filename() ? clean : clean.parent_path()).filename().string();
}

weave::Case read_case(ComparedState& state, const std::string& case_toml) {
  weave::Case c = weave::parse_case(case_toml, state.file.string());
  state.case_toml = case_toml;
  state.case_name = c.name;
  state.matrix = c.matrix();
  return c;
}

void measure(ComparedState& state) {
  state.snapshot = snapshot_of(state.cell, state.q);
  state.measures = weave::measure_cell(state.snapshot);
}

/// Energy and certificate of a state, out of the summary beside it.
void read_summary(const std::filesystem::path& file, ComparedState& state) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": no such file, it must lie beside relax.vtkhdf");
  try {
    const auto j = nlohmann::json::parse(in);
    if (j.at("tool") != "relax") throw std::runtime_error("tool = " + j.at("tool").dump() + ": must be \"relax\"");
    if (j.at("nodes").get<std::size_t>() != state.cell.nodes() || j.at("fibers").get<std::size_t>() != state.cell.fibers()) {
      throw std::runtime_error("is of " + j.at("fibers").dump() + " fibers with " + j.at("nodes").dump() + " nodes, relax.vtkhdf of " +
                               std::to_string(state.cell.fibers()) + " with " + std::to_string(state.cell.nodes()));
    }
    const auto& e = j.at("energy_J");
    state.energy = {.bars = e.at("bars"),
                    .bending = e.at("bending"),
                    .contact = e.at("contact"),
                    .tension = e.at("tension"),
                    .platens = e.at("platens"),
                    .loads = e.at("loads")};
    Certificate& c = state.certificate;
    each_finding(c, [&](const char* key, auto& value) {
      if (key == std::string_view("free_fibers") && !j.contains(key)) return;  // of an older result
      j.at(key).get_to(value);
    });
    const auto& error = j.at("energy_error_J");
    c.energy_error = error.is_null() ? std::numeric_limits<double>::infinity() : error.get<double>();
  } catch (const std::exception& e) {
    throw std::runtime_error(file.string() + ": " + e.what());
  }
}

/// Mean way from a's yarns to b's along each axis: across from the yarns of either family, which may all be a whole number of periods
/// away, and up from both.
Vec3 shift_between(const std::vector<weave::YarnPath>& a, const std::vector<weave::YarnPath>& b, double length_x, double length_y) {
  Vec3 sum = Vec3::Zero(), count = Vec3::Zero();
  std::optional<double> first[2];
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int axis = a[i].weft ? 0 : 1;
    const double period = axis == 0 ? length_x : length_y;
    for (std::size_t k = 0; k < a[i].stations.size(); ++k) {
      double across = b[i].stations[k].across - a[i].stations[k].across;
      across -= period * std::round((across - first[axis].value_or(0)) / period);
      first[axis] = first[axis].value_or(across);
      sum += Vec3(axis == 0 ? across : 0, axis == 1 ? across : 0, b[i].stations[k].z - a[i].stations[k].z);
      count += Vec3(axis == 0, axis == 1, 1);
    }
  }
  return sum.cwiseQuotient(count.cwiseMax(1));
}

/// Indices of fibers by rising yarn and place in it: cells with other starts have their wefts in another order.
std::vector<std::size_t> in_order(const std::vector<int>& yarn, const std::vector<int>& place) {
  std::vector<std::size_t> order(yarn.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t f, std::size_t g) { return std::pair(yarn[f], place[f]) < std::pair(yarn[g], place[g]); });
  return order;
}

weave::Snapshot in_order(const weave::Snapshot& s) {
  weave::Snapshot sorted = s;
  sorted.x.clear();
  sorted.tension.clear();
  sorted.arc.clear();
  sorted.offset.assign(1, 0);
  const std::vector<std::size_t> order = in_order(s.yarn, s.fiber);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t f = order[i];
    sorted.yarn[i] = s.yarn[f];
    sorted.fiber[i] = s.fiber[f];
    sorted.weft[i] = s.weft[f];
    sorted.radius[i] = s.radius[f];
    sorted.area[i] = s.area[f];
    sorted.x.insert(sorted.x.end(), s.x.begin() + s.offset[f], s.x.begin() + s.offset[f + 1]);
    sorted.tension.insert(sorted.tension.end(), s.tension.begin() + s.offset[f], s.tension.begin() + s.offset[f + 1]);
    sorted.arc.insert(sorted.arc.end(), s.arc.begin() + s.offset[f], s.arc.begin() + s.offset[f + 1]);
    sorted.offset.push_back(static_cast<std::int64_t>(sorted.x.size()));
  }
  return sorted;
}

/// The state in a cell of the lengths of `onto`, drawn out evenly along x and y, and translated.
weave::Snapshot drawn_onto(const weave::Snapshot& onto, const ComparedState& state, const Vec3& by) {
  Cell cell = state.cell;
  Eigen::VectorXd q = state.q;
  settle_lengths(cell, q);
  cell.length_x = onto.cell_length;
  cell.length_y = onto.cell_width;
  const Vec3 draw(onto.cell_length / state.snapshot.cell_length, onto.cell_width / state.snapshot.cell_width, 1);
  for (Eigen::Index i = 0; i < 3 * Eigen::Index(cell.nodes()); i += 3) q.segment<3>(i) = q.segment<3>(i).cwiseProduct(draw) + by;
  return in_order(snapshot_of(cell, q));
}

bool same_type(const FiberType& a, const FiberType& b) {
  return a.radius == b.radius && a.area == b.area && a.youngs_modulus == b.youngs_modulus && a.compression_factor == b.compression_factor &&
         a.transverse_modulus == b.transverse_modulus && a.bending_stiffness == b.bending_stiffness;
}

/// Whether the energies of two cells can be compared.
enum class Potential {
  same,
  other_nodes,  ///< the same fibers under the same loads, but not as many nodes, where the rest length is free
  other,
};

Potential compare_potentials(const Cell& a, const Cell& b) {
  // A length that is given is part of the potential, and so is the force of platens, which press on the area of lengths that were given.
  const auto same = [](double u, double v) { return std::abs(u - v) <= same_length * std::abs(u); };
  const auto pressed = [](const Cell& c) { return c.pressure * c.length_x * c.length_y; };
  if (a.fibers() != b.fibers() || a.load_x != b.load_x || a.load_y != b.load_y || a.slack_strain != b.slack_strain ||
      !same(pressed(a), pressed(b)) || (!a.load_x && !same(a.length_x, b.length_x)) || (!a.load_y && !same(a.length_y, b.length_y)))
    return Potential::other;
  const std::vector<std::size_t> order_a = in_order(a.yarn, a.place), order_b = in_order(b.yarn, b.place);
  Potential potential = Potential::same;
  for (std::size_t i = 0; i < order_a.size(); ++i) {
    const std::size_t f = order_a[i], g = order_b[i];
    if (a.yarn[f] != b.yarn[g] || a.tension[f] != b.tension[g] || !same_type(a.type_of(f), b.type_of(g))) return Potential::other;
    if (a.nodes_of(f) != b.nodes_of(g)) potential = Potential::other_nodes;
    if (a.tension[f] > 0) continue;
    if (!std::equal(a.rest_length.begin() + a.first[f], a.rest_length.begin() + a.first[f + 1], b.rest_length.begin() + b.first[g],
                    b.rest_length.begin() + b.first[g + 1])) {
      return Potential::other;
    }
  }
  return potential;
}

}  // namespace

double ComparedState::diameter() const {
  return 2 * *std::max_element(snapshot.radius.begin(), snapshot.radius.end());
}

std::size_t ComparedState::fibers_per_yarn() const {
  return static_cast<std::size_t>(std::count(snapshot.yarn.begin(), snapshot.yarn.end(), snapshot.yarn.front()));
}

double ComparedState::potential() const {
  const double loads = cell.load_x.value_or(0) * snapshot.cell_length + cell.load_y.value_or(0) * snapshot.cell_width;
  return energy.sum() - energy.loads - loads;
}

double ComparedState::energy_error() const {
  return certificate.energy_error + round_off * (energy.bars + energy.bending + energy.contact + std::abs(energy.tension) +
                                                 std::abs(energy.platens) + std::abs(energy.loads) + std::abs(potential() - energy.sum()));
}

ComparedState read_relaxed_state(const std::filesystem::path& folder) {
  ComparedState state;
  state.file = folder / "relax.vtkhdf";
  if (!std::filesystem::exists(state.file))
    throw std::runtime_error(folder.string() + ": holds no relax.vtkhdf, it is no folder of heddle relax");
  state.name = name_of(folder);
  RelaxedFile relaxed = read_relaxed(state.file);
  read_case(state, relaxed.case_toml);
  state.cell = std::move(relaxed.cell);
  state.q = std::move(relaxed.q);
  state.relaxed = true;
  measure(state);
  read_summary(folder / "summary.json", state);
  return state;
}

ComparedState read_woven_state(const std::filesystem::path& input) {
  ComparedState state;
  state.file = std::filesystem::is_directory(input) ? input / "cell.vtkhdf" : input;
  state.name = name_of(input);
  const weave::ResultsFile results = weave::read_results(state.file);
  if (is_relaxed(state.file)) throw std::runtime_error(state.file.string() + ": is of a relaxed cell, not of a woven one");
  try {
    const weave::Case c = read_case(state, results.case_toml);
    WovenStart start = cell_from_woven(c, results.snapshot, {0, 0, c.numerics.element_length});
    state.cell = std::move(start.cell);
    state.q = unknowns_at(state.cell, start.x);
  } catch (const std::invalid_argument& e) {
    throw std::runtime_error(state.file.string() + ": " + e.what());
  }
  measure(state);
  return state;
}

void expect_comparable(const ComparedState& a, const ComparedState& b) {
  const auto expect = [&](bool same, const std::string& what) {
    if (!same) throw std::runtime_error(b.file.string() + ": " + what + " " + a.file.string());
  };
  const auto yarns = [](const weave::Snapshot& s) {
    std::map<int, bool> weft;
    for (std::size_t f = 0; f < s.fibers(); ++f) weft[s.yarn[f]] = s.weft[f] != 0;
    return weft;
  };
  expect(a.matrix.rows() == b.matrix.rows() && a.matrix.cols() == b.matrix.cols() && a.matrix == b.matrix,
         "is of the case " + b.case_name + ", whose weaving matrix is not that of " + a.case_name + " in");
  expect(yarns(a.snapshot) == yarns(b.snapshot), "has other yarns than");
}

Aligned align(const ComparedState& onto, const ComparedState& state) {
  const double length_x = onto.snapshot.cell_length, length_y = onto.snapshot.cell_width;
  const std::vector<weave::YarnPath> target = weave::yarn_paths(onto.snapshot, stations);
  Aligned aligned;
  for (int look = 0;; ++look) {
    aligned.snapshot = drawn_onto(onto.snapshot, state, -aligned.shift);
    aligned.paths = weave::yarn_paths(aligned.snapshot, stations);
    if (look == looks) break;
    aligned.shift += shift_between(target, aligned.paths, length_x, length_y);
  }
  std::map<int, Vec3> back;
  for (std::size_t i = 0; i < target.size(); ++i) {
    const bool weft = target[i].weft;
    const double period = weft ? length_x : length_y;
    const double away = aligned.paths[i].stations.front().across - target[i].stations.front().across;
    const double periods = period * std::round(away / period);
    for (weave::YarnStation& station : aligned.paths[i].stations) station.across -= periods;
    back[target[i].yarn] = weft ? Vec3(periods, 0, 0) : Vec3(0, periods, 0);
  }
  weave::Snapshot& s = aligned.snapshot;
  for (std::size_t f = 0; f < s.fibers(); ++f) {
    for (auto p = s.offset[f]; p < s.offset[f + 1]; ++p) s.x[static_cast<std::size_t>(p)] -= back.at(s.yarn[f]);
  }
  return aligned;
}

Difference difference(const ComparedState& a, const ComparedState& b) {
  return difference(a, b, align(a, b));
}

Difference difference(const ComparedState& a, const ComparedState& b, const Aligned& aligned) {
  const weave::Snapshot target = in_order(a.snapshot);
  const std::vector<weave::YarnPath> paths = weave::yarn_paths(target, stations);
  const double diameter = std::max(a.diameter(), b.diameter());
  const double count = static_cast<double>(paths.size()) * stations;
  Difference d;
  d.cell_length = b.snapshot.cell_length / a.snapshot.cell_length - 1;
  d.cell_width = b.snapshot.cell_width / a.snapshot.cell_width - 1;
  d.shift = aligned.shift;
  const auto add = [&](MeanAndLargest& figure, double difference) {
    figure.mean += difference / diameter / count;
    figure.largest = std::max(figure.largest, difference / diameter);
  };
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const double period = paths[i].weft ? a.snapshot.cell_length : a.snapshot.cell_width;
    for (std::size_t k = 0; k < paths[i].stations.size(); ++k) {
      const weave::YarnStation &u = paths[i].stations[k], &v = aligned.paths[i].stations[k];
      double across = v.across - u.across;
      across -= period * std::round(across / period);  // a yarn on the face may be cut in either image
      add(d.path, std::hypot(across, v.z - u.z));
      add(d.width, std::abs(v.width - u.width));
      add(d.height, std::abs(v.height - u.height));
    }
  }
  if (target.yarn == aligned.snapshot.yarn && target.fiber == aligned.snapshot.fiber) {
    const weave::Steadiness fibers = weave::steadiness(target, aligned.snapshot);
    d.fibers = {fibers.mean, fibers.largest};
  }
  return d;
}

Verdict verdict(const ComparedState& a, const ComparedState& b, const Difference& d) {
  if (!a.certificate.converged || !b.certificate.converged) return Verdict::not_certified;
  const Potential potential = compare_potentials(a.cell, b.cell);
  if (potential == Potential::other) return Verdict::other_potential;
  const double drawn = std::max(std::abs(d.cell_length) * a.snapshot.cell_length, std::abs(d.cell_width) * a.snapshot.cell_width);
  const bool apart = std::max(d.fibers ? d.fibers->largest : d.path.largest, drawn / std::max(a.diameter(), b.diameter())) > same_place;
  const bool energies_differ = std::abs(a.potential() - b.potential()) > a.energy_error() + b.energy_error();
  if (!(apart && energies_differ)) return Verdict::same;
  return potential == Potential::same ? Verdict::different : Verdict::other_nodes;
}

std::string text_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::same:
      return "the same minimum";
    case Verdict::different:
      return "different minima";
    case Verdict::other_nodes:
      return "different, with other nodes";
    case Verdict::other_potential:
      return "other fibers, loads or lengths";
    case Verdict::not_certified:
      return "not both certified";
  }
  return "";
}

}  // namespace relax
