// Ends with 0 if the installed headers and libraries work together: each line below needs another library to be linked.
#include <cstdio>
#include <cstring>
#include <relax/envelope.hpp>
#include <relax/version.hpp>
#include <stdexcept>
#include <weave/case.hpp>
#include <weave/results.hpp>
#include <weave/version.hpp>
#include <weave/weaving_matrix.hpp>

namespace {

bool case_without_yarns_is_refused() {
  try {
    weave::parse_case("title = 'empty'", "empty.toml");
  } catch (const weave::CaseError&) {
    return true;
  }
  return false;
}

bool missing_results_are_refused() {
  try {
    weave::read_results("no_such_results.vtkhdf");
  } catch (const std::runtime_error&) {
    return true;
  }
  return false;
}

bool surfaces_of_nothing_are_refused() {
  try {
    relax::make_envelopes({}, {});
  } catch (const std::invalid_argument&) {
    return true;
  }
  return false;
}

}  // namespace

int main() {
  std::printf("heddle %s\n", weave::version());
  const weave::WeavingMatrix matrix = weave::weaving_matrix_from_rows({"+ - -", "+ + -"});
  const bool right = std::strcmp(weave::version(), relax::version()) == 0 && matrix.rows() == 2 && matrix.cols() == 3 &&
                     matrix(1, 1) == 1 && case_without_yarns_is_refused() && missing_results_are_refused() &&
                     surfaces_of_nothing_are_refused();
  return right ? 0 : 1;
}
