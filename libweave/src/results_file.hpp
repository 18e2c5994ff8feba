#pragma once
#include "hdf5_file.hpp"
#include "weave/results.hpp"

namespace weave {

/// Writes all that a results file holds into a file that may hold more; `name` is for messages. Throws std::runtime_error.
void write_results_into(Hdf5File& file, const std::filesystem::path& name, const ResultsFile& results);

}  // namespace weave
