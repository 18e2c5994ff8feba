#pragma once
#include "hdf5_file.hpp"
#include "weave/history.hpp"

namespace weave {

/// Every column of a history as a data set under /history, by its name.
void write_history(Hdf5File& file, const History& history);
History read_history(const Hdf5File& file);

}  // namespace weave
