#include "heddle/study.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <tuple>

#include "heddle/summary_keys.hpp"
#include "toml_table.hpp"

namespace heddle {
namespace {

using std::filesystem::path;
using weave::Mistakes;
using weave::TableReader;

/// An assignment with its place in the file.
struct Entry {
  Assignment assignment;
  std::size_t line = 0;
  std::string shown_key, shown_value;  ///< for messages
};

/// A key of [vary] with the values that it takes.
struct Axis {
  std::string key;
  std::vector<Entry> values;
};

/// One combination of values before the case is read.
struct Combination {
  std::string name;  ///< empty: from its values
  std::vector<Entry> entries;
  std::size_t line = 0;
  std::string shown_key, shown_value;
};

/// A value as TOML on one line: numbers as short as they read back the same, lists not broken into lines as toml++ does.
std::string toml_text(const toml::node& node) {
  if (const toml::array* list = node.as_array()) {
    std::string text;
    for (const toml::node& entry : *list) text += (text.empty() ? "" : ", ") + toml_text(entry);
    return "[" + text + "]";
  }
  if (const auto word = node.value_exact<std::string>(); word && word->find_first_of("\"\\\n\r\t") == std::string::npos)
    return '"' + *word + '"';
  if (const auto number = node.value_exact<double>(); number && std::isfinite(*number)) return nlohmann::json(*number).dump();
  std::ostringstream stream;
  node.visit([&](const auto& value) { stream << value; });
  std::string text;
  for (const char c : stream.str()) {
    if (c != '\n' && (c != ' ' || text.empty() || text.back() != ' ')) text += c;
  }
  return text;
}

bool is_name(const std::string& text) {
  return !text.empty() && text.front() != '.' && text.size() <= 200 && std::all_of(text.begin(), text.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == '+';
  });
}

std::string last_part(const std::string& key) {
  return key.substr(key.rfind('.') + 1);
}

/// Text for a folder's name: what is neither letter nor digit becomes "_", a space before a unit goes.
std::string name_part(const std::string& text) {
  std::string name;
  for (const char c : text) {
    if (c == ' ') continue;
    name += std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '+' || c == '-' ? c : '_';
  }
  return name;
}

/// The last folder of a case's path, or its file's stem.
std::string case_label(const path& file) {
  const path clean = (file.filename() == "case.toml" ? file.parent_path() : file).lexically_normal();
  const path last = clean.filename().empty() ? clean.parent_path().filename() : clean.filename();
  return last.extension() == ".toml" ? last.stem().string() : last.string();
}

std::string shown(const std::string& key, const std::string& value) {
  return key == "case" ? case_label(plain_value(value)) : plain_value(value);
}

/// Leaves of a table with their dotted keys, in the order of the file.
void add_leaves(const toml::table& table, const std::string& prefix, const std::string& shown_prefix,
                std::vector<std::pair<std::string, const toml::node*>>& leaves, Mistakes& mistakes) {
  for (const auto& [key, node] : table) {
    const std::string full = (prefix.empty() ? "" : prefix + ".") + std::string(key.str());
    if (const toml::table* inner = node.as_table()) {
      if (inner->empty())
        mistakes.add(weave::line_of(node), shown_prefix + "." + full, "{}", "is empty; expected keys of the case with their values");
      add_leaves(*inner, full, shown_prefix, leaves, mistakes);
    } else {
      leaves.emplace_back(full, &node);
    }
  }
}

std::vector<std::pair<std::string, const toml::node*>> leaves_of(const toml::node* node, const std::string& shown_prefix,
                                                                 Mistakes& mistakes) {
  std::vector<std::pair<std::string, const toml::node*>> leaves;
  if (!node) return leaves;
  if (const toml::table* table = node->as_table()) {
    add_leaves(*table, "", shown_prefix, leaves, mistakes);
  } else {
    mistakes.add(weave::line_of(*node), shown_prefix, weave::value_text(*node), "expected a table of keys with their values");
  }
  std::stable_sort(leaves.begin(), leaves.end(), [](const auto& a, const auto& b) {
    const auto place = [](const toml::node* n) { return std::pair(n->source().begin.line, n->source().begin.column); };
    return place(a.second) < place(b.second);
  });
  std::set<std::string> seen;
  for (const auto& [key, leaf] : leaves) {
    if (!seen.insert(key).second) mistakes.add(weave::line_of(*leaf), shown_prefix + "." + key, weave::value_text(*leaf), "is given twice");
  }
  return leaves;
}

std::vector<Entry> read_assignments(const toml::node* node, const std::string& shown_prefix, Mistakes& mistakes) {
  std::vector<Entry> entries;
  for (const auto& [key, leaf] : leaves_of(node, shown_prefix, mistakes))
    entries.push_back({{key, toml_text(*leaf)}, weave::line_of(*leaf), shown_prefix + "." + key, weave::value_text(*leaf)});
  return entries;
}

std::vector<Axis> read_axes(const toml::node* node, Mistakes& mistakes) {
  std::vector<Axis> axes;
  for (const auto& [key, leaf] : leaves_of(node, "vary", mistakes)) {
    const toml::array* values = leaf->as_array();
    const std::string shown_key = "vary." + key;
    if (!values || values->empty()) {
      mistakes.add(weave::line_of(*leaf), shown_key, weave::value_text(*leaf),
                   values ? "is empty; expected at least one value" : "expected a list of values");
      continue;
    }
    Axis axis{key, {}};
    for (const toml::node& value : *values)
      axis.values.push_back({{key, toml_text(value)}, weave::line_of(value), shown_key, weave::value_text(value)});
    axes.push_back(std::move(axis));
  }
  if (node && node->is_table() && node->as_table()->empty())
    mistakes.add(weave::line_of(*node), "vary", "{}", "is empty; expected at least one key with a list of values");
  return axes;
}

/// All combinations; the last axis turns fastest.
std::vector<Combination> grid_of(const std::vector<Axis>& axes) {
  std::vector<Combination> grid;
  if (axes.empty()) return grid;
  grid.emplace_back();
  for (const Axis& axis : axes) {
    std::vector<Combination> longer;
    for (const Combination& c : grid) {
      for (const Entry& value : axis.values) {
        longer.push_back(c);
        longer.back().entries.push_back(value);
      }
    }
    grid = std::move(longer);
  }
  for (Combination& c : grid)
    std::tie(c.line, c.shown_key, c.shown_value) =
        std::tuple(c.entries.back().line, c.entries.back().shown_key, c.entries.back().shown_value);
  return grid;
}

const Entry* find(const std::vector<Entry>& entries, const std::string& key) {
  const auto at = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) { return e.assignment.key == key; });
  return at == entries.end() ? nullptr : &*at;
}

