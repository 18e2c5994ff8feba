#include "stress/sweep.hpp"

#include <fmt/format.h>

#include <regex>

namespace stress {

std::string fault(const Outcome& o, double ledger_limit) {
  if (!o.defect.empty()) return o.defect;
  if (!o.completed) {
    static const std::regex where(R"((step|pick) \d+.*(yarn|node|warp|weft)|warp \d+|overlap at the start|\.toml:(\d+|\(override\)): )");
    return std::regex_search(o.message, where) ? "" : fmt::format("the message does not say where it stopped: \"{}\"", o.message);
  }
  if (o.wrong_order > 0) return fmt::format("{} crossings were turned over in silence", o.wrong_order);
  if (o.late_searches > 0) return fmt::format("{} steps used a neighbor list that had run out", o.late_searches);
  if (!(o.ledger_error <= ledger_limit))
    return fmt::format("the energy ledger is open by {:.2g} (limit {:.2g})", o.ledger_error, ledger_limit);
  return "";
}

std::vector<double> pick(Extent extent, std::vector<double> brief, std::vector<double> full) {
  return extent == Extent::brief ? std::move(brief) : std::move(full);
}

}  // namespace stress
