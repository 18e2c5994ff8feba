#include "heddle/relax_command.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace heddle {
namespace {

using testing::HasSubstr;

TEST(RelaxCommand, LoadsThatLeaveTheSizeOfTheCellOpenAreRefused) {
  RelaxOptions options;
  options.input = std::filesystem::path(HEDDLE_CASES_DIR) / "kevlar_km2_706";  // from topology: two warps and two wefts of 3 N
  options.quiet = true;
  options.load_x = 6;
  EXPECT_THAT([&] { (void)relax_command(options); },
              ThrowsMessage<std::invalid_argument>(HasSubstr("--load-x = 6: must be < 6 N, the prescribed tension of all warps")));
  options.load_x = 5.5;
  options.load_y = 5.5;
  EXPECT_THAT([&] { (void)relax_command(options); }, ThrowsMessage<std::invalid_argument>(HasSubstr("leave the size of the cell open")));
}

}  // namespace
}  // namespace heddle
