#pragma once
#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "weave/case.hpp"
#include "weave/units.hpp"

/// Reading of TOML tables with units and bounds, which collects all mistakes before it throws them as one error.
namespace weave {

constexpr double infinity = std::numeric_limits<double>::infinity();
// Values that stand for an entry already reported as wrong. Both make the later comparisons false, so that one mistake gives one line.
constexpr double wrong_number = std::numeric_limits<double>::quiet_NaN();
constexpr int wrong_integer = -1;

struct Bounds {
  double low = -infinity, high = infinity;
  bool low_open = false, high_open = false;

  [[nodiscard]] bool hold(double value) const {
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
  }
  [[nodiscard]] std::string text(std::string_view unit) const {
    const std::string suffix = unit.empty() ? "" : fmt::format(" {}", unit);
    const std::string above = std::isinf(low) ? "" : fmt::format("{} {}{}", low_open ? ">" : ">=", low, suffix);
    const std::string below = std::isinf(high) ? "" : fmt::format("{} {}{}", high_open ? "<" : "<=", high, suffix);
    return above + (above.empty() || below.empty() ? "" : " and ") + below;
  }
};

constexpr Bounds positive{0, infinity, true};
constexpr Bounds length_bounds{0, 10, true};  // the largest looms are a few meters
constexpr Bounds per_length_bounds{0.1};      // so that the length it stands for keeps within length_bounds
constexpr Bounds speed_bounds{1e-6, 1000};
constexpr Bounds not_negative{0};
constexpr Bounds fraction{0, 1};
constexpr Bounds positive_fraction{0, 1, true};

/// The value of an entry on one line, as the user wrote it, shortened if long.
inline std::string value_text(const toml::node& node) {
  if (node.is_table()) return "{table}";
  if (node.is_string()) return fmt::format("\"{}\"", node.ref<std::string>());
  if (node.is_floating_point()) return fmt::format("{:#}", node.ref<double>());
  std::ostringstream stream;
  node.visit([&](const auto& value) { stream << value; });
  std::string text;
  for (const char c : stream.str()) {
    if (c != '\n' && (c != ' ' || text.empty() || text.back() != ' ')) text += c;
  }
  constexpr std::size_t longest = 60;
  return text.size() > longest ? text.substr(0, longest) + "..." : text;
}

inline std::size_t line_of(const toml::node& node) {
  return node.source().begin.line;
}

/// Text with its control characters escaped, so that it keeps to one line.
inline std::string on_one_line(std::string_view text) {
  std::string result;
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    result += code < 0x20 || code == 0x7f ? fmt::format("\\u{:04X}", code) : std::string(1, c);
  }
  return result;
}

/// The mistakes found so far. Line 0 marks an entry that came from an override: only those have no place in the file.
class Mistakes {
 public:
  explicit Mistakes(std::string file) : file_(std::move(file)) {}

  void add(std::size_t line, const std::string& key, const std::string& value, const std::string& message) {
    const std::string place = line == 0 ? "(override)" : fmt::format("{}", line);
    lines_.emplace_back(line, on_one_line(fmt::format("{}:{}: {} = {}: {}", file_, place, key, value, message)));
  }

  void throw_if_any() {
    if (lines_.empty()) return;
    std::stable_sort(lines_.begin(), lines_.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string text;
    for (const auto& [line, message] : lines_) text += (text.empty() ? "" : "\n") + message;
    throw CaseError(text);
  }

 private:
  std::string file_;
  std::vector<std::pair<std::size_t, std::string>> lines_;
};

/// Levenshtein's number of single-letter edits from one word to the other.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

/// Reads the entries of one table, checks each by itself and remembers which keys are known. A table that the file lacks reads as empty.
class TableReader {
 public:
  TableReader(const toml::table* table, std::string path, std::size_t line, Mistakes& mistakes)
      : table_(table), path_(std::move(path)), line_(line), mistakes_(&mistakes) {}

  [[nodiscard]] std::string full_key(std::string_view key) const { return fmt::format("{}{}{}", path_, path_.empty() ? "" : ".", key); }

  /// The entry, or null; marks the key as known.
  const toml::node* find(std::string_view key) {
    if (std::find(known_.begin(), known_.end(), key) == known_.end()) known_.emplace_back(key);
    return table_ ? table_->get(key) : nullptr;
  }

  /// Reports a mistake at a key, with its value as given; `otherwise` is what to show where the default is at fault.
  void mistake(std::string_view key, const std::string& message, const std::string& otherwise = "(missing)") {
    const toml::node* node = table_ ? table_->get(key) : nullptr;
    mistakes_->add(node ? line_of(*node) : line_, full_key(key), node ? value_text(*node) : otherwise, message);
  }

  /// SI value of an entry; without a default the entry is required.
  double quantity(std::string_view key, Dimension dimension, const Bounds& bounds, std::optional<double> otherwise = {}) {
    const toml::node* node = find(key);
    if (!node) {
      if (!otherwise) mistake(key, fmt::format("missing; expected {}", describe(dimension)));
      return otherwise.value_or(wrong_number);
    }
    double value = wrong_number;
    if (node->is_integer() || node->is_floating_point()) {
      value = *node->value<double>();
    } else if (node->is_string()) {
      try {
        value = parse_quantity(node->ref<std::string>(), dimension);
      } catch (const std::invalid_argument& error) {
        mistake(key, error.what());
        return wrong_number;
      }
    } else {
      mistake(key, fmt::format("wrong type; expected {}", describe(dimension)));
      return wrong_number;
    }
    if (!std::isfinite(value)) {
      mistake(key, "must be finite");
      return wrong_number;
    }
    if (!bounds.hold(value)) {
      mistake(key, fmt::format("must be {}", bounds.text(si_unit(dimension))));
      return wrong_number;
    }
    return value;
  }

