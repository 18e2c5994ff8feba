#include "weave/case.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <ostream>
#include <sstream>

namespace weave {
namespace {

using testing::HasSubstr;

// Line numbers in the tests below count in this text; its first line is line 1.
const std::string plain = R"(name = "plain"
[fabric]
layers = 1
[yarns.glass]
linear_density = "68 tex"
density = "2540 kg/m^3"
youngs_modulus = "72.4 GPa"
[[section]]
yarn = "glass"
dent = 0
matrix = ["+", "-"]
[[section]]
yarn = "glass"
dent = 1
matrix = ["-", "+"]
[weft]
yarn = "glass"
[loom]
length = "0.2 in"
dent_width = "0.6 mm"
reed_bar_radius = "0.06 mm"
[take_up]
rate = "34 1/in"
)";

std::string replaced(const std::string& from, const std::string& to) {
  const auto at = plain.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  std::string text = plain;
  return text.replace(at, from.size(), to);
}

std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    parse_case(text, "plain.toml", overrides);
  } catch (const CaseError& error) {
    return error.what();
  }
  return "no error";
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) + 1;
}

/// cases/README.md, which tells users what they may write.
std::string reference() {
  std::ifstream in(std::filesystem::path(HEDDLE_CASES_DIR) / "README.md");
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(CaseReference, ItsExampleIsComplete) {
  const std::string text = reference();
  const auto begin = text.find("```toml\n") + 8;
  const Case c = parse_case(text.substr(begin, text.find("```", begin) - begin), "README.md");
  EXPECT_EQ(c.name, "plain_glass");
  EXPECT_EQ(c.matrix(), weaving_matrix_from_rows({"+-", "-+"}));
}

TEST(CaseReference, NamesEveryKey) {
  const std::string text = reference();
  Case c = load_case(std::filesystem::path(HEDDLE_CASES_DIR) / "example_2" / "case.toml");  // one with all that may be left out
  c.materials["own"] = {};
  c.matrix_material = {3e9, 0.3};
  std::istringstream lines(to_toml(c));
  int keys = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto equals = line.find(" = ");
    if (line.empty() || line.front() == '#' || line.front() == '[' || equals == std::string::npos || line.front() == ' ') continue;
    EXPECT_THAT(text, HasSubstr("`" + line.substr(0, equals) + "`")) << line;
    ++keys;
  }
  EXPECT_GT(keys, 60);
  for (const char* other : {"positions", "yarn", "height_ratio", "dents_per_length", "rate"})
    EXPECT_THAT(text, HasSubstr(std::string("`") + other + "`"));
}

TEST(Case, DefaultsFollowTheLoom) {
  const Case c = parse_case(plain, "plain.toml");
  EXPECT_EQ(c.name, "plain");
  EXPECT_EQ(c.title, "plain");
  EXPECT_EQ(c.columns, 2);
  EXPECT_EQ(c.picks_per_cell(), 2);
  EXPECT_EQ(c.warps(), 2);
  EXPECT_EQ(c.dents(), 2);
  EXPECT_DOUBLE_EQ(c.cell_width(), 1.2e-3);
  EXPECT_DOUBLE_EQ(c.cell_length(), 2 * 0.0254 / 34);
  EXPECT_DOUBLE_EQ(c.loom.height, 0.7 * 0.00508);
  EXPECT_DOUBLE_EQ(c.insertion.distance, 0.45 * 0.00508);
  EXPECT_DOUBLE_EQ(c.beat_up.travel, 0.7 * 0.00508);
  EXPECT_DOUBLE_EQ(c.beat_up.return_time, 2 * 0.7 * 0.00508 / 4.5);
  EXPECT_EQ(c.sections[0].tension, 3);
  EXPECT_EQ(c.weft.yarn_of_layer, std::vector<std::string>{"glass"});
  EXPECT_EQ(c.matrix(), weaving_matrix_from_rows({"+-", "-+"}));
}

TEST(Case, FibersShareTheSolidArea) {
  const YarnType yarn = parse_case(plain, "plain.toml").yarns.at("glass");
  EXPECT_EQ(yarn.fibers, 7);
  EXPECT_DOUBLE_EQ(yarn.fiber_area() * 7, 68e-6 / 2540);
  EXPECT_DOUBLE_EQ(std::numbers::pi * yarn.fiber_radius() * yarn.fiber_radius() * 0.82, yarn.fiber_area());
}

