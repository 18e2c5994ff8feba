#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

struct StudyOptions {
  std::filesystem::path study_file;
  std::filesystem::path output;              ///< default ./results/NAME
  std::string engine = "local";              ///< "local" or "slurm"
  int jobs = 0;                              ///< processes at a time; 0: from cores and memory
  int threads = 0;                           ///< of each; 0: from cores and jobs
  std::string only;                          ///< name of a single run; empty: all, with tables and pictures
  std::vector<std::filesystem::path> reuse;  ///< folders of studies and runs whose cloths need not be woven again
  bool list = false;                         ///< say what would be run
  bool retry = false;                        ///< run those again that failed before
  bool quiet = false;
  std::vector<std::string> sbatch;  ///< further options of sbatch
  std::filesystem::path program;    ///< in the place of this program for the runs; empty: this one
  double poll = 10;                 ///< between two questions to Slurm [s]
};

/// Runs a study: what is not yet finished of it, then tables, pictures and a page in the output folder. Returns the exit status: 0 all runs
/// finished, 1 some did not, 130 stopped by a signal. Throws what read_study throws, and std::runtime_error where memory, disk or Slurm are
/// missing, before any run starts.
int study_command(const StudyOptions& options);

/// How many processes of how many threads suit a machine.
struct Shares {
  int jobs = 1, threads = 1;
};

/// Weaving gains less from threads than from processes side by side, so that processes come first. jobs, threads: 0 where they are free.
/// memory: of the runs, descending [bytes]; as many run at a time as fit into `available`.
Shares share_machine(int jobs, int threads, int cores, const std::vector<double>& memory, double available);

}  // namespace heddle