void report_clashes(const std::vector<Entry>& entries, const std::vector<Entry>& others, Mistakes& mistakes) {
  for (const Entry& e : entries) {
    if (const Entry* other = find(others, e.assignment.key))
      mistakes.add(e.line, e.shown_key, e.shown_value,
                   fmt::format("clashes with {} (line {}): give the key once", other->shown_key, other->line));
  }
}

// ------------------------------------------------------------------------------------------------------- keys of the stages after weaving

int stage_index(const std::string& stage) {
  const auto& names = stage_names();
  return static_cast<int>(std::find(names.begin(), names.end(), stage) - names.begin());
}

/// The stage that a key belongs to; 0 for keys of the case.
int stage_of_key(const std::string& key) {
  const int stage = stage_index(key.substr(0, key.find('.')));
  return stage < static_cast<int>(stage_names().size()) ? stage : 0;
}

/// What is wrong with a value of a later stage's key; empty: nothing.
std::string stage_key_mistake(const std::string& key, const std::string& value) {
  const auto integer = [&](long low, long high) -> std::string {
    const auto parsed = toml::parse("v = " + value)["v"].value_exact<std::int64_t>();
    return parsed && *parsed >= low && *parsed <= high ? "" : fmt::format("must be an integer >= {} and <= {}", low, high);
  };
  if (key == "relax.fibers") return integer(1, 1000);
  if (key == "relax.pressure" || key == "relax.load_x" || key == "relax.load_y") {
    const auto number = toml::parse("v = " + value)["v"].value<double>();
    return number && std::isfinite(*number) && *number >= 0
               ? ""
               : fmt::format("must be a number >= 0 [{}]", key == "relax.pressure" ? "Pa" : "N");
  }
  if (key == "homogenize.elements") return integer(8, 10000000);  // as `heddle run`
  if (key == "relax.unconverged") return value == "true" || value == "false" ? "" : "expected true or false";
  return "unknown key; of the stages after weaving a study may give relax.fibers, relax.pressure, relax.load_x, relax.load_y, "
         "relax.unconverged and homogenize.elements";
}