TEST(Case, SectionTensionOverridesTheLoomsTension) {
  const Case c = parse_case(replaced("dent = 1", "dent = 1\ntension = \"50 cN\""), "plain.toml");
  EXPECT_EQ(c.sections[0].tension, 3);
  EXPECT_EQ(c.sections[1].tension, 0.5);
}

TEST(Case, DentsPerLengthAndHeightRatio) {
  const Case c = parse_case(replaced("dent_width = \"0.6 mm\"", "dents_per_length = \"40 1/in\"\nheight_ratio = 0.5"), "plain.toml");
  EXPECT_DOUBLE_EQ(c.loom.dent_width, 0.0254 / 40);
  EXPECT_DOUBLE_EQ(c.loom.height, 0.5 * 0.00508);
}

struct Mistake {
  const char* what;
  std::string from, to;  // change of the plain case
  std::string message;   // what the error must read
};

void PrintTo(const Mistake& mistake, std::ostream* stream) {
  *stream << mistake.message;
}

class CaseMistake : public testing::TestWithParam<Mistake> {};

TEST_P(CaseMistake, IsNamedWithFileLineKeyValueAndBound) {
  const std::string error = error_of(replaced(GetParam().from, GetParam().to));
  EXPECT_THAT(error, HasSubstr("plain.toml:" + GetParam().message));
  EXPECT_EQ(lines_of(error), 1u) << error;
}

