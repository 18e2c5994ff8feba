#include "relax/homogenize.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "weave/results.hpp"

namespace relax {
namespace {

/// Runs `program -i name` in a folder, output and errors to a file there; returns the exit status, 128 + signal where one ended it.
int run_in(const std::filesystem::path& folder, const std::filesystem::path& program, const std::string& name, const std::string& log) {
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error(program.string() + ": cannot be started");
  if (child == 0) {
    if (::chdir(folder.c_str()) != 0) ::_exit(127);
    const int output = ::open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    if (output < 0 || ::dup2(output, STDOUT_FILENO) < 0 || ::dup2(output, STDERR_FILENO) < 0) ::_exit(127);
    ::execl(program.c_str(), program.c_str(), "-i", name.c_str(), static_cast<char*>(nullptr));
    ::_exit(127);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Sums of nodal forces on the high sides x, y, z (columns) per step [N], from CalculiX's .dat file.
std::vector<Eigen::Matrix3d> side_forces(const std::filesystem::path& file, std::size_t steps, const std::filesystem::path& log) {
  std::ifstream stream(file);
  std::vector<Eigen::Matrix3d> forces(steps, Eigen::Matrix3d::Zero());
  std::size_t found = 0;
  std::string line;
  while (found < 3 * steps && std::getline(stream, line)) {
    const std::size_t at = line.find("for set HIGH_");
    if (line.find("total force") == std::string::npos || at == std::string::npos) continue;
    const auto axis = static_cast<Eigen::Index>(line[at + 13] - 'X');
    while (std::getline(stream, line) && line.find_first_not_of(" \t\r") == std::string::npos) {
    }
    std::istringstream values(line);
    Eigen::Vector3d force;
    if (!(values >> force[0] >> force[1] >> force[2]) || !force.allFinite()) break;
    forces[found / 3].col(axis) = force;
    ++found;
  }
  if (found < 3 * steps) {
    throw std::runtime_error(file.string() + ": has the forces of " + std::to_string(found / 3) + " of " + std::to_string(steps) +
                             " load cases; " + log.string() + " says why CalculiX did not finish");
  }
  return forces;
}

}  // namespace

std::filesystem::path find_ccx(const std::string& ccx) {
  std::vector<std::filesystem::path> candidates;
  if (ccx.find('/') != std::string::npos) {
    candidates.emplace_back(std::filesystem::absolute(ccx));
  } else {
    const char* path = std::getenv("PATH");
    std::istringstream folders(path != nullptr ? path : "");
    for (std::string folder; std::getline(folders, folder, ':');) candidates.push_back(std::filesystem::absolute(folder) / ccx);
  }
  for (const std::filesystem::path& candidate : candidates)
    if (std::filesystem::is_regular_file(candidate) && ::access(candidate.c_str(), X_OK) == 0) return candidate;
  throw std::runtime_error(ccx + ": CalculiX is not there; install it (Debian: calculix-ccx), or name the program with --ccx");
}

Homogenization homogenize(const VolumeMesh& mesh, const Constituents& constituents, const HomogenizeOptions& options,
                          const std::filesystem::path& folder, const std::string& name) {
  const std::filesystem::path program = find_ccx(options.ccx);
  const PeriodicSets sets = periodic_sets(mesh, options.periodic_z);
  const MaterialBins bins = bin_materials(mesh, constituents, options.bins);
  const std::filesystem::path data = folder / (name + ".dat"), log = folder / (name + ".log");
  weave::write_text_file(folder / (name + ".inp"),
                         deck(mesh, sets, constituents, bins, {DeckProgram::calculix, options.solver, options.periodic_z, options.title}));
  std::filesystem::remove(data);
  const auto start = std::chrono::steady_clock::now();
  const int status = run_in(folder, program, name, log.filename().string());
  if (status != 0) throw std::runtime_error(program.string() + ": ended with status " + std::to_string(status) + "; see " + log.string());

  Homogenization result;
  result.solve_wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.bin_width = bins.width;
  result.capped = bins.capped;
  result.bounds = stiffness_bounds(mesh, constituents, bins);
  const std::vector<int> cases = load_cases(options.periodic_z);
  const std::vector<Eigen::Matrix3d> forces = side_forces(data, cases.size(), log);
  constexpr std::array<std::array<Eigen::Index, 2>, 6> pair = {{{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};
  constexpr double square_mm = 1e-6;
  const Vec3 size = mesh.high - mesh.low;
  const Vec3 areas = Vec3(size.y() * size.z(), size.x() * size.z(), size.x() * size.y()) / square_mm;
  Matrix6 c = Matrix6::Zero();
  for (std::size_t s = 0; s < cases.size(); ++s) {
    const Eigen::Matrix3d stress = forces[s] * areas.cwiseInverse().asDiagonal() / square_mm;
    for (const int row : cases) {
      const auto [i, j] = pair[static_cast<std::size_t>(row)];
      c(row, cases[s]) = 0.5 * (stress(i, j) + stress(j, i));
    }
  }
  result.stiffness = 0.5 * (c + c.transpose());
  result.asymmetry = 0.5 * (c - c.transpose()).cwiseAbs().maxCoeff() / c.cwiseAbs().maxCoeff();
  return result;
}

}  // namespace relax
