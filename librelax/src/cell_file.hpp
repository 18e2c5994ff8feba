#pragma once
#include "hdf5_file.hpp"
#include "relax/minimize.hpp"

namespace relax {

/// A cell as data sets under /cell: all of it but what follows from the rest.
void write_cell(weave::Hdf5File& file, const Cell& cell);
Cell read_cell(const weave::Hdf5File& file);

/// Each column of a minimization's history as a data set under /history, by its name.
void write_history(weave::Hdf5File& file, const std::vector<MinimizeProgress>& history);
std::vector<MinimizeProgress> read_history(const weave::Hdf5File& file);

void write_unknowns(weave::Hdf5File& file, const std::string& path, const Eigen::VectorXd& q);
Eigen::VectorXd read_unknowns(const weave::Hdf5File& file, const std::string& path);

}  // namespace relax
