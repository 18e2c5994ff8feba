#include <gmock/gmock.h>
#include <omp.h>

#include <cmath>
#include <filesystem>

#include "cell_file.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"
#include "scenes/temporary.hpp"
#include "weave/results.hpp"

namespace {

using namespace scenes;

/// A cell whose minimization passes through both phases, and through the first-order one more than once.
PosedCell small_cell() {
  return plain_weave_cell({.fibers = 3, .pitch = 7e-4}, 0.5, 2);
}

/// The same with its length along x free.
PosedCell loaded_cell() {
  PosedCell p = small_cell();
  p.cell.load_x = 0.95;  // of the warps' 1 N
  return p;
}

class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& name) : path_(temporary(name)) {}
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

void expect_same_bits(const relax::MinimizeResult& a, const relax::MinimizeResult& b) {
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.certificate.converged, b.certificate.converged);
  EXPECT_EQ(a.certificate.newton_step_max, b.certificate.newton_step_max);
  EXPECT_EQ(a.energy.sum(), b.energy.sum());
  EXPECT_EQ(a.factorizations, b.factorizations);
  ASSERT_EQ(a.history.size(), b.history.size());
  for (std::size_t i = 0; i < a.history.size(); ++i) {
    EXPECT_EQ(a.history[i].energy, b.history[i].energy);
    EXPECT_EQ(a.history[i].gradient_max, b.history[i].gradient_max);
  }
}

void check_restarts(const PosedCell& p, relax::MinimizeOptions options = {}) {
  const Eigen::VectorXd q = p.unknowns();
  const relax::MinimizeResult straight = relax::minimize(p.cell, q, options);
  ASSERT_TRUE(straight.certificate.converged) << straight.certificate.blocked_by;
  const auto length = static_cast<int>(straight.history.size());
  const TemporaryFile file("relax_checkpoint.h5");
  // The first-order phase asks whether to stop every ten steps.
  const bool dynamic = options.method == relax::MinimizeMethod::dynamic;
  for (const int stop : {0, 7, length / 2, length - (dynamic ? 24 : 4), length - (dynamic ? 12 : 1)}) {
    SCOPED_TRACE(stop);
    options.stop_at_iteration = stop;
    const relax::MinimizeResult stopped = relax::minimize(p.cell, q, options);
    ASSERT_TRUE(stopped.interrupted);
    EXPECT_FALSE(stopped.certificate.converged);
    relax::write_checkpoint(file.path(),
                            {"case", "options", q, true, p.cell, q, stopped.state, 1.5, {.area_ratio = 0.99, .order_violations = 2}});
    const relax::Checkpoint c = relax::read_checkpoint(file.path());
    EXPECT_EQ(c.cell_start, q);
    EXPECT_EQ(c.wall, 1.5);
    EXPECT_EQ(c.refinement.area_ratio, 0.99);
    EXPECT_EQ(c.refinement.order_violations, 2);
    EXPECT_EQ(c.cell.load_x, p.cell.load_x);
    EXPECT_EQ(c.cell.load_y, p.cell.load_y);
    options.stop_at_iteration = -1;
    expect_same_bits(relax::resume(c.cell, c.state, options), straight);
  }
}

TEST(relax_restart, same_bits_after_a_checkpoint_at_any_iteration) {
  check_restarts(small_cell());
}

TEST(relax_restart, same_bits_by_either_method_alone) {
  for (const auto method : {relax::MinimizeMethod::dynamic, relax::MinimizeMethod::newton}) {
    SCOPED_TRACE(static_cast<int>(method));
    relax::MinimizeOptions options;
    options.method = method;
    check_restarts(small_cell(), options);
  }
}

TEST(relax_restart, same_bits_where_the_cells_length_is_free) {
  check_restarts(loaded_cell());
}

TEST(relax_restart, checkpoints_on_the_way_change_nothing) {
  const PosedCell p = small_cell();
  const relax::MinimizeResult straight = relax::minimize(p.cell, p.unknowns());
  relax::MinimizeOptions options;
  options.checkpoint_interval = 0;
  int written = 0;
  bool newton = false;
  options.on_checkpoint = [&](const relax::MinimizeState& state) {
    ++written;
    newton = newton || state.newton;
  };
  expect_same_bits(relax::minimize(p.cell, p.unknowns(), options), straight);
  EXPECT_GT(written, 5);
  EXPECT_TRUE(newton);
}

