#include "weave/units.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

namespace weave {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(Units, QuantitiesOfTheCases) {
  EXPECT_EQ(parse_quantity("3 N", Dimension::force), 3);
  EXPECT_EQ(parse_quantity("1 in", Dimension::length), 0.0254);
  EXPECT_EQ(parse_quantity("17.78 mm", Dimension::length), 0.01778);
  EXPECT_DOUBLE_EQ(parse_quantity("66.7 tex", Dimension::linear_density), 66.7e-6);
  EXPECT_DOUBLE_EQ(parse_quantity("44 1/in", Dimension::per_length), 44 / 0.0254);
  EXPECT_DOUBLE_EQ(parse_quantity("86.9 GPa", Dimension::pressure), 86.9e9);
  EXPECT_EQ(parse_quantity("2460 kg/m^3", Dimension::density), 2460);
  EXPECT_DOUBLE_EQ(parse_quantity("2.46 g/cm^3", Dimension::density), 2460);
  EXPECT_EQ(parse_quantity("4.5 m/s", Dimension::speed), 4.5);
  EXPECT_EQ(parse_quantity("2 ms", Dimension::time), 0.002);
  EXPECT_EQ(parse_quantity("100 1/s", Dimension::per_time), 100);
  EXPECT_EQ(parse_quantity("0.2", Dimension::number), 0.2);
}

// Solid areas of S2 glass, density 2460 kg/m^3, to one unit of the fourth digit (they are printed cut off, not rounded).
TEST(Units, YieldGivesThePublishedAreas) {
  EXPECT_NEAR(parse_quantity("125 yield", Dimension::linear_density) / 2460, 1.613e-6, 0.001e-6);
  EXPECT_NEAR(parse_quantity("250 yield", Dimension::linear_density) / 2460, 8.065e-7, 0.001e-7);
  EXPECT_NEAR(parse_quantity("1250 yield", Dimension::linear_density) / 2460, 1.613e-7, 0.001e-7);
  EXPECT_DOUBLE_EQ(parse_quantity("125 yield", Dimension::linear_density), 0.45359237 / (125 * 0.9144));
}

TEST(Units, DenierIsGramsPerNineKilometers) {
  EXPECT_DOUBLE_EQ(parse_quantity("600 denier", Dimension::linear_density), 0.6 / 9000);
  EXPECT_DOUBLE_EQ(parse_quantity("9 denier", Dimension::linear_density), parse_quantity("1 tex", Dimension::linear_density));
  EXPECT_DOUBLE_EQ(parse_quantity("10 dtex", Dimension::linear_density), parse_quantity("1 tex", Dimension::linear_density));
}

TEST(Units, SpacingAndExponentsAreFree) {
  EXPECT_EQ(parse_quantity("  3N ", Dimension::force), 3);
  EXPECT_EQ(parse_quantity("+3.0e0  N", Dimension::force), 3);
  EXPECT_EQ(parse_quantity("-.5 N", Dimension::force), -0.5);
  EXPECT_EQ(parse_quantity("1e-3 m", Dimension::length), 1e-3);
}

TEST(Units, WrongDimensionSaysWhatWasExpected) {
  EXPECT_THAT([] { parse_quantity("3 mm", Dimension::force); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("is a length"), HasSubstr("expected a force (N, "))));
  EXPECT_THAT([] { parse_quantity("3 N", Dimension::number); }, ThrowsMessage<std::invalid_argument>(HasSubstr("expected a number")));
  EXPECT_THAT([] { parse_quantity("3", Dimension::time); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("has no unit"), HasSubstr("expected a time (s, "))));
  EXPECT_THAT([] { parse_quantity("3 furlongs", Dimension::length); },
              ThrowsMessage<std::invalid_argument>(AllOf(HasSubstr("unknown unit \"furlongs\""), HasSubstr("expected a length"))));
}

TEST(Units, WhatIsNoFiniteNumberIsRefused) {
  for (const char* text : {"", " ", "m", "nan m", "inf m", "-inf m", "infinity", "--1 m", ". m", "1e999 m", "one m"}) {
    EXPECT_THROW(parse_quantity(text, Dimension::length), std::invalid_argument) << text;
  }
  EXPECT_THROW(parse_quantity("0 yield", Dimension::linear_density), std::invalid_argument);
  EXPECT_THROW(parse_quantity("1e308 GPa", Dimension::pressure), std::invalid_argument);
}

TEST(Units, SiUnitOfEachDimension) {
  EXPECT_EQ(si_unit(Dimension::number), "");
  EXPECT_EQ(si_unit(Dimension::linear_density), "kg/m");
  for (const Dimension dimension :
       {Dimension::length, Dimension::per_length, Dimension::linear_density, Dimension::density, Dimension::pressure, Dimension::force,
        Dimension::bending_stiffness, Dimension::speed, Dimension::time, Dimension::per_time}) {
    EXPECT_EQ(parse_quantity("7 " + std::string(si_unit(dimension)), dimension), 7);
  }
}

}  // namespace
}  // namespace weave