const Mistake mistakes[] = {
    {"UnknownKey", "length = \"0.2 in\"", "lenght = 1", "19: loom.lenght = 1: unknown key; the nearest known one is loom.length"},
    {"UnknownTable", "[take_up]", "[beatup]\n[take_up]", "22: beatup = {table}: unknown key; the nearest known one is beat_up"},
    {"MissingKey", "density = \"2540 kg/m^3\"\n", "", "4: yarns.glass.density = (missing): missing; expected a density (kg/m^3"},
    {"MissingTable", "[take_up]\nrate = \"34 1/in\"\n", "", "1: take_up.length = (missing): missing; give it or take_up.rate"},
    {"MissingPattern", "matrix = [\"-\", \"+\"]\n", "", "12: section.1.positions = (missing): missing; give it or section.1.matrix"},
    {"MissingDent", "dent = 1\n", "", "12: section.1.dent = (missing): missing; expected an integer"},
    {"WrongType", "layers = 1", "layers = 1.0", "3: fabric.layers = 1.0: wrong type; expected an integer"},
    {"WrongTypeOfQuantity", "\"0.2 in\"", "true", "19: loom.length = true: wrong type; expected a length (m, "},
    {"WrongTypeOfTable", "[take_up]\n", "beat_up = 3\n[take_up]\n", "22: loom.beat_up = 3: unknown key"},
    {"WrongDimension", "\"0.2 in\"", "\"0.2 N\"", "19: loom.length = \"0.2 N\": is a force; expected a length (m, "},
    {"NoUnit", "\"0.2 in\"", "\"0.2\"", "19: loom.length = \"0.2\": has no unit; expected a length (m, "},
    {"NotFinite", "\"0.2 in\"", "nan", "19: loom.length = nan: must be finite"},
    {"Infinite", "\"0.6 mm\"", "inf", "20: loom.dent_width = inf: must be finite"},
    {"ZeroLength", "\"0.2 in\"", "0", "19: loom.length = 0: must be > 0 m and <= 10 m"},
    {"NegativeLength", "\"0.6 mm\"", "\"-0.6 mm\"", "20: loom.dent_width = \"-0.6 mm\": must be > 0 m and <= 10 m"},
    {"ModulusOfAnotherUnit", "\"72.4 GPa\"", "\"72.4 MPa\"",
     "4: yarns.glass = {table}: would be stretched by 155 % under 3 N with a modulus of 7.24e+07 Pa; must be <= 50 %"},
    {"UnknownMaterial", "[[section]]", "material = \"hemp\"\n[[section]]",
     "8: yarns.glass.material = \"hemp\": unknown material; known ones: e_glass, s2_glass, aramid, carbon, and those of tables "
     "[material.NAME]"},
    {"MaterialWithoutConstant", "[weft]", "[material.hemp]\ne1 = \"30 GPa\"\ne2 = \"5 GPa\"\nnu12 = 0.3\nnu23 = 0.3\n[weft]",
     "16: material.hemp.g12 = (missing): missing; expected a pressure"},
    {"MaterialWithoutEnergy", "[weft]", "[material.hemp]\ne1 = \"8 GPa\"\ne2 = \"8 GPa\"\ng12 = 1e9\nnu12 = 0.8\nnu23 = 0.5\n[weft]",
     "20: material.hemp.nu12 = 0.8: must be within +-sqrt((1 - nu23) e1 / (2 e2)) = 0.5"},
    {"MaterialOfKnownName", "[weft]", "[material.carbon]\ne1 = 1e9\ne2 = 1e9\ng12 = 1e9\nnu12 = 0\nnu23 = 0\n[weft]",
     "16: material.carbon = {table}: is the name of a known fiber; choose another"},
    {"MatrixThatDoesNotShrink", "[weft]", "[matrix]\ne = \"3 GPa\"\nnu = 0.5\n[weft]", "18: matrix.nu = 0.5: must be > -1 and < 0.5"},
    {"MatrixUnknownKey", "[weft]", "[matrix]\ne = \"3 GPa\"\nnu = 0.3\ng = 1\n[weft]", "19: matrix.g = 1: unknown key"},
    {"EmptyYarnName", "[weft]\nyarn = \"glass\"", "[weft]\nyarn = \"\"", "17: weft.yarn = \"\": must not be empty"},
    {"HugeHeight", "length = \"0.2 in\"", "length = \"0.2 in\"\nheight_ratio = 1e6",
     "20: loom.height_ratio = 1000000.0: makes the loom 5080 m high; must be <= 10 m"},
    {"NegativeFrictionWithin", "density = \"2540 kg/m^3\"", "density = 2540\nfriction_within = -0.1",
     "7: yarns.glass.friction_within = -0.1: must be >= 0 and <= 10"},
    {"NegativeFriction", "layers = 1", "layers = 1\nfriction = -0.1", "4: fabric.friction = -0.1: must be >= 0 and <= 10"},
    {"ZeroTension", "length = \"0.2 in\"", "length = \"0.2 in\"\ntension = 0", "20: loom.tension = 0: must be > 0 N"},
    {"ZeroLayers", "layers = 1", "layers = 0", "3: fabric.layers = 0: must be >= 1 and <= 10000"},
    {"Packing", "density = \"2540 kg/m^3\"", "density = 2540\npacking = 1.1", "7: yarns.glass.packing = 1.1: must be > 0 and <= 1"},
    {"Fibers", "density = \"2540 kg/m^3\"", "density = 2540\nfibers = 8", "7: yarns.glass.fibers = 8: must be 1, 3, 5 or a centred hexa"},
    {"Contact", "[take_up]", "[numerics]\ncontact = \"bead\"\n[take_up]",
     "23: numerics.contact = \"bead\": must be one of: \"line\", \"node\""},
    {"InsertionOrder", "layers = 1", "layers = 1\ninsertion_order = \"bottom_first\"",
     "4: fabric.insertion_order = \"bottom_first\": must be one of: \"top_first\", \"alternating\""},
    {"AlternatingColumns", "layers = 1", "layers = 2\ninsertion_order = \"alternating\"",
     "4: fabric.insertion_order = \"alternating\": needs an even number of weft columns in the cell, which has 1"},
    {"BothPatterns", "matrix = [\"-\", \"+\"]", "matrix = [\"-\", \"+\"]\npositions = [[0, 1]]",
     "16: section.1.positions = [ [ 0, 1 ] ]: contradicts section.1.matrix: give one of the two"},
    {"BothTakeUps", "rate = \"34 1/in\"", "rate = \"34 1/in\"\nlength = 1e-3",
     "24: take_up.length = 0.001: contradicts take_up.rate: give one of the two"},
    {"PicksDiffer", "matrix = [\"-\", \"+\"]", "matrix = [\"-\", \"+\", \"-\"]",
     "15: section.1.matrix = [ '-', '+', '-' ]: has 3 picks; must have 2 (section.0.matrix)"},
    {"ColumnsContradict", "layers = 1", "layers = 1\ncolumns = 2\n[[section]]\nyarn = \"glass\"\ndent = 2\npositions = [[0, 1, 1]]",
     "8: section.0.positions = [ [ 0, 1, 1 ] ]: has 3 picks; must have 2 (fabric.layers * fabric.columns = 1 * 2)"},
    {"PositionOutsideLayers", "matrix = [\"-\", \"+\"]", "positions = [\n[0, 1],\n[0, 2]]",
     "17: section.1.positions[1][1] = 2: must be an integer from 0 to 1 (fabric.layers)"},
    {"PositionNoInteger", "matrix = [\"-\", \"+\"]", "positions = [[0, \"up\"]]",
     "15: section.1.positions[0][1] = \"up\": must be an integer from 0 to 1"},
    {"PositionsRagged", "matrix = [\"-\", \"+\"]", "positions = [\n[0, 1],\n[0]]",
     "17: section.1.positions[1] = [ 0 ]: has 1 entries, the first warp has 2"},
    {"MatrixSign", "matrix = [\"-\", \"+\"]", "matrix = [\"-\", \"x\"]",
     "15: section.1.matrix = [ '-', 'x' ]: matrix[1] = \"x\": only '+' (up), '-' (down)"},
    {"UnknownYarn", "yarn = \"glass\"\ndent = 1", "yarn = \"glas\"\ndent = 1",
     "13: section.1.yarn = \"glas\": unknown yarn \"glas\"; known ones: glass"},
    {"WeftYarn", "[weft]\nyarn = \"glass\"", "[weft]\nyarn_of_layer = [\"glass\", \"glass\"]",
     "17: weft.yarn_of_layer = [ 'glass', 'glass' ]: names 2 yarns; must name 1 (fabric.layers)"},
    {"DentGap", "dent = 1", "dent = 2", "14: section.1.dent = 2: must be <= 1: dents count from 0 without gaps, and dent 1 has no section"},
    {"NegativeDent", "dent = 1", "dent = -1", "14: section.1.dent = -1: must be >= 0 and <= 9999"},
    {"NoShed", "matrix = [\"-\", \"+\"]", "matrix = [\"+\", \"+\"]",
     "11: section.0.matrix = [ '+', '-' ]: at pick 0 (0-based) all 2 warps of the fabric are up: no shed opens"},
    {"CellBehindTheCloth", "layers = 1", "layers = 1\ncolumns_behind_fell = 3", "4: fabric.columns_behind_fell = 3: must be <= 2"},
    {"FlagsDoNotDivide", "rate = \"34 1/in\"", "rate = \"34 1/in\"\nflags = 2", "24: take_up.flags = 2: must divide fabric.layers = 1"},
    {"InsertionBehindReed", "[take_up]", "[insertion]\ndistance = \"3.6 mm\"\n[take_up]",
     "23: insertion.distance = \"3.6 mm\": must be < 0.003556 m (beat_up.travel)"},
    {"TravelBeyondHeddles", "[take_up]", "[beat_up]\ntravel = \"6 mm\"\n[take_up]",
     "23: beat_up.travel = \"6 mm\": must be <= 0.00508 m (loom.length)"},
    {"ReedBars", "\"0.06 mm\"", "\"0.3 mm\"", "21: loom.reed_bar_radius = \"0.3 mm\": must be < 0.0003 m (half of loom.dent_width)"},
    {"WarpsDoNotFit", "\"0.6 mm\"", "\"0.16 mm\"",
     "20: loom.dent_width = \"0.16 mm\": the warps of dent 0 can not fit: the dent is 0.00016 m"},
};

