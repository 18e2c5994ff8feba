#include "weave/tables.hpp"

#include <fmt/format.h>

#include <iterator>
#include <stdexcept>

#include "hdf5_file.hpp"

namespace weave {

std::string to_csv(const Table& table) {
  std::string text;
  const std::size_t rows = table.columns.empty() ? 0 : table.columns.front().second.size();
  for (const auto& [name, values] : table.columns) {
    if (values.size() != rows)
      throw std::invalid_argument(fmt::format("table {}: column {} has {} rows, must have {}", table.name, name, values.size(), rows));
    text += (text.empty() ? "" : ",") + name;
  }
  text += "\n";
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < table.columns.size(); ++column)
      fmt::format_to(std::back_inserter(text), "{}{}", column == 0 ? "" : ",", table.columns[column].second[row]);
    text += "\n";
  }
  return text;
}

void write_tables(const std::filesystem::path& file, const std::vector<Table>& tables) {
  Hdf5File out = Hdf5File::create(file);
  for (const Table& table : tables)
    for (const auto& [name, values] : table.columns) out.write("/" + table.name + "/" + name, values);
  out.commit();
}

}  // namespace weave
