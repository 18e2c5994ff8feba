#include "weave/version.hpp"

#include <gmock/gmock.h>

#include "relax/version.hpp"

TEST(Version, StartsWithThreeNumbersAndMayNameTheRevision) {
  EXPECT_THAT(weave::version(), testing::MatchesRegex("[0-9]+\\.[0-9]+\\.[0-9]+( \\([0-9a-f]+(\\+dirty)?\\))?"));
}

TEST(Version, IsTheSameForBothLibraries) {
  EXPECT_STREQ(relax::version(), weave::version());
}
