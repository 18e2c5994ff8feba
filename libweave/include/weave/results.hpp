#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "weave/history.hpp"
#include "weave/snapshot.hpp"

namespace weave {

/// A results file: HDF5 with the fibers as VTKHDF poly-lines (UnstructuredGrid of VTK_POLY_LINE cells, readable by ParaView 5.11
/// without a plug-in), the history under /history, and text under /meta.
struct ResultsFile {
  Snapshot snapshot;
  History history;        ///< of weaving; empty where the file holds none
  std::string case_toml;  ///< resolved case
  std::string version;    ///< program version and source revision
};

/// Writes aside and renames, so that `file` is either the old or the new one, whole. Throws std::runtime_error naming file and cause.
void write_results(const std::filesystem::path& file, const ResultsFile& results);

/// Throws std::runtime_error naming file and cause if it is not a results file.
ResultsFile read_results(const std::filesystem::path& file);

/// Writes ParaView's file series index (JSON, "file-series-version": "1.0") naming the files with their times.
void write_series(const std::filesystem::path& file, const std::vector<std::string>& names, const std::vector<double>& times);

/// Writes text aside and renames. Throws std::runtime_error naming file and cause; what was written aside is gone then.
void write_text_file(const std::filesystem::path& file, const std::string& text);

}  // namespace weave
