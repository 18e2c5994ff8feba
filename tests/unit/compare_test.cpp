#include "relax/compare.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "heddle/compare_command.hpp"
#include "relax/relaxed_file.hpp"
#include "relax/report.hpp"
#include "scenes/cells.hpp"
#include "scenes/own_folder.hpp"
#include "weave/results.hpp"

namespace {

using namespace scenes;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using weave::Vec3;

constexpr double d = 1e-4;          ///< fiber diameter [m]
constexpr double round_off = 1e-9;  ///< of differences in diameters: coordinates of 1e-3 m to 1e-16, with room for sums
constexpr PlainWeave weave_of_seven{.fibers = 7, .pitch = 1e-3};

/// A state as if it had been read, its fibers where they are put.
relax::ComparedState state_of(const relax::Cell& cell, const Eigen::VectorXd& q) {
  relax::ComparedState s;
  s.cell = cell;
  s.q = q;
  s.snapshot = relax::snapshot_of(cell, q);
  s.measures = weave::measure_cell(s.snapshot);
  s.relaxed = true;
  s.certificate.converged = true;
  s.energy.contact = 1;
  return s;
}

relax::ComparedState posed(const PlainWeave& weave) {
  const PosedCell p = plain_weave_cell(weave, 0.5, 1);
  return state_of(p.cell, p.unknowns());
}

/// With the nodes of one yarn, or of all (-1), moved.
relax::ComparedState moved(const relax::ComparedState& s, const Vec3& by, int yarn = -1) {
  Eigen::VectorXd q = s.q;
  for (std::uint32_t i = 0; i < s.cell.nodes(); ++i) {
    if (yarn < 0 || s.cell.yarn[s.cell.fiber_of[i]] == yarn) q.segment<3>(3 * Eigen::Index{i}) += by;
  }
  return state_of(s.cell, q);
}

TEST(compare, translation_is_removed) {
  const relax::ComparedState a = posed(weave_of_seven);
  // Less than half a cell, so that the translation is the nearest of its images.
  const Vec3 by(0.31e-3, -0.77e-3, 0.2e-3);
  const relax::Difference difference = relax::difference(a, moved(a, by));
  EXPECT_LT((difference.shift - by).norm(), round_off * d);
  EXPECT_LT(difference.path.largest, round_off);
  EXPECT_LT(difference.width.largest, round_off);
  EXPECT_LT(difference.height.largest, round_off);
  ASSERT_TRUE(difference.fibers);
  EXPECT_LT(difference.fibers->largest, round_off);
}

TEST(compare, lengths_of_cells_are_drawn_out) {
  const relax::ComparedState a = posed(weave_of_seven);
  // As a cell of these lengths, and as one whose lengths are free and have come from elsewhere.
  for (const double from : {1.0, 1.02}) {
    relax::Cell cell = a.cell;
    cell.length_x = 1.03 * from * a.cell.length_x;
    cell.length_y = 0.98 * from * a.cell.length_y;
    Eigen::VectorXd q = a.q;
    for (Eigen::Index i = 0; i < 3 * Eigen::Index(cell.nodes()); i += 3)
      q.segment<3>(i) = q.segment<3>(i).cwiseProduct(Vec3(1.03, 0.98, 1));
    if (from != 1) {
      cell.load_x = cell.load_y = 1;
      q.conservativeResize(q.size() + 2);
      q.tail<2>() << (1 - from) * 1.03 * a.cell.length_x, (1 - from) * 0.98 * a.cell.length_y;
    }
    const relax::ComparedState b = state_of(cell, q);
    const relax::Difference difference = relax::difference(a, b);
    EXPECT_NEAR(difference.cell_length, 0.03, 1e-12);
    EXPECT_NEAR(difference.cell_width, -0.02, 1e-12);
    EXPECT_LT(difference.path.largest, round_off);
    EXPECT_LT(difference.fibers.value().largest, round_off);
    EXPECT_EQ(relax::verdict(a, b, difference), relax::Verdict::other_potential);
  }
}

TEST(compare, states_under_loads_differ_by_the_lengths_of_their_cells) {
  relax::ComparedState a = posed(weave_of_seven);
  a.cell.load_x = 1;
  a.q.conservativeResize(a.q.size() + 1);
  a.q.tail<1>().setZero();
  const auto longer = [&](double by, double energy) {
    Eigen::VectorXd q = a.q;
    for (Eigen::Index i = 0; i < 3 * Eigen::Index(a.cell.nodes()); i += 3) q[i] *= 1 + by / a.cell.length_x;
    q.tail<1>()[0] = by;
    relax::ComparedState b = state_of(a.cell, q);
    b.energy.contact = a.energy.contact + energy;
    return relax::verdict(a, b, relax::difference(a, b));
  };
  EXPECT_EQ(longer(0.005 * d, 1e-6), relax::Verdict::same);
  EXPECT_EQ(longer(0.02 * d, 0), relax::Verdict::different);  // by the work of the load
  EXPECT_EQ(longer(0.02 * d, 0.02 * d * *a.cell.load_x), relax::Verdict::same);
}

TEST(compare, periodic_images_of_a_yarn_are_the_same_yarn) {
  const relax::ComparedState a = posed(weave_of_seven);
  const relax::ComparedState b = moved(moved(a, {0, a.cell.length_y, 0}, 1), {-a.cell.length_x, 0, 0}, 3);
  const relax::Difference difference = relax::difference(a, b);
  EXPECT_LT(difference.path.largest, round_off);
  EXPECT_LT(difference.fibers.value().largest, round_off);
}

TEST(compare, one_yarn_of_four_that_is_lifted) {
  const relax::ComparedState a = posed(weave_of_seven);
  const relax::Difference difference = relax::difference(a, moved(a, {0, 0, 0.4 * d}, 1));
  // The mean lift of the four, 0.1 d, is removed: one is 0.3 d too high, three are 0.1 d too low.
  EXPECT_NEAR(difference.shift.z(), 0.1 * d, round_off * d);
  EXPECT_NEAR(difference.path.largest, 0.3, round_off);
  EXPECT_NEAR(difference.path.mean, (0.3 + 3 * 0.1) / 4, round_off);
  EXPECT_NEAR(difference.fibers.value().largest, 0.3, round_off);
  EXPECT_LT(difference.height.largest, round_off);
}

/// The state with every `step`-th of its fibers only, the last one first if `backward`.
relax::ComparedState taken_out_of(const relax::ComparedState& s, std::size_t step, bool backward) {
  relax::Cell cell = empty_cell(s.cell.length_x, s.cell.length_y);
  cell.types = s.cell.types;
  relax::finish_types(cell);
  std::vector<Vec3> x;
  for (std::size_t k = 0; k < s.cell.fibers(); k += step) {
    const std::size_t f = backward ? s.cell.fibers() - 1 - k : k;
    relax::CellFiber fiber;
    fiber.weft = s.cell.weft[f] != 0;
    fiber.type = s.cell.type[f];
    fiber.yarn = s.cell.yarn[f];
    fiber.place = s.cell.place[f];
    fiber.tension = s.cell.tension[f];
    for (std::uint32_t i = s.cell.first[f]; i < s.cell.first[f + 1]; ++i) {
      fiber.x.emplace_back(s.q.segment<3>(3 * Eigen::Index{i}));
      fiber.rest_length.push_back(s.cell.rest_length[i]);
    }
    relax::add_fiber(cell, fiber, x);
  }
  return state_of(cell, relax::unknowns_at(cell, x));
}

TEST(compare, fibers_are_known_by_their_yarns_and_places) {
  const relax::ComparedState a = posed(weave_of_seven), b = taken_out_of(a, 1, true);
  const relax::Difference difference = relax::difference(a, b);
  EXPECT_LT(difference.path.largest, round_off);
  EXPECT_LT(difference.fibers.value().largest, round_off);
  EXPECT_EQ(relax::verdict(a, b, difference), relax::Verdict::same);
}

TEST(compare, states_of_other_counts_have_yarns_in_common) {
  const relax::ComparedState a = posed(weave_of_seven), b = taken_out_of(a, 7, false);  // the middle fibers, which are the centroids
  const relax::Difference difference = relax::difference(a, b);
  EXPECT_FALSE(difference.fibers);
  EXPECT_LT(difference.path.largest, 1e-6);  // on a slope a plane cuts the fibers of a yarn where their straight pieces differ a little
  // Two rows of the hexagon are gone; slopes drew them apart by a few percent.
  EXPECT_NEAR(difference.height.mean, 2 * 1.06 * std::sqrt(0.75), 0.1);
  EXPECT_EQ(relax::verdict(a, b, difference), relax::Verdict::other_potential);
}

TEST(compare, minima_differ_by_place_and_energy) {
  const relax::ComparedState a = posed(weave_of_seven);
  const auto verdict_at = [&](double lift, double energy) {
    relax::ComparedState b = moved(a, {0, 0, lift * d}, 0);
    b.energy.contact = energy;
    b.certificate.energy_error = 1e-6;
    return relax::verdict(a, b, relax::difference(a, b));
  };
  // Of the lift of one yarn of four three quarters are left: 0.01 d is between 0.012 and 0.015.
  EXPECT_EQ(verdict_at(0.015, 1 + 2e-6), relax::Verdict::different);
  EXPECT_EQ(verdict_at(0.012, 1 + 2e-6), relax::Verdict::same);
  EXPECT_EQ(verdict_at(0.015, 1 + 0.5e-6), relax::Verdict::same);
  relax::ComparedState open = a;
  open.certificate.converged = false;
  EXPECT_EQ(relax::verdict(a, open, {}), relax::Verdict::not_certified);
  relax::ComparedState pressed = a;
  pressed.cell.pressure = 1;
  EXPECT_EQ(relax::verdict(a, pressed, {}), relax::Verdict::other_potential);
}

class CompareCommand : public OwnFolder {
 protected:
  /// A results folder of a relaxed single-fiber weave.
  std::filesystem::path relaxed(const std::string& name, const PlainWeave& weave, double tension = 0.2) const {
    std::filesystem::create_directories(folder / name);
    const PosedCell p = plain_weave_cell(weave, tension, 1);
    const relax::MinimizeResult r = relax::minimize(p.cell, p.unknowns());
    relax::ReportContext context;
    context.case_name = "plain";
    context.case_toml = weave::to_toml(plain_weave(weave));
    context.start = "topology";
    relax::write_relaxed(folder / name / "relax.vtkhdf", {p.cell, r.q, r.history, context.case_toml, "", "test", r.certificate.blocked_by});
    weave::write_text_file(folder / name / "summary.json",
                           relax::summary_json(p.cell, r, weave::measure_cell(relax::snapshot_of(p.cell, r.q)), context));
    return folder / name;
  }
  /// A results folder of a woven cell: the fibers as they start.
  std::filesystem::path woven(const PlainWeave& weave) const {
    const PosedCell p = plain_weave_cell(weave, 0.2, 1);
    std::filesystem::create_directories(folder / "loom");
    weave::write_results(folder / "loom" / "cell.vtkhdf",
                         {relax::snapshot_of(p.cell, p.unknowns()), {}, weave::to_toml(plain_weave(weave)), "test"});
    return folder / "loom";
  }

