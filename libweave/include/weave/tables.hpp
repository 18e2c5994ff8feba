#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace weave {

/// Columns of numbers of one length, each with a name that ends in its unit.
struct Table {
  std::string name;
  std::vector<std::pair<std::string, std::vector<double>>> columns;
};

/// As comma-separated values, a line of names first; a number's shortest text that reads back as itself. Throws std::invalid_argument if
/// the columns differ in length.
std::string to_csv(const Table& table);

/// Writes tables into an HDF5 file, column by column, as /TABLE/COLUMN. Aside first, then renamed. Throws std::runtime_error naming file
/// and cause.
void write_tables(const std::filesystem::path& file, const std::vector<Table>& tables);

}  // namespace weave
