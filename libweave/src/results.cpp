#include "weave/results.hpp"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "hdf5_file.hpp"
#include "history_file.hpp"
#include "replace_file.hpp"
#include "results_file.hpp"

namespace weave {

namespace {

constexpr const char* format_name = "heddle-results-1";
constexpr std::uint8_t vtk_poly_line = 4;
static_assert(sizeof(Vec3) == 3 * sizeof(double));

/// The value of each fiber at each of its nodes.
template <class T>
std::vector<T> at_nodes(const Snapshot& snapshot, const std::vector<T>& of_fiber) {
  std::vector<T> values;
  values.reserve(snapshot.x.size());
  for (std::size_t i = 0; i < snapshot.fibers(); ++i)
    values.insert(values.end(), static_cast<std::size_t>(snapshot.offset[i + 1] - snapshot.offset[i]), of_fiber[i]);
  return values;
}

std::vector<double> stress_at_nodes(const Snapshot& snapshot) {
  std::vector<double> stress(snapshot.x.size());
  for (std::size_t i = 0; i < snapshot.fibers(); ++i)
    for (auto node = snapshot.offset[i]; node < snapshot.offset[i + 1]; ++node) {
      const auto n = static_cast<std::size_t>(node);
      stress[n] = snapshot.stress(i, n);
    }
  return stress;
}

/// Throws if the arrays do not belong together.
void check(const std::filesystem::path& file, const Snapshot& s) {
  const std::size_t fibers = s.fibers(), nodes = s.x.size();
  const auto expect = [&](const char* name, std::size_t size, std::size_t expected) {
    if (size != expected)
      throw std::runtime_error(file.string() + ": snapshot: " + name + " has " + std::to_string(size) + " entries, must have " +
                               std::to_string(expected));
  };
  expect("offset", s.offset.size(), fibers + 1);
  expect("fiber", s.fiber.size(), fibers);
  expect("weft", s.weft.size(), fibers);
  expect("radius", s.radius.size(), fibers);
  expect("area", s.area.size(), fibers);
  expect("tension", s.tension.size(), nodes);
  expect("arc", s.arc.size(), nodes);
  for (std::size_t i = 0; i < fibers; ++i)
    if (s.offset[i] > s.offset[i + 1])
      throw std::runtime_error(file.string() + ": snapshot: offset falls from fiber " + std::to_string(i) + " to the next");
  if (s.beyond.known()) {
    expect("beyond.offset", s.beyond.offset.size(), fibers + 1);
    expect("beyond.tension", s.beyond.tension.size(), s.beyond.x.size());
    expect("beyond.arc", s.beyond.arc.size(), s.beyond.x.size());
    if (!std::is_sorted(s.beyond.offset.begin(), s.beyond.offset.end()) || s.beyond.offset.front() != 0 ||
        static_cast<std::size_t>(s.beyond.offset.back()) != s.beyond.x.size())
      throw std::runtime_error(file.string() + ": snapshot: beyond.offset must rise from 0 to " + std::to_string(s.beyond.x.size()));
  }
  if (s.offset.front() != 0 || static_cast<std::size_t>(s.offset.back()) != nodes)
    throw std::runtime_error(file.string() + ": snapshot: offset runs from " + std::to_string(s.offset.front()) + " to " +
                             std::to_string(s.offset.back()) + ", must run from 0 to " + std::to_string(nodes));
}

void write_points(Hdf5File& file, const std::string& path, const std::vector<Vec3>& x) {
  file.write_rows(path, std::span<const double>(x.empty() ? nullptr : x.front().data(), 3 * x.size()), 3);
}

/// VTKHDF 1.0, one piece (VTK documentation, "VTKHDF file format", UnstructuredGrid).
void write_snapshot(Hdf5File& file, const Snapshot& s) {
  const std::array<std::int64_t, 2> version = {1, 0};
  const auto nodes = static_cast<std::int64_t>(s.x.size());
  std::vector<std::int64_t> connectivity(s.x.size());
  std::iota(connectivity.begin(), connectivity.end(), 0);

  file.write_group("/VTKHDF");
  file.write_attribute("/VTKHDF", "Version", version);
  file.write_attribute("/VTKHDF", "Type", "UnstructuredGrid");
  file.write<std::int64_t>("/VTKHDF/NumberOfPoints", {nodes});
  file.write<std::int64_t>("/VTKHDF/NumberOfCells", {static_cast<std::int64_t>(s.fibers())});
  file.write<std::int64_t>("/VTKHDF/NumberOfConnectivityIds", {nodes});
  write_points(file, "/VTKHDF/Points", s.x);
  file.write("/VTKHDF/Connectivity", connectivity);
  file.write("/VTKHDF/Offsets", s.offset);
  file.write("/VTKHDF/Types", std::vector<std::uint8_t>(s.fibers(), vtk_poly_line));

  file.write("/VTKHDF/CellData/yarn", s.yarn);
  file.write("/VTKHDF/CellData/fiber", s.fiber);
  file.write("/VTKHDF/CellData/weft", s.weft);
  file.write("/VTKHDF/CellData/radius", s.radius);
  file.write("/VTKHDF/CellData/area", s.area);

  file.write("/VTKHDF/PointData/tension_N", s.tension);
  file.write("/VTKHDF/PointData/stress_Pa", stress_at_nodes(s));
  file.write("/VTKHDF/PointData/arc_m", s.arc);
  file.write("/VTKHDF/PointData/radius_m", at_nodes(s, s.radius));
  file.write("/VTKHDF/PointData/yarn", at_nodes(s, s.yarn));
  file.write("/VTKHDF/PointData/fiber", at_nodes(s, s.fiber));

  file.write<double>("/VTKHDF/FieldData/time_s", {s.time});
  file.write<std::int32_t>("/VTKHDF/FieldData/picks", {s.pick});
  file.write<double>("/VTKHDF/FieldData/cell_width_m", {s.cell_width});
  file.write<double>("/VTKHDF/FieldData/cell_length_m", {s.cell_length});
  if (s.length_on_loom > 0) file.write<double>("/VTKHDF/FieldData/length_on_loom_m", {s.length_on_loom});
  file.write<double>("/VTKHDF/FieldData/x_min_m", {s.x_min});
  file.write<double>("/VTKHDF/FieldData/x_max_m", {s.x_max});
  file.write<std::uint8_t>("/VTKHDF/FieldData/along_axis", {static_cast<std::uint8_t>(s.along_axis)});

  if (!s.beyond.known()) return;
  file.write<double>("/beyond/length_m", {s.beyond.length});
  file.write("/beyond/offset", s.beyond.offset);
  write_points(file, "/beyond/points_m", s.beyond.x);
  file.write("/beyond/tension_N", s.beyond.tension);
  file.write("/beyond/arc_m", s.beyond.arc);
}

template <class T>
T read_one(const Hdf5File& file, const std::filesystem::path& name, const std::string& path) {
  const std::vector<T> values = file.read<T>(path);
  if (values.size() != 1)
    throw std::runtime_error(name.string() + ": " + path + ": has " + std::to_string(values.size()) + " values, must have one");
  return values.front();
}

std::vector<Vec3> read_points(const Hdf5File& file, const std::filesystem::path& name, const std::string& path) {
  const Hdf5Array<double> points = file.read_rows<double>(path);
  if (points.columns != 3) throw std::runtime_error(name.string() + ": " + path + ": must have three columns");
  std::vector<Vec3> x;
  x.reserve(points.rows);
  for (std::size_t i = 0; i < points.rows; ++i) x.emplace_back(points.values[3 * i], points.values[3 * i + 1], points.values[3 * i + 2]);
  return x;
}

Snapshot read_snapshot(const Hdf5File& file, const std::filesystem::path& name) {
  Snapshot s;
  s.time = read_one<double>(file, name, "/VTKHDF/FieldData/time_s");
  s.pick = read_one<std::int32_t>(file, name, "/VTKHDF/FieldData/picks");
  s.cell_width = read_one<double>(file, name, "/VTKHDF/FieldData/cell_width_m");
  s.cell_length = read_one<double>(file, name, "/VTKHDF/FieldData/cell_length_m");
  s.x_min = read_one<double>(file, name, "/VTKHDF/FieldData/x_min_m");
  s.x_max = read_one<double>(file, name, "/VTKHDF/FieldData/x_max_m");
  const char* const length_on_loom = "/VTKHDF/FieldData/length_on_loom_m";
  if (file.has(length_on_loom)) s.length_on_loom = read_one<double>(file, name, length_on_loom);
  const char* const along_axis = "/VTKHDF/FieldData/along_axis";
  s.along_axis = file.has(along_axis) && read_one<std::uint8_t>(file, name, along_axis) != 0;

  s.offset = file.read<std::int64_t>("/VTKHDF/Offsets");
  s.yarn = file.read<std::int32_t>("/VTKHDF/CellData/yarn");
  s.fiber = file.read<std::int32_t>("/VTKHDF/CellData/fiber");
  s.weft = file.read<std::uint8_t>("/VTKHDF/CellData/weft");
  s.radius = file.read<double>("/VTKHDF/CellData/radius");
  s.area = file.read<double>("/VTKHDF/CellData/area");
  s.tension = file.read<double>("/VTKHDF/PointData/tension_N");
  s.arc = file.read<double>("/VTKHDF/PointData/arc_m");

  s.x = read_points(file, name, "/VTKHDF/Points");
  if (!file.has("/beyond/offset")) return s;
  s.beyond.length = read_one<double>(file, name, "/beyond/length_m");
  s.beyond.offset = file.read<std::int64_t>("/beyond/offset");
  s.beyond.x = read_points(file, name, "/beyond/points_m");
  s.beyond.tension = file.read<double>("/beyond/tension_N");
  s.beyond.arc = file.read<double>("/beyond/arc_m");
  return s;
}

}  // namespace

void write_results_into(Hdf5File& out, const std::filesystem::path& name, const ResultsFile& results) {
  check(name, results.snapshot);
  write_snapshot(out, results.snapshot);
  if (!results.history.time_s.empty() || !results.history.beat_time_s.empty()) write_history(out, results.history);
  out.write_text("/meta/format", format_name);
  out.write_text("/meta/case_toml", results.case_toml);
  out.write_text("/meta/version", results.version);
}

void write_results(const std::filesystem::path& file, const ResultsFile& results) {
  Hdf5File out = Hdf5File::create(file);
  write_results_into(out, file, results);
  out.commit();
}

ResultsFile read_results(const std::filesystem::path& file) {
  const Hdf5File in = Hdf5File::open(file);
  if (!in.has("/meta/format") || in.read_text("/meta/format") != format_name)
    throw std::runtime_error(file.string() + ": not a results file (/meta/format is not \"" + format_name + "\")");
  ResultsFile results;
  results.snapshot = read_snapshot(in, file);
  check(file, results.snapshot);
  if (in.has("/history/time_s")) results.history = read_history(in);
  results.case_toml = in.read_text("/meta/case_toml");
  results.version = in.read_text("/meta/version");
  return results;
}

void write_series(const std::filesystem::path& file, const std::vector<std::string>& names, const std::vector<double>& times) {
  if (names.size() != times.size())
    throw std::runtime_error(file.string() + ": " + std::to_string(names.size()) + " names but " + std::to_string(times.size()) + " times");
  nlohmann::ordered_json files = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < names.size(); ++i) files.push_back({{"name", names[i]}, {"time", times[i]}});
  write_text_file(file, nlohmann::ordered_json{{"file-series-version", "1.0"}, {"files", files}}.dump(2) + "\n");
}

void write_text_file(const std::filesystem::path& file, const std::string& text) {
  try {
    errno = 0;
    std::ofstream out(part_of(file), std::ios::binary | std::ios::trunc);
    out << text;
    out.close();
    if (!out)
      throw std::runtime_error(file.string() + ": cannot write " + part_of(file).string() +
                               (errno == 0 ? "" : ": " + std::generic_category().message(errno)));
    replace_by_part(file);
  } catch (...) {
    std::error_code ignored;
    std::filesystem::remove(part_of(file), ignored);
    throw;
  }
}

}  // namespace weave