INSTANTIATE_TEST_SUITE_P(Plain, CaseMistake, testing::ValuesIn(mistakes), [](const auto& parameter) { return parameter.param.what; });

TEST(Case, LoomLowerThanTwiceTheClothNamesBoth) {
  const std::string error = error_of(replaced("length = \"0.2 in\"", "length = \"0.2 in\"\nheight = \"0.1 mm\""));
  const double thickness = 68e-6 / 2540 / 0.6e-3 + 68e-6 / 2540 * 34 / 0.0254;
  EXPECT_THAT(error, HasSubstr("plain.toml:20: loom.height = \"0.1 mm\": the height 0.0001 m must be >= "));
  EXPECT_THAT(error, HasSubstr(fmt::format("{:.6g} m, twice the cloth's solid thickness {:.6g} m", 2 * thickness, thickness)));
}

TEST(Case, LayersMustDividePicks) {
  const std::string error = error_of(replaced("layers = 1", "layers = 3"));
  EXPECT_THAT(error, HasSubstr("plain.toml:11: section.0.matrix = [ '+', '-' ]: has 2 picks; must be a multiple of fabric.layers = 3"));
}

TEST(Case, WholeSectionMayBeUpOrDown) {
  const Case c = parse_case(replaced("matrix = [\"+\", \"-\"]", "matrix = [\"+ +\", \"- -\"]"), "plain.toml");
  EXPECT_EQ(c.warps(), 3);
}