// ---------------------------------------------------------------------------------------------------------------------- runs of a study

/// Names for the combinations that have none: the varied values, by the last part of the key where that tells them apart.
void name_combinations(std::vector<Combination>& combinations) {
  std::map<std::string, std::set<std::string>> keys_by_last;
  for (const Combination& c : combinations)
    for (const Entry& e : c.entries) keys_by_last[last_part(e.assignment.key)].insert(e.assignment.key);
  for (Combination& c : combinations) {
    if (!c.name.empty()) continue;
    for (const Entry& e : c.entries) {
      const std::string& key = e.assignment.key;
      const std::string label = keys_by_last[last_part(key)].size() > 1 ? key : last_part(key);
      const std::string value = name_part(shown(key, e.assignment.value));
      c.name += (c.name.empty() ? "" : "_") + (key == "case" ? value : name_part(label) + "_" + value);
    }
    if (c.name.empty()) c.name = "base";
  }
}

std::vector<std::string> case_overrides(const std::vector<Assignment>& changes) {
  std::vector<std::string> overrides;
  for (const Assignment& a : changes) {
    if (stage_of_key(a.key) == 0) overrides.push_back(a.key + "=" + a.value);
  }
  return overrides;
}

/// Changes with yarns.* written out for the yarns of the case.
std::vector<Assignment> for_all_yarns(const std::vector<Assignment>& changes, const weave::Case& base) {
  const std::string all = "yarns.*.";
  std::vector<Assignment> result;
  for (const Assignment& a : changes) {
    if (a.key.rfind(all, 0) != 0) {
      result.push_back(a);
      continue;
    }
    for (const auto& [name, yarn] : base.yarns) result.push_back({"yarns." + name + "." + a.key.substr(all.size()), a.value});
  }
  return result;
}

/// What a run computes: the same text means the same run.
std::string fingerprint(const StudyRun& run) {
  std::string text = weave::to_toml(run.spec);
  for (const Assignment& a : run.changes) {
    if (stage_of_key(a.key) > 0) text += a.key + " = " + a.value + "\n";
  }
  return text;
}

/// A second value for an entry already there replaces it.
void assign(std::vector<Assignment>& changes, const Assignment& assignment) {
  const auto at = std::find_if(changes.begin(), changes.end(), [&](const Assignment& a) { return a.key == assignment.key; });
  if (at == changes.end()) {
    changes.push_back(assignment);
  } else {
    at->value = assignment.value;
  }
}

class Expansion {
 public:
  Expansion(Study& study, path base_case, Mistakes& mistakes) : study_(study), base_case_(std::move(base_case)), mistakes_(mistakes) {}

