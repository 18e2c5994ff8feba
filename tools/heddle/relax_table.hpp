#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "relax/compare.hpp"
#include "relax/series.hpp"

namespace heddle {

/// One of several relaxed cells of a table.
struct RelaxedColumn {
  double value = 0;  ///< what it differs by from the others: fibers a yarn, pressure
  relax::ComparedState state;
  double wall = 0;  ///< [s]
};

/// Reads what `heddle relax` left in a folder. Throws std::runtime_error naming the file and what is wrong with it.
RelaxedColumn read_relaxed_column(const std::filesystem::path& folder, double value);

/// The values of each figure for endlessly many fibers, from columns that differ by these; empty for fewer than three columns.
std::map<std::string, relax::Extrapolation> extrapolate(const std::vector<RelaxedColumn>& columns);

/// Prints thickness, volume fraction, energy, crimp, yarn sizes and certificate, a column for each cell; `value_name` heads the first row.
void print_relaxed(const std::string& value_name, const std::vector<RelaxedColumn>& columns,
                   const std::map<std::string, relax::Extrapolation>& endless = {});

/// The same as a JSON list, an object for each cell, in which its value stands under `value_key`.
nlohmann::ordered_json json_of(const std::string& value_key, const std::vector<RelaxedColumn>& columns);

}  // namespace heddle