TEST(relax_restart, times_of_the_iterations_add_up_to_those_of_the_stages) {
  const PosedCell p = small_cell();
  const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns());
  double metric = 0, factorization = 0, solution = 0;
  for (const relax::MinimizeProgress& i : r.history) {
    EXPECT_GE(i.factorization, 0);
    EXPECT_GE(i.solution, 0);
    (i.first_order ? metric : factorization) += i.factorization;
    solution += i.solution;
  }
  // The last factor, of the certificate, and its solution belong to no iteration.
  EXPECT_GT(factorization, 0);
  EXPECT_LT(factorization, r.wall.factorization);
  EXPECT_GT(solution, 0);
  EXPECT_LT(solution, r.wall.solution);
  EXPECT_GT(metric, 0);
  EXPECT_LE(metric, r.wall.first_order_metric * (1 + 1e-9));
}

TEST(relax_restart, reads_a_history_without_the_times_of_its_iterations) {
  const TemporaryFile path("relax_history.h5");
  weave::Hdf5File file = weave::Hdf5File::create(path.path());
  for (const char* column : {"iteration", "energy_J", "gradient_max", "step_max_m", "shift_N_per_m", "first_order", "convex", "touching"})
    file.write(std::string("/history/") + column, std::vector<double>{1, 1});
  file.write("/history/wall_s", std::vector<double>{3, 4});
  file.commit();
  const auto history = relax::read_history(weave::Hdf5File::open(path.path()));
  ASSERT_EQ(history.size(), 2U);
  EXPECT_TRUE(history[1].first_order);
  EXPECT_EQ(history[1].wall, 4);
  EXPECT_TRUE(std::isnan(history[1].factorization));
  EXPECT_TRUE(std::isnan(history[1].solution));
}

TEST(relax_restart, refuses_a_state_of_another_cell) {
  const PosedCell p = small_cell(), other = plain_weave_cell({.fibers = 1, .pitch = 4e-4}, 0.2, 2);
  relax::MinimizeOptions options;
  options.stop_at_iteration = 3;
  const relax::MinimizeResult stopped = relax::minimize(p.cell, p.unknowns(), options);
  EXPECT_THROW(relax::resume(other.cell, stopped.state), std::invalid_argument);
}

TEST(relax_restart, relaxed_file_holds_cell_and_history) {
  const PosedCell p = small_cell();
  relax::MinimizeOptions options;
  options.stop_at_iteration = 20;
  const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns(), options);
  const TemporaryFile file("relax.vtkhdf");
  relax::write_relaxed(file.path(), {p.cell, r.q, r.history, "the case", "the options", "the version", "a yarn is slack"});
  EXPECT_TRUE(relax::is_relaxed(file.path()));
  const relax::RelaxedFile back = relax::read_relaxed(file.path());
  EXPECT_EQ(back.q, r.q);
  EXPECT_EQ(back.cell.rest_length, p.cell.rest_length);
  EXPECT_EQ(back.cell.next, p.cell.next);
  EXPECT_EQ(back.cell.tension, p.cell.tension);
  EXPECT_EQ(back.options, "the options");
  EXPECT_EQ(back.blocked_by, "a yarn is slack");
  ASSERT_EQ(back.history.size(), r.history.size());
  EXPECT_EQ(back.history.back().energy, r.history.back().energy);
  EXPECT_EQ(back.history.back().first_order, r.history.back().first_order);
  const weave::ResultsFile plain = weave::read_results(file.path());
  EXPECT_EQ(plain.snapshot.x, relax::snapshot_of(p.cell, r.q).x);
  EXPECT_TRUE(plain.history.time_s.empty());
  weave::write_results(file.path(), plain);
  EXPECT_FALSE(relax::is_relaxed(file.path()));
  try {
    relax::read_relaxed(file.path());
    ADD_FAILURE() << "read a file without a cell";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr(file.path().string()));
  }
}

TEST(relax_restart, same_bits_for_any_number_of_threads) {
  const PosedCell p = small_cell();
  const int threads = omp_get_max_threads();
  omp_set_num_threads(1);
  const relax::MinimizeResult one = relax::minimize(p.cell, p.unknowns());
  omp_set_num_threads(2);
  const relax::MinimizeResult two = relax::minimize(p.cell, p.unknowns());
  omp_set_num_threads(threads);
  expect_same_bits(one, two);
}

}  // namespace