  void add(const Combination& c, const std::vector<Entry>& settings, const std::vector<Entry>& second) {
    StudyRun run;
    run.name = c.name;
    run.case_file = base_case_;
    for (const Entry& e : settings) assign(run.changes, e.assignment);
    for (const Entry& e : c.entries) {
      if (e.assignment.key == "case") {
        run.case_file = study_.file.parent_path() / plain_value(e.assignment.value);
      } else {
        assign(run.changes, e.assignment);
      }
    }
    for (const std::string& key : study_.parameters) {
      const Entry* e = find(c.entries, key);
      run.parameters.push_back(e ? shown(key, e->assignment.value) : key == "case" ? case_label(run.case_file) : "");
    }
    if (run.case_file.empty()) {
      mistakes_.add(c.line, c.shown_key, c.shown_value,
                    fmt::format("run {} has no case: give case, vary.case or the run's case", run.name));
      return;
    }
    StudyRun repetition = run;
    if (!resolve(c, run)) return;
    study_.runs.push_back(run);
    if (second.empty()) return;
    repetition.name += "_second";
    repetition.second_of = run.name;
    for (const Entry& e : second) assign(repetition.changes, e.assignment);
    Combination shown_at = c;
    std::tie(shown_at.line, shown_at.shown_key, shown_at.shown_value) =
        std::tuple(second[0].line, second[0].shown_key, second[0].shown_value);
    if (resolve(shown_at, repetition)) study_.runs.push_back(repetition);
  }

 private:
  Study& study_;
  path base_case_;
  Mistakes& mistakes_;
  std::map<std::string, std::string> run_of_fingerprint_;
  std::set<std::string> names_, reported_;

  /// Reads the run's case with its changes; false, with the mistake reported, where that or another run forbids it.
  bool resolve(const Combination& c, StudyRun& run) {
    try {
      run.changes = for_all_yarns(run.changes, weave::load_case(run.case_file));
      run.spec = weave::load_case(run.case_file, case_overrides(run.changes));
    } catch (const weave::CaseError& error) {
      if (reported_.insert(error.what()).second)
        mistakes_.add(c.line, c.shown_key, c.shown_value, fmt::format("run {}: {}", run.name, error.what()));
      return false;
    }
    const auto [other, is_new] = run_of_fingerprint_.emplace(fingerprint(run), run.name);
    if (!is_new) {
      mistakes_.add(c.line, c.shown_key, c.shown_value, fmt::format("run {} has the same values as run {}", run.name, other->second));
      return false;
    }
    if (!names_.insert(run.name).second) {
      mistakes_.add(c.line, c.shown_key, c.shown_value, fmt::format("two runs are named {}: give a [[run]] another name", run.name));
      return false;
    }
    return true;
  }
};

std::vector<Combination> read_listed(TableReader& top, const toml::table& root, Mistakes& mistakes) {
  std::vector<Combination> listed;
  if (!top.find("run")) return listed;
  for (TableReader& table : top.tables("run")) {
    Combination c;
    c.line = table.line();
    const std::size_t place = listed.size();
    const toml::table& node = *root["run"][place].as_table();
    c.name = table.text("name", "");
    c.shown_key = fmt::format("run.{}", place);
    c.shown_value = "{table}";
    if (table.find("name") && !is_name(c.name)) table.mistake("name", "must be of letters, digits and _ - . +, as it names a folder");
    if (const std::string file = table.text("case", ""); table.find("case"))
      c.entries.push_back({{"case", toml_text(*node.get("case"))},
                           weave::line_of(*node.get("case")),
                           c.shown_key + ".case",
                           weave::value_text(*node.get("case"))});
    for (const Entry& e : read_assignments(table.find("set"), c.shown_key + ".set", mistakes)) c.entries.push_back(e);
    if (c.entries.empty() && !table.find("name"))
      mistakes.add(c.line, c.shown_key, c.shown_value, "is empty; give it a name, a case, or values in set");
    table.report_unknown();
    listed.push_back(std::move(c));
  }
  return listed;
}

std::vector<std::string> read_collect(TableReader& top) {
  std::vector<std::string> collect = top.texts("collect");
  std::set<std::string> seen;
  for (const std::string& key : collect) {
    const auto dot = key.find('.');
    if (dot == std::string::npos || dot + 1 == key.size() || stage_index(key.substr(0, dot)) == static_cast<int>(stage_names().size())) {
      top.mistake("collect", fmt::format("\"{}\" must read STAGE.KEY with one of the stages {}", key, fmt::join(stage_names(), ", ")));
    } else if (const std::string wrong = figure_mistake(key); !wrong.empty()) {
      top.mistake("collect", fmt::format("\"{}\": {}", key, wrong));
    }
    if (!seen.insert(key).second) top.mistake("collect", fmt::format("\"{}\" is there twice", key));
  }
  return collect;
}