  int integer(std::string_view key, int low, int high, std::optional<int> otherwise = {}) {
    const toml::node* node = find(key);
    if (!node) {
      if (!otherwise) mistake(key, "missing; expected an integer");
      return otherwise.value_or(wrong_integer);
    }
    if (!node->is_integer()) {
      mistake(key, "wrong type; expected an integer");
      return wrong_integer;
    }
    const std::int64_t value = node->ref<std::int64_t>();
    if (value < low || value > high) {
      mistake(key, fmt::format("must be >= {} and <= {}", low, high));
      return wrong_integer;
    }
    return static_cast<int>(value);
  }

  bool boolean(std::string_view key, bool otherwise) {
    const toml::node* node = find(key);
    if (!node) return otherwise;
    if (!node->is_boolean()) mistake(key, "wrong type; expected true or false");
    return node->value<bool>().value_or(otherwise);
  }

  /// Empty only where a mistake has been reported.
  std::string text(std::string_view key, const std::optional<std::string>& otherwise = {}) {
    const toml::node* node = find(key);
    if (!node) {
      if (!otherwise) mistake(key, "missing; expected a string");
      return otherwise.value_or("");
    }
    if (!node->is_string()) {
      mistake(key, "wrong type; expected a string");
    } else if (node->ref<std::string>().empty()) {
      mistake(key, "must not be empty");
    }
    return node->value<std::string>().value_or("");
  }

  std::string choice(std::string_view key, const std::vector<std::string>& choices, const std::string& otherwise) {
    const toml::node* node = find(key);
    if (!node) return otherwise;
    std::string value = node->value<std::string>().value_or("");
    if (std::find(choices.begin(), choices.end(), value) == choices.end()) {
      mistake(key, fmt::format("must be one of: \"{}\"", fmt::join(choices, "\", \"")));
    }
    return value;
  }

  /// A list of strings; empty, with the mistake reported, if it is anything else.
  std::vector<std::string> texts(std::string_view key) {
    const toml::node* node = find(key);
    std::vector<std::string> result;
    if (const toml::array* array = node ? node->as_array() : nullptr) {
      for (const toml::node& entry : *array) {
        if (entry.is_string()) result.push_back(entry.ref<std::string>());
      }
      if (!array->empty() && result.size() == array->size()) return result;
    }
    mistake(key, "expected a list of strings");
    return {};
  }

  /// True if `a` is given and not `b`. Reports both given, or, where one is required, neither.
  bool first_of(std::string_view a, std::string_view b, bool required) {
    const bool has_a = find(a), has_b = find(b);
    if (has_a && has_b) mistake(a, fmt::format("contradicts {}: give one of the two", full_key(b)));
    if (!has_a && !has_b && required) mistake(a, fmt::format("missing; give it or {}", full_key(b)));
    return has_a && !has_b;
  }

  TableReader table(std::string_view key) {
    const toml::node* node = find(key);
    if (node && !node->is_table()) mistake(key, fmt::format("expected a table [{}]", full_key(key)));
    return {node ? node->as_table() : nullptr, full_key(key), node ? line_of(*node) : line_, *mistakes_};
  }

  /// A table of freely named tables, e.g. the yarns.
  std::vector<std::pair<std::string, TableReader>> named_tables() {
    std::vector<std::pair<std::string, TableReader>> result;
    if (!table_) return result;
    for (const auto& [key, node] : *table_) result.emplace_back(std::string(key.str()), table(key.str()));
    return result;
  }

  /// The tables of a list [[key]].
  std::vector<TableReader> tables(std::string_view key) {
    const toml::node* node = find(key);
    const toml::array* array = node ? node->as_array() : nullptr;
    std::vector<TableReader> result;
    if (!array || array->empty() || !array->is_homogeneous(toml::node_type::table)) {
      mistake(key, fmt::format("expected one or more tables [[{}]]", full_key(key)));
      return result;
    }
    for (std::size_t i = 0; i < array->size(); ++i) {
      const toml::node& entry = *array->get(i);
      result.emplace_back(entry.as_table(), fmt::format("{}.{}", full_key(key), i), line_of(entry), *mistakes_);
    }
    return result;
  }

  /// Reports every key that was not asked for.
  void report_unknown() {
    if (!table_) return;
    for (const auto& [key, node] : *table_) {
      const std::string_view name = key.str();
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      const auto nearest = std::min_element(known_.begin(), known_.end(), [&](const std::string& a, const std::string& b) {
        return edit_distance(a, name) < edit_distance(b, name);
      });
      mistake(name, fmt::format("unknown key; the nearest known one is {}", full_key(*nearest)));
    }
  }

  [[nodiscard]] std::size_t line() const { return line_; }
  [[nodiscard]] Mistakes& mistakes() { return *mistakes_; }

 private:
  const toml::table* table_;
  std::string path_;
  std::size_t line_;
  Mistakes* mistakes_;
  std::vector<std::string> known_;
};

}  // namespace weave