TEST(Case, AllMistakesComeAtOnceInTheOrderOfTheFile) {
  std::string text = replaced("layers = 1", "layers = 0");
  text.replace(text.find("\"0.2 in\""), 8, "-1");
  text.replace(text.find("2540"), 4, "-254");
  EXPECT_EQ(error_of(text),
            "plain.toml:3: fabric.layers = 0: must be >= 1 and <= 10000\n"
            "plain.toml:6: yarns.glass.density = \"-254 kg/m^3\": must be > 0 kg/m^3\n"
            "plain.toml:19: loom.length = -1: must be > 0 m and <= 10 m");
}

TEST(Case, SyntaxErrorsCarryFileAndLine) {
  EXPECT_THAT(error_of(replaced("layers = 1", "layers = ")), HasSubstr("plain.toml:3: not TOML: "));
  EXPECT_THAT(error_of(replaced("layers = 1", "layers = 1\nlayers = 2")), HasSubstr("plain.toml:4: not TOML: "));
  EXPECT_THAT(error_of(""), HasSubstr("plain.toml:1: name = (missing)"));
}

TEST(Case, OverridesReplaceTheFilesValues) {
  const Case c = parse_case(plain, "plain.toml",
                            {"loom.tension=2 N", "yarns.glass.fibers = 19", "numerics.contact=node", "section.1.tension=\"1 N\"",
                             "beat_up.enabled=false", "take_up.length=0.8 mm", "title=a = b"});
  EXPECT_EQ(c.loom.tension, 2);
  EXPECT_EQ(c.yarns.at("glass").fibers, 19);
  EXPECT_EQ(c.numerics.contact, "node");
  EXPECT_EQ(c.sections[0].tension, 2);
  EXPECT_EQ(c.sections[1].tension, 1);
  EXPECT_FALSE(c.beat_up.enabled);
  EXPECT_EQ(c.take_up.length, 0.8e-3);
  EXPECT_EQ(c.title, "a = b");
}

TEST(Case, AccuracySetsElementsAndSteps) {
  const NumericsSpec defaults;
  const NumericsSpec draft = parse_case(plain, "plain.toml", accuracy_overrides("draft")).numerics;
  const NumericsSpec normal = parse_case(plain, "plain.toml", accuracy_overrides("normal")).numerics;
  const NumericsSpec reference = parse_case(plain, "plain.toml", accuracy_overrides("reference")).numerics;
  EXPECT_EQ(normal.element_length, defaults.element_length);
  EXPECT_EQ(normal.safety, defaults.safety);
  EXPECT_GT(draft.element_length, normal.element_length);
  EXPECT_LT(reference.element_length, normal.element_length);
  EXPECT_LT(reference.safety, normal.safety);
  EXPECT_THROW(accuracy_overrides("fine"), std::invalid_argument);
}

TEST(Case, MaterialsAreWrittenOnlyWhereGiven) {
  const std::string without = to_toml(parse_case(plain, "plain.toml"));
  for (const char* key : {"material", "[matrix]"}) EXPECT_THAT(without, Not(HasSubstr(key)));
  const Case c = parse_case(plain, "plain.toml", {"yarns.glass.material=carbon", "matrix.e=4 GPa", "matrix.nu=0.3"});
  EXPECT_EQ(c.yarns.at("glass").material, "carbon");
  ASSERT_TRUE(c.matrix_material);
  EXPECT_EQ(c.matrix_material->e, 4e9);
  EXPECT_EQ(c.matrix_material->nu, 0.3);
}

