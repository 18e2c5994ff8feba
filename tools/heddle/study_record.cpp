#include "heddle/study_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <deque>
#include <fstream>
#include <sstream>

#include "heddle/json_file.hpp"
#include "weave/results.hpp"

namespace heddle {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using std::filesystem::path;

constexpr std::array<const char*, 5> state_names = {"waiting", "running", "finished", "failed", "interrupted"};
constexpr const char* heading_mark = "=== attempt ";

}  // namespace

const char* name_of(RunState state) {
  return state_names[static_cast<std::size_t>(state)];
}

path run_folder(const path& output, const StudyRun& run) {
  return output / "runs" / run.name;
}

ordered_json run_inputs(const Study& study, const StudyRun& run) {
  ordered_json options = ordered_json::object();
  for (const Assignment& a : run.changes) {
    const std::string table = a.key.substr(0, a.key.find('.'));
    if (std::find(stage_names().begin(), stage_names().end(), table) != stage_names().end()) options[a.key] = a.value;
  }
  return {{"case", weave::to_toml(run.spec)}, {"until", study.until}, {"options", options}};
}

RunRecord read_record(const Study& study, const StudyRun& run, const path& output) {
  const ordered_json j = read_json(run_folder(output, run) / "run.json");
  RunRecord record;
  if (!j.is_object() || j.value("inputs", ordered_json()) != run_inputs(study, run)) return record;
  const auto state = std::find(state_names.begin(), state_names.end(), j.value("state", ""));
  if (state == state_names.end()) return record;
  record.state = static_cast<RunState>(state - state_names.begin());
  record.status = j.value("status", 0);
  record.message = j.value("message", "");
  record.wall = j.value("wall_s", 0.0);
  record.attempts = j.value("attempts", 0);
  record.threads = j.value("threads", 0);
  record.version = j.value("version", "");
  return record;
}

void write_record(const Study& study, const StudyRun& run, const path& output, const RunRecord& record) {
  const ordered_json j = {{"name", run.name},          {"state", name_of(record.state)}, {"status", record.status},
                          {"message", record.message}, {"wall_s", record.wall},          {"attempts", record.attempts},
                          {"threads", record.threads}, {"version", record.version},      {"inputs", run_inputs(study, run)}};
  std::filesystem::create_directories(run_folder(output, run));
  weave::write_text_file(run_folder(output, run) / "run.json", j.dump(2) + "\n");
}

std::string attempt_heading(int attempt, const std::string& command) {
  return fmt::format("{}{}: {}\n", heading_mark, attempt, command);
}

std::string last_lines(const path& log, std::size_t count) {
  std::ifstream in(log);
  std::deque<std::string> lines;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind(heading_mark, 0) == 0) {
      lines.clear();
    } else if (line.find_first_not_of(" \t\r") != std::string::npos) {
      lines.push_back(line.substr(line.rfind('\r') == std::string::npos ? 0 : line.rfind('\r') + 1));
      if (lines.size() > count) lines.pop_front();
    }
  }
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "\n") + line;
  return text;
}

json figure_of(const StudyRun& run, const path& output, const std::string& key) {
  std::istringstream parts(key);
  std::string part;
  std::getline(parts, part, '.');
  json value = read_json(run_folder(output, run) / part / "summary.json");
  while (std::getline(parts, part, '.')) {
    if (value.is_object() && value.contains(part)) {
      value = json(value[part]);
      continue;
    }
    if (!value.is_array() || value.empty()) return {};
    std::size_t index = value.size() - 1;
    if (part != "last") {
      const auto [end, status] = std::from_chars(part.data(), part.data() + part.size(), index);
      if (status != std::errc() || end != part.data() + part.size() || index >= value.size()) return {};
    }
    value = json(value[index]);
  }
  return value.is_primitive() ? value : json();
}

}  // namespace heddle
