#pragma once
#include <filesystem>
#include <vector>

#include "heddle/study_progress.hpp"

namespace heddle {

/// The task earlier in the list that weaves the same cloth; null: none.
const RunTask* twin_of(const RunTask& task, const std::vector<RunTask>& tasks);

/// Copies a cloth woven to its end from one run's folder into another's, so that `heddle run` keeps it instead of weaving it again. Does
/// nothing where there is none, or where the other run has begun to weave its own.
void copy_weave(const std::filesystem::path& from, const std::filesystem::path& to);

/// Gives each task that has not begun the cloth of a run in one of the folders, if this version of the program wove the same case there. A
/// folder is a study's or that of `heddle run`. Returns how many tasks got theirs.
std::size_t take_over_cloths(const std::vector<RunTask>& tasks, const std::vector<std::filesystem::path>& folders,
                             const std::filesystem::path& output);

}  // namespace heddle