TEST(Case, WrongOverridesAreMarked) {
  EXPECT_EQ(error_of(plain, {"loom.tension=2 m"}).substr(0, 60), "plain.toml:(override): loom.tension = \"2 m\": is a length; ex");
  EXPECT_EQ(error_of(plain, {"loom.tention=2"}),
            "plain.toml:(override): loom.tention = 2: unknown key; the nearest known one is loom.tension");
  EXPECT_EQ(error_of(plain, {"looom.tension=2"}), "plain.toml:(override): looom = {table}: unknown key; the nearest known one is loom");
  EXPECT_THAT(error_of(plain, {"loom.tension"}), HasSubstr("(override): loom.tension = (missing): an override must read key.path=value"));
  EXPECT_THAT(error_of(plain, {"name.x=1"}), HasSubstr("(override): name.x = 1: the key's path does not lead to a table"));
  EXPECT_THAT(error_of(plain, {"section.2.dent=1"}), HasSubstr("(override): section.2.dent = 1: the key's path does not lead"));
  EXPECT_THAT(error_of(plain, {"section.0.positions=[[0,2]]"}), HasSubstr("plain.toml:(override): section.0.positions[0][1] = 2: must be"));
}

TEST(Case, UnreadableFileIsNamed) {
  const auto message = [](const std::string& file) {
    try {
      load_case(file);
    } catch (const CaseError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message("no_such_case.toml"), "no_such_case.toml: can not be read as a case file");
  EXPECT_THAT(message(HEDDLE_CASES_DIR), HasSubstr("can not be read as a case file"));
}

void expect_same(const Case& a, const Case& b) {
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.title, b.title);
  ASSERT_EQ(a.yarns.size(), b.yarns.size());
  for (const auto& [name, yarn] : a.yarns) {
    const YarnType& other = b.yarns.at(name);
    EXPECT_EQ(yarn.name, other.name);
    EXPECT_EQ(yarn.linear_density, other.linear_density);
    EXPECT_EQ(yarn.density, other.density);
    EXPECT_EQ(yarn.youngs_modulus, other.youngs_modulus);
    EXPECT_EQ(yarn.transverse_modulus, other.transverse_modulus);
    EXPECT_EQ(yarn.packing, other.packing);
    EXPECT_EQ(yarn.compression_factor, other.compression_factor);
    EXPECT_EQ(yarn.bending_stiffness, other.bending_stiffness);
    EXPECT_EQ(yarn.friction_within, other.friction_within);
    EXPECT_EQ(yarn.fibers, other.fibers);
    EXPECT_EQ(yarn.material, other.material);
  }
  ASSERT_EQ(a.sections.size(), b.sections.size());
  for (std::size_t i = 0; i < a.sections.size(); ++i) {
    EXPECT_EQ(a.sections[i].yarn, b.sections[i].yarn);
    EXPECT_EQ(a.sections[i].dent, b.sections[i].dent);
    EXPECT_EQ(a.sections[i].tension, b.sections[i].tension);
    EXPECT_EQ(a.sections[i].matrix, b.sections[i].matrix);
  }
  EXPECT_EQ(a.weft.yarn_of_layer, b.weft.yarn_of_layer);
  EXPECT_EQ(a.weft.length_coefficient, b.weft.length_coefficient);
  EXPECT_EQ(a.layers, b.layers);
  EXPECT_EQ(a.columns, b.columns);
  EXPECT_EQ(a.insertion_order, b.insertion_order);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.kept_cells, b.kept_cells);
  EXPECT_EQ(a.columns_behind_fell, b.columns_behind_fell);
  EXPECT_EQ(a.friction, b.friction);
  EXPECT_EQ(a.settle_time, b.settle_time);
  EXPECT_EQ(a.loom.length, b.loom.length);
  EXPECT_EQ(a.loom.height, b.loom.height);
  EXPECT_EQ(a.loom.dent_width, b.loom.dent_width);
  EXPECT_EQ(a.loom.tension, b.loom.tension);
  EXPECT_EQ(a.loom.reed_bar_radius, b.loom.reed_bar_radius);
  EXPECT_EQ(a.insertion.distance, b.insertion.distance);
  EXPECT_EQ(a.insertion.time, b.insertion.time);
  EXPECT_EQ(a.beat_up.enabled, b.beat_up.enabled);
  EXPECT_EQ(a.beat_up.travel, b.beat_up.travel);
  EXPECT_EQ(a.beat_up.top_speed, b.beat_up.top_speed);
  EXPECT_EQ(a.beat_up.dwell, b.beat_up.dwell);
  EXPECT_EQ(a.beat_up.return_time, b.beat_up.return_time);
  EXPECT_EQ(a.beat_up.return_delay, b.beat_up.return_delay);
  EXPECT_EQ(a.shedding.time, b.shedding.time);
  EXPECT_EQ(a.take_up.length, b.take_up.length);
  EXPECT_EQ(a.take_up.flags, b.take_up.flags);
  EXPECT_EQ(a.take_up.time, b.take_up.time);
  EXPECT_EQ(a.numerics.element_length, b.numerics.element_length);
  EXPECT_EQ(a.numerics.contact, b.numerics.contact);
  EXPECT_EQ(a.numerics.integrator, b.numerics.integrator);
  EXPECT_EQ(a.numerics.time_step, b.numerics.time_step);
  EXPECT_EQ(a.numerics.safety, b.numerics.safety);
  EXPECT_EQ(a.numerics.damping, b.numerics.damping);
  EXPECT_EQ(a.numerics.axial_damping, b.numerics.axial_damping);
  EXPECT_EQ(a.numerics.skin, b.numerics.skin);
  EXPECT_EQ(a.numerics.outer_skin, b.numerics.outer_skin);
  ASSERT_EQ(a.materials.size(), b.materials.size());
  for (const auto& [name, material] : a.materials) {
    EXPECT_EQ(material.e1, b.materials.at(name).e1);
    EXPECT_EQ(material.e2, b.materials.at(name).e2);
    EXPECT_EQ(material.g12, b.materials.at(name).g12);
    EXPECT_EQ(material.nu12, b.materials.at(name).nu12);
    EXPECT_EQ(material.nu23, b.materials.at(name).nu23);
  }
  ASSERT_EQ(a.matrix_material.has_value(), b.matrix_material.has_value());
  if (a.matrix_material) {
    EXPECT_EQ(a.matrix_material->e, b.matrix_material->e);
    EXPECT_EQ(a.matrix_material->nu, b.matrix_material->nu);
  }
  EXPECT_EQ(a.output.checkpoint_interval, b.output.checkpoint_interval);
  EXPECT_EQ(a.output.history_interval, b.output.history_interval);
}

