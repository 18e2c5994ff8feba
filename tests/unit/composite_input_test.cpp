#include "heddle/composite_input.hpp"

#include <gmock/gmock.h>

#include "scenes/cells.hpp"

namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

/// A plain weave whose yarns are of a material, "" for none.
weave::Case of_material(const std::string& name) {
  weave::Case c = scenes::plain_weave({});
  for (auto& [yarn, type] : c.yarns) type.material = name;
  return c;
}

TEST(CompositeInput, TakesTheMaterialsOfTheCase) {
  weave::Case c = of_material("hemp");
  c.materials["hemp"] = {30e9, 5e9, 3e9, 0.3, 0.4};
  c.matrix_material = {2e9, 0.4};
  const relax::Constituents made = heddle::constituents_of({}, c);
  EXPECT_EQ(made.fiber_name, "hemp");
  EXPECT_EQ(made.fiber.e1, 30e9);
  EXPECT_EQ(made.fiber.nu23, 0.4);
  EXPECT_EQ(made.matrix_e, 2e9);
  EXPECT_EQ(made.matrix_nu, 0.4);
  EXPECT_EQ(heddle::constituents_of({}, of_material("aramid")).fiber.e1, 84.62e9);
}

TEST(CompositeInput, FiberMayNameAMaterialOfTheCase) {
  weave::Case c = of_material("");
  c.materials["hemp"] = {30e9, 5e9, 3e9, 0.3, 0.4};
  c.materials["carbon"] = {300e9, 10e9, 20e9, 0.2, 0.3};
  heddle::CompositeOptions options;
  options.fiber = "hemp";
  EXPECT_EQ(heddle::constituents_of(options, c).fiber.e1, 30e9);
  options.fiber = "carbon";  // goes before the one that is known by that name
  EXPECT_EQ(heddle::constituents_of(options, c).fiber.e1, 300e9);
  options.fiber = "jute";
  EXPECT_THAT([&] { heddle::constituents_of(options, c); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("--fiber jute"), HasSubstr("of the case hemp"))));
}

TEST(CompositeInput, IsGlassInEpoxyWhereNothingIsSaid) {
  for (const weave::Case& c : {of_material(""), weave::Case{}}) {
    const relax::Constituents made = heddle::constituents_of({}, c);
    EXPECT_EQ(made.fiber_name, "e_glass");
    EXPECT_EQ(made.fiber.e1, 72.4e9);
    EXPECT_EQ(made.matrix_e, 3.45e9);
    EXPECT_EQ(made.matrix_nu, 0.35);
  }
}

TEST(CompositeInput, OptionsWinOverTheCase) {
  weave::Case c = of_material("aramid");
  c.matrix_material = {2e9, 0.4};
  heddle::CompositeOptions options;
  options.fiber = "carbon";
  options.fiber_e2 = 14e9;
  options.matrix_nu = 0.3;
  const relax::Constituents made = heddle::constituents_of(options, c);
  EXPECT_EQ(made.fiber_name, "carbon, changed");
  EXPECT_EQ(made.fiber.e1, 225e9);
  EXPECT_EQ(made.fiber.e2, 14e9);
  EXPECT_EQ(made.matrix_e, 2e9);
  EXPECT_EQ(made.matrix_nu, 0.3);
}

TEST(CompositeInput, RefusesYarnsOfSeveralMaterials) {
  weave::Case c = of_material("aramid");
  weave::YarnType other = c.yarns.at(c.weft.yarn_of_layer.front());
  other.name = "other";
  other.material = "";
  c.yarns["other"] = other;
  c.weft.yarn_of_layer.front() = "other";
  EXPECT_THAT([&] { heddle::constituents_of({}, c); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("other"), HasSubstr("aramid"), HasSubstr("--fiber"))));
  heddle::CompositeOptions options;
  options.fiber = "carbon";
  EXPECT_EQ(heddle::constituents_of(options, c).fiber_name, "carbon");
}

}  // namespace
