#include "weave/tables.hpp"

#include <gtest/gtest.h>

#include "hdf5_file.hpp"
#include "scenes/temporary.hpp"

namespace weave {
namespace {

TEST(Tables, CommaSeparatedValues) {
  const Table table{"t", {{"a_m", {0.1, 2}}, {"b", {1.0 / 3, -4e-7}}}};
  EXPECT_EQ(to_csv(table), "a_m,b\n0.1,0.3333333333333333\n2,-4e-07\n");
  EXPECT_EQ(to_csv({"empty", {}}), "\n");
  EXPECT_THROW(to_csv({"t", {{"a", {1, 2}}, {"b", {1}}}}), std::invalid_argument);
}

TEST(Tables, Hdf5) {
  const std::filesystem::path file = scenes::temporary("tables") += ".h5";
  write_tables(file, {{"warp_0", {{"arc_m", {0, 0.5}}}}, {"weft_1", {{"arc_m", {1.0 / 3}}}}});
  const Hdf5File in = Hdf5File::open(file);
  EXPECT_EQ(in.read<double>("/warp_0/arc_m"), (std::vector<double>{0, 0.5}));
  EXPECT_EQ(in.read<double>("/weft_1/arc_m"), (std::vector<double>{1.0 / 3}));
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace weave
