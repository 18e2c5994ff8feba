#include "heddle/study_cloths.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "heddle/json_file.hpp"
#include "heddle/study_record.hpp"
#include "weave/version.hpp"

namespace heddle {
namespace {

using nlohmann::ordered_json;
using std::filesystem::path;

/// What is known about the cloth of a run woven to its end; null: there is none.
ordered_json woven(const path& run) {
  ordered_json stage = read_json(run / "weave" / "stage.json");
  return stage.is_object() && stage.value("finished", false) ? stage : ordered_json();
}

/// Folders of runs in a study's folder, or the folder itself.
std::vector<path> runs_in(const path& folder) {
  std::vector<path> runs = {folder};
  if (!std::filesystem::is_directory(folder / "runs")) return runs;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "runs")) runs.push_back(entry.path());
  return runs;
}

}  // namespace

const RunTask* twin_of(const RunTask& task, const std::vector<RunTask>& tasks) {
  for (const RunTask& other : tasks) {
    if (&other == &task) return nullptr;
    if (other.cloth == task.cloth) return &other;
  }
  return nullptr;
}

void copy_weave(const path& from, const path& to) {
  if (std::filesystem::exists(to / "weave") || woven(from).is_null()) return;
  std::filesystem::remove_all(to / "weave.part");
  std::filesystem::create_directories(to);
  std::filesystem::copy(from / "weave", to / "weave.part", std::filesystem::copy_options::recursive);
  std::filesystem::rename(to / "weave.part", to / "weave");
}

std::size_t take_over_cloths(const std::vector<RunTask>& tasks, const std::vector<path>& folders, const path& output) {
  std::map<std::string, path> cloths;
  for (const path& folder : folders) {
    for (const path& run : runs_in(folder)) {
      const ordered_json stage = woven(run);
      const ordered_json inputs = stage.is_null() ? ordered_json() : stage.value("inputs", ordered_json());
      if (inputs.is_object() && inputs.value("version", "") == weave::version()) cloths.emplace(inputs.value("case", ""), run);
    }
  }
  std::size_t taken = 0;
  for (const RunTask& task : tasks) {
    const auto cloth = cloths.find(task.cloth);
    const path to = run_folder(output, *task.run);
    if (cloth == cloths.end() || std::filesystem::exists(to / "weave")) continue;
    copy_weave(cloth->second, to);
    ++taken;
  }
  return taken;
}

}  // namespace heddle
