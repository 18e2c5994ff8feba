#include "relax/homogenize.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <Eigen/LU>
#include <cerrno>
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

/// Macroscopic strains for unit forces on the load cases' components (columns) [1/N], from CalculiX' .dat file: for each case a line of
/// displacements of the node of normal strains, then one of that of the shears.
Matrix6 strains(const std::filesystem::path& file, const std::vector<int>& cases, const std::filesystem::path& log) {
  std::ifstream stream(file);
  Matrix6 result = Matrix6::Zero();
  std::size_t found = 0;  // nodes
  std::string line;
  while (found < 2 * cases.size() && std::getline(stream, line)) {
    if (line.find("displacements") == std::string::npos || line.find("for set STRAIN_") == std::string::npos) continue;
    const Eigen::Index first = line.find("for set STRAIN_SHEAR") == std::string::npos ? 0 : 3;
    while (std::getline(stream, line) && line.find_first_not_of(" \t\r") == std::string::npos) {
    }
    std::istringstream values(line);
    std::size_t node = 0;
    Vec3 displacement;
    if (!(values >> node >> displacement[0] >> displacement[1] >> displacement[2]) || !displacement.allFinite()) break;
    result.block<3, 1>(first, cases[found / 2]) = displacement;
    ++found;
  }
  if (found < 2 * cases.size()) {
    throw std::runtime_error(file.string() + ": has the strains of " + std::to_string(found / 2) + " of " + std::to_string(cases.size()) +
                             " load cases; " + log.string() + " says why CalculiX did not finish");
  }
  return result;
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
  weave::write_text_file(folder / (name + ".inp"), deck(mesh, sets, constituents, bins,
                                                        {DeckProgram::calculix, DeckLoads::green, options.periodic_z, options.title}));
  std::filesystem::remove(data);
  const auto start = std::chrono::steady_clock::now();
  const int status = run_in(folder, program, name, log.filename().string());
  if (status != 0) throw std::runtime_error(program.string() + ": ended with status " + std::to_string(status) + "; see " + log.string());

  Homogenization result;
  result.solve_wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  result.bin_width = bins.width;
  result.capped = bins.capped;
  result.bounds = stiffness_bounds(mesh, constituents, bins);
  result.laminate = laminate_stiffness(mesh, constituents);
  const std::vector<int> cases = load_cases(options.periodic_z);
  constexpr double cubic_mm = 1e-9, mega_pascal = 1e6;
  const double volume = (mesh.high - mesh.low).prod() / cubic_mm;
  const Matrix6 raw = strains(data, cases, log) * volume / mega_pascal;  // a force of 1 N is a stress of 1/volume MPa
  const Matrix6 compliance = 0.5 * (raw + raw.transpose());
  result.asymmetry = 0.5 * (raw - raw.transpose()).cwiseAbs().maxCoeff() / raw.cwiseAbs().maxCoeff();
  if (options.periodic_z) {
    result.stiffness = compliance.inverse();
  } else {
    result.stiffness(cases, cases) = Eigen::Matrix3d(compliance(cases, cases)).inverse();
  }
  return result;
}

}  // namespace relax