std::vector<Reference> read_references(TableReader& top, const Study& study, Mistakes& mistakes) {
  std::vector<Reference> references;
  if (!top.find("reference")) return references;
  for (TableReader& table : top.tables("reference")) {
    Reference r;
    r.key = table.text("key");
    if (!r.key.empty() && std::find(study.collect.begin(), study.collect.end(), r.key) == study.collect.end())
      table.mistake("key", "must be one of the collected figures");
    r.value = table.quantity("value", weave::Dimension::number, {});
    r.tolerance = table.quantity("tolerance", weave::Dimension::number, weave::not_negative, 0.0);
    r.source = table.text("source");
    for (const Entry& e : read_assignments(table.find("where"), table.full_key("where"), mistakes)) {
      if (std::find(study.parameters.begin(), study.parameters.end(), e.assignment.key) == study.parameters.end())
        mistakes.add(e.line, e.shown_key, e.shown_value, "must be a key that differs from run to run");
      r.where.push_back({e.assignment.key, shown(e.assignment.key, e.assignment.value)});
    }
    table.report_unknown();
    references.push_back(std::move(r));
  }
  return references;
}

}  // namespace

const std::vector<std::string>& stage_names() {
  static const std::vector<std::string> names = {"weave", "relax", "envelope", "homogenize"};
  return names;
}

std::string plain_value(const std::string& toml_value) {
  toml::table parsed;
  try {
    parsed = toml::parse("v = " + toml_value);
  } catch (const toml::parse_error&) {
    return toml_value;
  }
  return parsed["v"].value_exact<std::string>().value_or(toml_value);
}

