#include "history_file.hpp"

#include <array>
#include <string>
#include <utility>

namespace weave {
namespace {

using DoubleColumn = std::vector<double> History::*;
constexpr std::array<std::pair<const char*, DoubleColumn>, 21> double_columns = {{
    {"time_s", &History::time_s},
    {"reed_x_m", &History::reed_x_m},
    {"reed_load_N", &History::reed_load_N},
    {"warp_tension_N", &History::warp_tension_N},
    {"overlap", &History::overlap},
    {"time_step_s", &History::time_step_s},
    {"kinetic_J", &History::kinetic_J},
    {"bars_J", &History::bars_J},
    {"contact_J", &History::contact_J},
    {"friction_store_J", &History::friction_store_J},
    {"heddle_J", &History::heddle_J},
    {"slip_J", &History::slip_J},
    {"damping_J", &History::damping_J},
    {"work_tension_J", &History::work_tension_J},
    {"work_reed_J", &History::work_reed_J},
    {"work_heddle_J", &History::work_heddle_J},
    {"work_take_up_J", &History::work_take_up_J},
    {"work_insertion_J", &History::work_insertion_J},
    {"residual_J", &History::residual_J},
    {"reed_load_per_beat_N", &History::reed_load_per_beat_N},
    {"beat_time_s", &History::beat_time_s},
}};

using IntColumn = std::vector<int> History::*;
constexpr std::array<std::pair<const char*, IntColumn>, 2> int_columns = {{
    {"pick", &History::pick},
    {"action", &History::action},
}};

}  // namespace

void write_history(Hdf5File& file, const History& history) {
  for (const auto& [name, column] : double_columns) file.write(std::string("/history/") + name, history.*column);
  for (const auto& [name, column] : int_columns) file.write(std::string("/history/") + name, history.*column);
  std::string names;
  for (const std::string& name : History::action_names) names += name + "\n";
  file.write_text("/history/action_names", names);
}

History read_history(const Hdf5File& file) {
  History history;
  for (const auto& [name, column] : double_columns) history.*column = file.read<double>(std::string("/history/") + name);
  for (const auto& [name, column] : int_columns) history.*column = file.read<std::int32_t>(std::string("/history/") + name);
  return history;
}

}  // namespace weave
