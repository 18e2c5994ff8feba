#pragma once
#include <filesystem>
#include <vector>

#include "heddle/view.hpp"
#include "relax/minimize.hpp"
#include "weave/history.hpp"

namespace heddle {

/// Draws the curves of a history over time: reed load with its maximum per beat-up, warp tension, energy ledger, overlap. Nothing for an
/// empty one. Adds the files to `written`. Throws std::runtime_error for columns of different lengths.
void draw_curves(const weave::History& history, const ViewOptions& options, std::vector<std::filesystem::path>& written);

/// Draws the gradient and the energy above its end over the iterations of a relaxation, first-order phases told from Newton's method.
/// Nothing for an empty history. Adds the file to `written`.
void draw_convergence(const std::vector<relax::MinimizeProgress>& history, const ViewOptions& options,
                      std::vector<std::filesystem::path>& written);

}  // namespace heddle