  PlainWeave single{.fibers = 1, .pitch = 4e-4};
};

TEST_F(CompareCommand, reads_every_part_of_the_energy_by_its_name) {
  const std::filesystem::path state = relaxed("a", single);
  nlohmann::json summary;
  std::ifstream(state / "summary.json") >> summary;
  for (double value = 1; auto& part : summary.at("energy_J")) part = value++;
  weave::write_text_file(state / "summary.json", summary.dump());
  for (const auto& [name, value] : relax::named(relax::read_relaxed_state(state).energy)) {
    if (name == "sum") continue;
    EXPECT_EQ(value, summary["energy_J"].at(name)) << name;
  }
}

TEST_F(CompareCommand, writes_figures_and_pictures) {
  const std::filesystem::path a = relaxed("a", single), b = relaxed("b", single), c = relaxed("c", single, 0.4);
  testing::internal::CaptureStdout();
  EXPECT_EQ(heddle::compare_command({.results = {a, b, c}, .woven = woven(single), .output = folder / "out"}), 0);
  std::fflush(stdout);
  const std::string table = testing::internal::GetCapturedStdout();
  std::ifstream in(folder / "out" / "summary.json");
  const auto j = nlohmann::json::parse(in);
  ASSERT_EQ(j.at("states").size(), 4U);
  EXPECT_EQ(j["states"][3]["kind"], "woven");
  EXPECT_TRUE(j["states"][0]["certificate"]["converged"]);
  std::ifstream of_a(a / "summary.json");
  const auto summary = nlohmann::json::parse(of_a);
  const double pins = summary.at("pin_force_max");
  EXPECT_GT(pins, 0);
  EXPECT_THAT(table, testing::ContainsRegex(fmt::format("pins hold .reference tension. +{:.2e} +{:.2e} .* -\n", pins, pins)));
  for (const auto& [name, value] : j["states"][0]["certificate"].items()) EXPECT_EQ(value, summary.at(name)) << name;
  for (const auto& [name, value] : weave::named({})) EXPECT_EQ(j["states"][0].at(name), summary.at(name)) << name;
  EXPECT_TRUE(j["states"][0]["certificate"].contains("neutral"));
  EXPECT_EQ(j["states"][0]["energy_J"], summary.at("energy_J"));
  EXPECT_GT(j["states"][0]["energy_J"]["contact"], 0);
  ASSERT_EQ(j.at("pairs").size(), 6U);
  EXPECT_EQ(j["pairs"][0]["different_minima"], false);
  EXPECT_EQ(j["pairs"][0]["fibers_diameters"]["largest"], 0);  // a and b are the same to the bit
  EXPECT_TRUE(j["pairs"][1]["different_minima"].is_null());    // c is under other tensions
  EXPECT_GT(j["pairs"][1]["path_diameters"]["largest"], 0);
  EXPECT_FALSE(j["pairs"][2].contains("energy_difference_J"));  // to the woven cell
  // The fibers of the start do not touch: the more they are pulled, the farther they go from there.
  EXPECT_EQ(j.at("closest_to_woven"), "a");
  for (const char* picture : {"overlay_x_1.png", "overlay_y_1.png", "overlay_y_2.png"})
    EXPECT_GT(std::filesystem::file_size(folder / "out" / picture), 1000U) << picture;
}

TEST_F(CompareCommand, names_what_can_not_be_compared) {
  const std::filesystem::path a = relaxed("a", single);
  const auto message = [&](const std::filesystem::path& b, const std::string& file, const std::string& text) {
    EXPECT_THAT(
        [&] {
          heddle::compare_command({.results = {a, b}, .woven = {}, .output = folder / "out"});
        },
        ThrowsMessage<std::runtime_error>(AllOf(HasSubstr(file), HasSubstr(text))));
    EXPECT_FALSE(std::filesystem::exists(folder / "out"));
  };
  message(woven(single), "loom", "no folder of heddle relax");
  message(folder / "nowhere", "nowhere", "no folder of heddle relax");
  PlainWeave doubled = single;
  doubled.repeat_x = 2;
  message(relaxed("doubled", doubled), "doubled/relax.vtkhdf", "weaving matrix");
  const std::filesystem::path b = relaxed("b", single);
  weave::write_text_file(b / "summary.json", "{}");
  message(b, "b/summary.json", "tool");
  weave::write_text_file(b / "summary.json", "{");
  message(b, "b/summary.json", "parse error");
  std::filesystem::copy_file(folder / "doubled" / "summary.json", b / "summary.json", std::filesystem::copy_options::overwrite_existing);
  message(b, "b/summary.json", "nodes");
  std::filesystem::remove(b / "summary.json");
  message(b, "b/summary.json", "no such file");
  EXPECT_THROW(heddle::compare_command({.results = {a}, .woven = {}, .output = folder / "out"}), std::invalid_argument);
  EXPECT_THAT([&] { heddle::compare_command({.results = {a}, .woven = a / "relax.vtkhdf", .output = folder / "out"}); },
              ThrowsMessage<std::runtime_error>(AllOf(HasSubstr("a/relax.vtkhdf"), HasSubstr("not of a woven one"))));
}

}  // namespace