void expect_round_trip(const Case& c) {
  const std::string text = to_toml(c);
  const Case again = parse_case(text, "resolved.toml");
  expect_same(c, again);
  EXPECT_EQ(to_toml(again), text);
}

TEST(Case, FrictionWithinAYarnIsThatOfTheFabricUnlessGiven) {
  const std::string with_friction = replaced("layers = 1", "layers = 1\nfriction = 0.3");
  EXPECT_EQ(parse_case(with_friction, "plain.toml").yarns.at("glass").friction_within, 0.3);
  EXPECT_EQ(parse_case(with_friction, "plain.toml", {"yarns.glass.friction_within=0.6"}).yarns.at("glass").friction_within, 0.6);
}

TEST(Case, EveryKeyRoundTripsToTheBit) {
  // Every entry away from its default and most of them without a short decimal.
  Case c = parse_case(plain, "plain.toml");
  c.title = "quotes \" and \\ and a\ttab, \xc3\xa9";
  YarnType odd{"odd name.1", 1 / 3e4, 1 / 3e-4, 1e11 / 3, 1e9 / 3, 1 / 3.0, 1e-3 / 3, 1e-12 / 3, 37, "odd material", 2 / 3.0};
  c.materials["odd material"] = {1e11 / 3, 1e10 / 3, 1e10 / 7, 1 / 3.0, 1 / 7.0};
  c.matrix_material = {1e10 / 3, 1 / 3.0};
  c.yarns[odd.name] = odd;
  c.sections[0] = {odd.name, 1, 0.1 + 0.2, weaving_matrix_from_rows({"+-", "-+", "--", "++"})};
  c.sections[1] = {"glass", 0, 1 / 7.0, weaving_matrix_from_rows({"-", "+", "+", "-"})};
  c.layers = 2;
  c.columns = 2;
  c.insertion_order = InsertionOrder::alternating;
  c.weft = {{"glass", odd.name}, 1.0 + 1e-15};
  c.cells = 5;
  c.kept_cells = 2;
  c.columns_behind_fell = 3;
  c.friction = 1 / 3.0;
  c.settle_time = 1e-3 / 3;
  c.loom = {0.1 / 3, 0.1 / 7, 0.1 / 13, 10 / 3.0, 0.001 / 3};
  c.insertion = {0.01 / 3, 0.001 / 7};
  c.beat_up = {false, 0.1 / 9, 10 / 7.0, 1e-4 / 3, 1e-2 / 7, 1 / 3.0};
  c.shedding = {1e-2 / 3};
  c.take_up = {1e-2 / 3, 2, 1e-2 / 7};
  c.numerics = {1.1, "node", "explicit", 1e-7 / 3, 0.7, 100 / 3.0, 0.1 / 3, 0.2, 0.9};
  c.output = {100 / 3.0, 1e-5 / 3};
  expect_round_trip(c);
}

