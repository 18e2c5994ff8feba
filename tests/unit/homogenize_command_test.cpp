#include "heddle/homogenize_command.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "heddle/envelope_command.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"
#include "scenes/with_calculix.hpp"
#include "weave/results.hpp"

namespace {

using namespace scenes;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class HomogenizeCommand : public WithCalculix {
 protected:
  void SetUp() override {
    WithCalculix::SetUp();
    if (IsSkipped()) return;
    const PlainWeave weave{.fibers = 1, .pitch = 4e-4};
    const PosedCell start = plain_weave_cell(weave, 0.2, 1);
    weave::write_results(folder / "cell.vtkhdf",
                         {relax::snapshot_of(start.cell, start.unknowns()), {}, weave::to_toml(plain_weave(weave)), "test"});
    heddle::EnvelopeCommandOptions envelope;
    envelope.input = folder;
    envelope.formats = {"off"};
    ASSERT_EQ(heddle::envelope_command(envelope), 0);
    options.input = folder / "envelope";
    options.output = folder / "homogenize";
  }

  heddle::HomogenizeCommandOptions options;
};

TEST_F(HomogenizeCommand, stands_between_its_bounds) {
  options.voxels = {14, 14, 10};
  options.mesh_error = false;
  ASSERT_EQ(heddle::homogenize_command(options), 0);
  std::ifstream in(options.output / "summary.json");
  const nlohmann::json s = nlohmann::json::parse(in);
  for (const std::string key : {"ex_Pa", "ey_Pa", "ez_Pa", "gxy_Pa", "gyz_Pa", "gxz_Pa"}) {
    EXPECT_LT(s.at("reuss_" + key), s.at(key)) << key;
    EXPECT_LT(s.at(key), s.at("voigt_" + key)) << key;
  }
  for (const std::string key : {"ex_Pa", "ey_Pa"}) EXPECT_LT(s.at(key), s.at("laminate_" + key)) << key;  // whose yarns have no crimp
  for (const char* name : {"reuss", "laminate", "voigt"}) {
    EXPECT_EQ(s.at(std::string(name) + "_stiffness_Pa").size(), 6U);
    EXPECT_TRUE(s.contains(std::string(name) + "_nu_xy"));
  }
}

TEST_F(HomogenizeCommand, makes_no_folder_without_a_mesh) {
  options.tetrahedra = true;
  options.edge_length = "100";
  EXPECT_THAT([&] { heddle::homogenize_command(options); }, ThrowsMessage<std::invalid_argument>(HasSubstr("edge length")));
  EXPECT_FALSE(std::filesystem::exists(options.output));
}

}  // namespace
