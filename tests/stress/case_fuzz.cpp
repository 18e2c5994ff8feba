#include "stress/case_fuzz.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <sstream>

#include "weave/case.hpp"

namespace stress {
namespace {

constexpr const char* name = "mutant.toml";
constexpr int mutations_most = 4;  ///< of one text

/// What stands in for a number or another value.
// clang-format off
const std::vector<std::string> hostile_values = {
    "0", "-1", "1", "0.5", "10000", "2147483648", "99999999999999999999", "0x7fffffffffffffff", "1e308", "-1e308", "1e-300", "5e-324",
    "nan", "inf", "-inf", "true", "1979", "\"\"", "\"m\"", "\"0 m\"", "\"-3 N\"", "\"nan m\"", "\"1e400 m\"", "\"1e-320 m\"",
    "\"5 parsec\"", "\"\\u0000\"", "\"\xff\"", "'\\'", "[]", "{}", "[\"+\"]", "[\"+ -\"]", "[[\"+\", \"-\"]]", "[[1], [2, 3]]"};
// clang-format on

using Random = std::mt19937_64;

std::size_t below(Random& random, std::size_t n) {
  return n == 0 ? 0 : random() % n;
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line + '\n';
  return text;
}

/// Puts something else in the place of the value of a random "key = value" line.
void replace_value(Random& random, std::vector<std::string>& lines) {
  std::string& line = lines[below(random, lines.size())];
  const auto equals = line.find('=');
  if (equals != std::string::npos) line = line.substr(0, equals + 1) + ' ' + hostile_values[below(random, hostile_values.size())];
}

/// Multiplies a number somewhere in a random line by a power of ten, or changes its sign.
void scale_number(Random& random, std::vector<std::string>& lines) {
  std::string& line = lines[below(random, lines.size())];
  const auto digit = line.find_first_of("0123456789");
  if (digit == std::string::npos) return;
  const auto end = std::min(line.find_first_not_of("0123456789.", digit), line.size());
  line.insert(end, fmt::format("e{}", static_cast<int>(below(random, 41)) - 20));
  if (below(random, 4) == 0) line.insert(digit, "-");
}

void mutate(Random& random, const std::vector<std::string>& donor, std::string& text) {
  std::vector<std::string> lines = lines_of(text);
  if (lines.empty()) return;
  const std::size_t at = below(random, lines.size());
  switch (below(random, 9)) {
    case 0:
      replace_value(random, lines);
      break;
    case 1:
      scale_number(random, lines);
      break;
    case 2:
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(at));
      break;
    case 3:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at), lines[below(random, lines.size())]);
      break;
    case 4:
      std::swap(lines[at], lines[below(random, lines.size())]);
      break;
    case 5:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(at), donor[below(random, donor.size())]);
      break;
    case 6:
      lines[at].insert(below(random, lines[at].size() + 1), 1, static_cast<char>(random() & 0xff));
      break;
    case 7:
      lines[at].resize(below(random, lines[at].size() + 1));
      break;
    default:
      lines[at].insert(below(random, lines[at].size() + 1), std::string(1 + below(random, 600), "[{\"'#=+-."[below(random, 9)]));
  }
  text = joined(lines);
}

/// Empty if the reader does as it should.
std::string fault_of(const std::string& text, FuzzCount& count) {
  try {
    const std::string first = weave::to_toml(weave::parse_case(text, name));
    ++count.accepted;
    return weave::to_toml(weave::parse_case(first, name)) == first ? "" : "the accepted case does not come back from its own TOML";
  } catch (const weave::CaseError& error) {
    ++count.rejected;
    for (const std::string& line : lines_of(error.what())) {
      if (line.rfind(std::string(name) + ':', 0) != 0) return "a line of the message does not name the file: " + line;
    }
    return "";
  } catch (const std::exception& error) {
    return fmt::format("another error than a case's: {}", error.what());
  }
}

}  // namespace

FuzzCount fuzz_cases(const std::filesystem::path& cases, std::uint64_t seed, int mutants) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(cases)) {
    if (std::filesystem::exists(entry.path() / "case.toml")) files.push_back(entry.path() / "case.toml");
  }
  std::sort(files.begin(), files.end());
  std::vector<std::string> texts;
  for (const auto& file : files) texts.push_back(read_text(file));
  Random random(seed);
  FuzzCount count;
  for (int i = 0; i < mutants; ++i) {
    std::string text = texts[below(random, texts.size())];
    const std::vector<std::string> donor = lines_of(texts[below(random, texts.size())]);
    const std::size_t mutations = 1 + below(random, mutations_most);
    for (std::size_t k = 0; k < mutations; ++k) mutate(random, donor, text);
    if (const std::string fault = fault_of(text, count); !fault.empty())
      count.faults.push_back(fmt::format("mutant {}: {}\n{}", i, fault, text));
  }
  return count;
}

}  // namespace stress