class ShippedCase : public testing::TestWithParam<std::string> {};

Case shipped(const std::string& name) {
  return load_case(std::filesystem::path(HEDDLE_CASES_DIR) / name / "case.toml");
}

TEST_P(ShippedCase, LoadsAndRoundTrips) {
  const Case c = shipped(GetParam());
  EXPECT_EQ(c.name, GetParam());
  expect_round_trip(c);
}

INSTANTIATE_TEST_SUITE_P(Cases, ShippedCase,
                         testing::Values("example_1", "example_1b", "example_2", "kevlar_km2_706", "eglass_7628", "twill_2_2", "satin_8",
                                         "three_warp", "chalmers_3d_orthogonal"),
                         [](const auto& parameter) { return parameter.param; });

TEST(ShippedCases, ExampleOne) {
  const Case c = shipped("example_1");
  EXPECT_EQ(c.picks_per_cell() * c.cells, 64);
  EXPECT_EQ(c.warps(), 14);
  EXPECT_DOUBLE_EQ(c.cell_width(), 7.8e-3);
  EXPECT_DOUBLE_EQ(c.cell_length(), 10.16e-3);
  EXPECT_DOUBLE_EQ(c.beat_up.travel, 0.01778);
  EXPECT_DOUBLE_EQ(c.loom.height, 0.01778);
  EXPECT_EQ(c.take_up.flags, 2);
}

TEST(ShippedCases, ExampleOneBIsTheFabricOfTheSource) {
  const Case c = shipped("example_1b");
  EXPECT_EQ(rows_of(c.sections[0].matrix)[1], "+ + - - -");
  EXPECT_EQ(rows_of(c.matrix())[0], "+ - - - - - - - - -");
}

TEST(ShippedCases, ExampleTwo) {
  const Case c = shipped("example_2");
  EXPECT_DOUBLE_EQ(c.cell_length(), 13.54e-3);
  EXPECT_DOUBLE_EQ(c.cell_width(), 2 * 0.0254 / 8.5);
  EXPECT_EQ(c.warps(), 12);
  EXPECT_DOUBLE_EQ(c.warp_tension(), 2 * 2 + 10 * 10);  // two weavers, ten stuffers
  EXPECT_EQ(c.picks_per_cell(), 24);
}

// Areal mass without crimp from yarns and spacing: validation.md gives 208.8 g/m^2 for style 7628 and 180 g/m^2 measured for Kevlar 706.
double areal_mass(const Case& c) {
  double mass = 0;
  for (const WarpSection& section : c.sections) {
    mass += static_cast<double>(section.matrix.cols()) * c.yarns.at(section.yarn).linear_density / c.cell_width();
  }
  for (const std::string& yarn : c.weft.yarn_of_layer) mass += c.yarns.at(yarn).linear_density / c.take_up.length;
  return mass;
}

TEST(ShippedCases, ArealMasses) {
  EXPECT_NEAR(areal_mass(shipped("eglass_7628")), 0.2088, 0.0001);
  EXPECT_NEAR(areal_mass(shipped("kevlar_km2_706")), 0.180, 0.002);
}

TEST(ShippedCases, SatinBindsEachWarpAndEachPickOnce) {
  const WeavingMatrix matrix = shipped("satin_8").matrix();
  ASSERT_EQ(matrix.rows(), 8);
  for (int pick = 0; pick < 8; ++pick) {
    EXPECT_EQ(matrix.row(pick).sum(), 6);
    EXPECT_EQ(matrix(pick, (3 * pick) % 8), -1);
  }
}

TEST(ShippedCases, TwillStepsByOneWarpAPick) {
  EXPECT_EQ(rows_of(shipped("twill_2_2").matrix()), (std::vector<std::string>{"+ + - -", "- + + -", "- - + +", "+ - - +"}));
}

TEST(ShippedCases, ThreeWarpIsTheSourcesMatrix) {
  EXPECT_EQ(rows_of(shipped("three_warp").matrix()), (std::vector<std::string>{"+ - -", "+ + -", "- - +", "- + +"}));
}

}  // namespace
}  // namespace weave
