#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace stress {

struct FuzzCount {
  int accepted = 0, rejected = 0;
  std::vector<std::string>
      faults;  ///< mutants that were neither read to the same case again nor refused with a message of their file, with why
};

/// Reads `mutants` mutated texts of the case files case.toml in the folders of `cases`. A mutant that is accepted has to come back to the
/// bit from its own TOML; one that is refused, by a CaseError whose lines all name the file.
FuzzCount fuzz_cases(const std::filesystem::path& cases, std::uint64_t seed, int mutants);

}  // namespace stress
