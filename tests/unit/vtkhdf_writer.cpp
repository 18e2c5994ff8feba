// Writes a small results file that vtkhdf_test.py knows: heddle_vtkhdf_writer FILE
#include <array>

#include "weave/results.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  weave::ResultsFile results;
  weave::Snapshot& s = results.snapshot;
  s.time = 0.125;
  s.pick = 2;
  s.cell_width = 0.004;
  s.x_min = -0.01;
  s.offset = {0};
  const std::array<int, 3> nodes = {4, 2, 5};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < nodes[static_cast<std::size_t>(i)]; ++j) {
      s.x.emplace_back(i, j, 0.1 * i * j);
      s.tension.push_back(0.5 * i + j);
      s.arc.push_back(1.5 * j);
    }
    s.offset.push_back(static_cast<std::int64_t>(s.x.size()));
    s.yarn.push_back(10 + i);
    s.fiber.push_back(i % 2);
    s.weft.push_back(i == 2 ? 1 : 0);
    s.radius.push_back(1e-4 * (i + 1));
    s.area.push_back(1e-8 * (i + 1));
  }
  results.history.time_s = {0.1, 0.125};
  results.case_toml = "name = \"writer\"\n";
  results.version = "test";
  weave::write_results(argv[1], results);
}