Study read_study(const path& given) {
  Study study;
  study.file = std::filesystem::is_directory(given) ? given / "study.toml" : given;
  const std::string file = study.file.string();
  if (!std::filesystem::is_regular_file(study.file)) throw weave::CaseError(file + ": can not be read as a study file");
  toml::table root;
  try {
    root = toml::parse_file(file);
  } catch (const toml::parse_error& error) {
    throw weave::CaseError(fmt::format("{}:{}: not TOML: {}", file, error.source().begin.line, error.description()));
  }
  Mistakes mistakes(file);
  TableReader top(&root, "", 1, mistakes);
  study.name = top.text("name");
  if (!study.name.empty() && !is_name(study.name)) top.mistake("name", "must be of letters, digits and _ - . +, as it names a folder");
  study.title = top.text("title", study.name);
  study.question = top.text("question");
  const std::string base_case = top.text("case", "");
  study.collect = read_collect(top);

  std::vector<Entry> settings = read_assignments(top.find("set"), "set", mistakes);
  const std::vector<Axis> axes = read_axes(top.find("vary"), mistakes);
  const std::vector<Combination> listed = read_listed(top, root, mistakes);
  TableReader error = top.table("error");
  const std::vector<Entry> second = read_assignments(error.find("set"), "error.set", mistakes);
  if (top.find("error") && second.empty())
    error.mistake("set", "is missing or empty; expected the second discretization's keys and values");
  const std::vector<std::string> repeated = error.find("runs") ? error.texts("runs") : std::vector<std::string>();
  error.report_unknown();
  if (!top.find("vary") && !top.find("run")) top.mistake("vary", "missing; give it, or one or more [[run]]");

  // Which keys are given where.
  std::vector<Entry> varied;
  for (const Axis& axis : axes) varied.push_back(axis.values.front());
  report_clashes(varied, settings, mistakes);
  report_clashes(second, varied, mistakes);
  for (const Combination& c : listed) {
    report_clashes(c.entries, settings, mistakes);
    report_clashes(second, c.entries, mistakes);
  }
  const auto no_case = [&](const std::vector<Entry>& entries) {
    if (const Entry* e = find(entries, "case"))
      mistakes.add(e->line, e->shown_key, e->shown_value, "give case at the top, in [vary] or in a [[run]]");
  };
  no_case(settings);
  no_case(second);
  for (const Entry& e : varied) study.parameters.push_back(e.assignment.key);
  for (const Combination& c : listed) {
    for (const Entry& e : c.entries) {
      if (std::find(study.parameters.begin(), study.parameters.end(), e.assignment.key) == study.parameters.end())
        study.parameters.push_back(e.assignment.key);
    }
  }

  // The last stage, and what needs a later one.
  int last = 0;
  for (const std::string& key : study.collect) last = std::max(last, stage_of_key(key));
  study.until = top.choice("until", stage_names(), stage_names()[static_cast<std::size_t>(last)]);
  const int until = stage_index(study.until);
  for (const std::string& key : study.collect) {
    if (stage_of_key(key) > until)
      top.mistake("collect", fmt::format("\"{}\" needs the stage {}, but until = \"{}\"", key, key.substr(0, key.find('.')), study.until));
  }
  std::vector<Entry> all = settings;
  for (const Axis& axis : axes) all.insert(all.end(), axis.values.begin(), axis.values.end());
  for (const Combination& c : listed) all.insert(all.end(), c.entries.begin(), c.entries.end());
  all.insert(all.end(), second.begin(), second.end());
  std::set<std::string> wrong_keys;
  for (const Entry& e : all) {
    const int stage = stage_of_key(e.assignment.key);
    if (stage == 0) continue;
    std::string wrong = stage_key_mistake(e.assignment.key, e.assignment.value);
    if (wrong.empty() && stage > until)
      wrong = fmt::format("is a key of the stage {}, but until = \"{}\"", stage_names()[static_cast<std::size_t>(stage)], study.until);
    if (!wrong.empty() && wrong_keys.insert(e.shown_key + e.shown_value).second) mistakes.add(e.line, e.shown_key, e.shown_value, wrong);
  }
  study.references = read_references(top, study, mistakes);
  top.report_unknown();
  mistakes.throw_if_any();

  for (const Entry& e : settings) study.settings.push_back(e.assignment);
  for (const Entry& e : second) study.second.push_back(e.assignment);
  std::vector<Combination> combinations = grid_of(axes);
  combinations.insert(combinations.end(), listed.begin(), listed.end());
  name_combinations(combinations);
  std::vector<std::string> names;
  for (const Combination& c : combinations) names.push_back(c.name);
  for (const std::string& name : repeated) {
    if (std::find(names.begin(), names.end(), name) == names.end())
      error.mistake("runs", fmt::format("has \"{}\"; must be names of the study's runs: {}", name, fmt::join(names, ", ")));
  }
  Expansion expansion(study, base_case.empty() ? path() : study.file.parent_path() / base_case, mistakes);
  const auto is_repeated = [&](const Combination& c) {
    return repeated.empty() || std::find(repeated.begin(), repeated.end(), c.name) != repeated.end();
  };
  for (const Combination& c : combinations) expansion.add(c, settings, is_repeated(c) ? second : std::vector<Entry>());
  mistakes.throw_if_any();
  return study;
}

std::vector<std::string> run_arguments(const Study& study, const StudyRun& run, const path& output) {
  std::vector<std::string> arguments = {"run", run.case_file.string(), "--output", output.string(), "--until", study.until, "--quiet"};
  const auto option = [&](const std::string& name, const std::string& value) { arguments.insert(arguments.end(), {name, value}); };
  for (const Assignment& a : run.changes) {
    if (a.key == "relax.fibers") {
      option("--fibers", a.value);
    } else if (a.key == "relax.pressure") {
      option("--pressure", a.value);
    } else if (a.key == "relax.load_x") {
      option("--load-x", a.value);
    } else if (a.key == "relax.load_y") {
      option("--load-y", a.value);
    } else if (a.key == "homogenize.elements") {
      option("--elements", a.value);
    } else if (a.key == "relax.unconverged") {
      if (a.value == "true") arguments.emplace_back("--unconverged");
    } else {
      option("--set", a.key + "=" + a.value);
    }
  }
  return arguments;
}

}  // namespace heddle
