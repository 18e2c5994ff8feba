#pragma once
#include <filesystem>

namespace weave {

/// Where a new version of `file` is written before it takes the old one's place: "<file>.part" beside it.
std::filesystem::path part_of(const std::filesystem::path& file);

/// Puts the finished, closed part_of(file) in the place of `file`, after it has reached the disk, so that `file` is either the old or
/// the new one, whole. Throws std::runtime_error naming file and cause.
void replace_by_part(const std::filesystem::path& file);

}  // namespace weave
