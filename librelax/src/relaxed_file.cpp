#include "relax/relaxed_file.hpp"

#include <array>
#include <limits>
#include <stdexcept>

#include "cell_file.hpp"
#include "relax/report.hpp"
#include "results_file.hpp"

namespace relax {
namespace {

const std::string refinement_path = "/run/refinement";  ///< older checkpoints lack it
const std::string start_path = "/start";                ///< and older results this

/// Pointers to the numbers of a state, const or not, in the order of the file.
auto numbers_of(auto& s) {
  auto& w = s.stages;
  auto& f = s.first_order;
  return std::array{&s.reference_tension,
                    &s.tolerance,
                    &f.time_step,
                    &f.mixing,
                    &f.descent.gradient_least,
                    &f.descent.energy_least,
                    &s.damping,
                    &s.descent.gradient_least,
                    &s.descent.energy_least,
                    &s.wall,
                    &w.search,
                    &w.assembly,
                    &w.first_order_metric,
                    &w.analysis,
                    &w.factorization,
                    &w.solution};
}

/// And to its counters.
auto counters_of(auto& s) {
  auto& f = s.first_order;
  return std::array{&s.steps_left,        &s.iterations_left,   &f.step,     &f.downhill,
                    &f.descent.fruitless, &s.descent.fruitless, &s.analyses, &s.factorizations};
}

/// And to its flags.
auto flags_of(auto& s) {
  return std::array{&s.newton, &s.lengths_free};
}

/// Calls f with the name and the vector of each of its vectors.
void each_vector(auto& s, auto&& f) {
  f("q", s.q);
  f("velocity", s.first_order.velocity);
  f("first_order_list_at", s.first_order.list_at);
  f("list_at", s.list_at);
  f("pattern_at", s.pattern_at);
}

template <class Call>
auto naming(const std::filesystem::path& file, Call&& call) {
  try {
    return call();
  } catch (const std::exception& e) {
    const std::string what = e.what();
    throw std::runtime_error(what.starts_with(file.string()) ? what : file.string() + ": " + what);
  }
}

void expect_size(const char* name, const Eigen::VectorXd& v, Eigen::Index size) {
  if (v.size() != size)
    throw std::runtime_error(std::string(name) + " has " + std::to_string(v.size()) + " values, must have " + std::to_string(size));
}

}  // namespace

void write_relaxed(const std::filesystem::path& file, const RelaxedFile& relaxed) {
  weave::Hdf5File out = weave::Hdf5File::create(file);
  weave::write_results_into(out, file, {snapshot_of(relaxed.cell, relaxed.q), {}, relaxed.case_toml, relaxed.version});
  write_cell(out, relaxed.cell);
  write_unknowns(out, "/cell/unknowns_m", relaxed.q);
  write_history(out, relaxed.history);
  out.write_text("/meta/options", relaxed.options);
  if (relaxed.blocked_by) out.write_text("/meta/blocked_by", *relaxed.blocked_by);
  if (relaxed.start.size() > 0) write_unknowns(out, start_path, relaxed.start);
  out.commit();
}

bool is_relaxed(const std::filesystem::path& file) {
  return weave::Hdf5File::open(file).has("/cell/unknowns_m");
}

RelaxedFile read_relaxed(const std::filesystem::path& file) {
  return naming(file, [&] {
    const weave::Hdf5File in = weave::Hdf5File::open(file);
    if (!in.has("/cell/unknowns_m")) throw std::runtime_error("is not of a relaxed cell (/cell/unknowns_m is missing)");
    RelaxedFile relaxed;
    relaxed.cell = read_cell(in);
    relaxed.q = read_unknowns(in, "/cell/unknowns_m");
    expect_size("/cell/unknowns_m", relaxed.q, Unknowns(relaxed.cell).size);
    relaxed.history = read_history(in);
    relaxed.case_toml = in.read_text("/meta/case_toml");
    relaxed.options = in.read_text("/meta/options");
    relaxed.version = in.read_text("/meta/version");
    if (in.has("/meta/blocked_by")) relaxed.blocked_by = in.read_text("/meta/blocked_by");
    if (in.has(start_path)) relaxed.start = read_unknowns(in, start_path);
    return relaxed;
  });
}

void write_checkpoint(const std::filesystem::path& file, const Checkpoint& c) {
  weave::Hdf5File out = weave::Hdf5File::create(file);
  out.write_text("/case", c.case_toml);
  out.write_text("/options", c.options);
  write_unknowns(out, start_path, c.start);
  out.write("/run/wall_s", std::vector<double>{c.wall});
  out.write("/run/refined", std::vector<std::uint8_t>{c.refined});
  out.write(refinement_path, std::vector<double>{c.refinement.area_ratio, static_cast<double>(c.refinement.order_violations)});
  write_cell(out, c.cell);
  write_unknowns(out, "/cell_start", c.cell_start);
  const MinimizeState& s = c.state;
  std::vector<double> numbers;
  for (const double* n : numbers_of(s)) numbers.push_back(*n);
  out.write("/state/numbers", numbers);
  std::vector<std::int32_t> counters;
  for (const int* n : counters_of(s)) counters.push_back(*n);
  out.write("/state/counters", counters);
  std::vector<std::uint8_t> flags;
  for (const bool* b : flags_of(s)) flags.push_back(*b);
  out.write("/state/flags", flags);
  each_vector(s, [&](const char* name, const Eigen::VectorXd& v) { write_unknowns(out, std::string("/state/") + name, v); });
  write_history(out, s.history);
  out.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& file) {
  return naming(file, [&] {
    const weave::Hdf5File in = weave::Hdf5File::open(file);
    Checkpoint c;
    c.case_toml = in.read_text("/case");
    c.options = in.read_text("/options");
    c.start = read_unknowns(in, start_path);
    c.wall = in.read<double>("/run/wall_s").at(0);
    c.refined = in.read<std::uint8_t>("/run/refined").at(0) != 0;
    if (in.has(refinement_path)) {
      const auto check = in.read<double>(refinement_path);
      c.refinement.area_ratio = check.at(0);
      c.refinement.order_violations = static_cast<int>(check.at(1));
    } else {
      c.refinement.area_ratio = std::numeric_limits<double>::quiet_NaN();
    }
    c.cell = read_cell(in);
    c.cell_start = read_unknowns(in, "/cell_start");
    MinimizeState& s = c.state;
    const auto numbers = in.read<double>("/state/numbers");
    for (std::size_t i = 0; double* n : numbers_of(s)) *n = numbers.at(i++);
    const auto counters = in.read<std::int32_t>("/state/counters");
    for (std::size_t i = 0; int* n : counters_of(s)) *n = counters.at(i++);
    const auto flags = in.read<std::uint8_t>("/state/flags");
    if (flags.size() != flags_of(s).size()) throw std::runtime_error("a checkpoint of another version of Heddle: relax the cell anew");
    for (std::size_t i = 0; bool* b : flags_of(s)) *b = flags.at(i++) != 0;
    each_vector(s, [&](const char* name, Eigen::VectorXd& v) { v = read_unknowns(in, std::string("/state/") + name); });
    s.history = read_history(in);
    expect_size("/cell_start", c.cell_start, Unknowns(c.cell).size);
    expect_size("/state/q", s.q, Unknowns(c.cell).size);
    return c;
  });
}

}  // namespace relax
