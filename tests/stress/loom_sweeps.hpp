#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "stress/sweep.hpp"
#include "weave/case.hpp"

namespace stress {

/// The smallest plain weave: a pair of warps in two dents, three fibers a yarn, two picks. Overrides as on a command line.
weave::Case plain_weave(const std::vector<std::string>& overrides = {});

/// Makes it ten times as fast: one fiber a yarn, in elements short enough to bend around one another.
inline const std::vector<std::string> single_fibers = {"yarns.glass.fibers=1", "numerics.element_length=2"};
inline constexpr double ledger_limit = 0.02;  ///< of the loom's scenes

/// Weaves a case, writing nothing. A loom that can not go on counts as stopped, with its message.
Outcome weave_through(const weave::Case& c);

std::vector<Sweep> loom_sweeps(Extent extent);

/// What a plain weave that goes on and on, cut off and stored as it grows, does in its first and in its last third.
struct LongWeave {
  Outcome outcome;
  std::size_t nodes = 0, nodes_most = 0;             ///< on the loom at the end, and at most
  double memory_a_pick = 0;                          ///< growth of the peak memory after the first third [bytes]
  double ledger_first = 0, ledger_last = 0;          ///< change of the ledger's residual, over the work that went in and out
  double steadiness_first = 0, steadiness_last = 0;  ///< mean difference of successive unit cells [fiber diameters]
};
LongWeave weave_long(int picks, const std::vector<std::string>& overrides);

/// What drifts in a long weave; empty if nothing does.
std::string drift(const LongWeave& weave);

/// Case file with a random weaving matrix in which every pick opens a shed: one to three sections, in a dent each, of one or two warps that
/// keep their order in the stack; one or two weft layers, and one or two columns.
std::string random_weave(std::uint64_t seed);

}  // namespace stress
