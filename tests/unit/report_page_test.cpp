#include "heddle/report_page.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>

#include "heddle/base64.hpp"
#include "heddle/page_tables.hpp"
#include "scenes/temporary.hpp"
#include "weave/results.hpp"

namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

/// Test vectors of RFC 4648, section 10, and a byte above 127.
TEST(base64, gives_the_vectors_of_its_standard) {
  EXPECT_EQ(heddle::base64(""), "");
  EXPECT_EQ(heddle::base64("f"), "Zg==");
  EXPECT_EQ(heddle::base64("fo"), "Zm8=");
  EXPECT_EQ(heddle::base64("foo"), "Zm9v");
  EXPECT_EQ(heddle::base64("foob"), "Zm9vYg==");
  EXPECT_EQ(heddle::base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(heddle::base64("\xff\xfe"), "//4=");
}

class ReportPage : public ::testing::Test {
 protected:
  ReportPage() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    weave::write_text_file(folder_ / "summary.json", R"({"picks": 4, "reed_load_max_N": 1.23456789, "note": "a<b & c", "hidden": 1})");
    weave::write_text_file(folder_ / "picture.png", "not really one");
    weave::write_text_file(folder_ / "yarn_0.off", "OFF\n4 4 0\n0 0 0\n1e-3 0 0\n0 1e-3 0\n0 0 1e-3\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  }
  ~ReportPage() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_ = scenes::temporary(::testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(ReportPage, holds_keys_and_pictures_and_needs_no_other_file) {
  heddle::PageContent content;
  content.title = "three <warps>";
  content.case_toml = "name = \"three_warp\"";
  content.stages = {{"Weaving", folder_ / "summary.json", {"picks", "reed_load_max_N", "note", "not_there"}, {folder_ / "picture.png"}}};
  const std::string page = heddle::report_page(content);
  EXPECT_THAT(page, HasSubstr("<h1>three &lt;warps&gt;</h1>"));
  EXPECT_THAT(page, HasSubstr("1.2346"));
  EXPECT_THAT(page, HasSubstr("a&lt;b &amp; c"));
  EXPECT_THAT(page, Not(HasSubstr("not_there")));
  EXPECT_THAT(page, Not(HasSubstr("hidden")));
  EXPECT_THAT(page, HasSubstr("data:image/png;base64," + heddle::base64("not really one")));
  EXPECT_THAT(page, HasSubstr("name = &quot;three_warp&quot;"));
  EXPECT_THAT(page, Not(HasSubstr("http://")));
  EXPECT_THAT(page, Not(HasSubstr("https://")));
}

TEST_F(ReportPage, shows_tables) {
  heddle::PageContent content;
  content.stages = {{"Weaving", folder_ / "summary.json", {}, {}, {{"By <yarn>", {"", "width"}, {{"warp & 0", "0.5"}}}}}};
  const std::string page = heddle::report_page(content);
  EXPECT_THAT(page, HasSubstr("<h3>By &lt;yarn&gt;</h3>"));
  EXPECT_THAT(page, HasSubstr("<tr><th></th><th>width</th></tr>"));
  EXPECT_THAT(page, HasSubstr("<tr><td class=\"key\">warp &amp; 0</td><td>0.5</td></tr>"));
}

TEST(PageTables, stiffness_stands_beside_what_the_summary_has) {
  const heddle::PageTable bounded = heddle::stiffness_table(
      {{"ex_Pa", 2e9}, {"nu_xy", 0.3}, {"reuss_ex_Pa", 1e9}, {"reuss_nu_xy", 0.1}, {"laminate_ex_Pa", 2.5e9}, {"laminate_nu_xy", 0.2}});
  EXPECT_THAT(bounded.columns, ElementsAre("", "CalculiX", "Reuss", "laminate"));
  EXPECT_THAT(bounded.rows, ElementsAre(ElementsAre("ex", "2", "1", "2.5"), ElementsAre("nu_xy", "0.3", "", "0.2")));
}

TEST(PageTables, sections_are_in_millimeters_and_degrees) {
  const auto spread = [](double mean) { return nlohmann::ordered_json{{"mean", mean}, {"min", 0.5 * mean}, {"max", 2 * mean}}; };
  const heddle::PageTable table = heddle::section_table({{"by_yarn",
                                                          {{{"yarn", 3},
                                                            {"weft", true},
                                                            {"sections",
                                                             {{"width_m", spread(1e-3)},
                                                              {"height_m", spread(2e-4)},
                                                              {"area_m2", spread(3e-7)},
                                                              {"fiber_volume_fraction", spread(0.4)},
                                                              {"rotation_rad", spread(std::numbers::pi / 18)}}}}}}});
  EXPECT_THAT(table.rows, ElementsAre(ElementsAre("weft 3", "1 (0.5 \u2026 2)", "0.2 (0.1 \u2026 0.4)", "0.3 (0.15 \u2026 0.6)",
                                                  "0.4 (0.2 \u2026 0.8)", "10 (5 \u2026 20)")));
}

TEST_F(ReportPage, shows_yarns_in_millimeters) {
  heddle::PageContent content;
  content.yarns = {{folder_ / "yarn_0.off", true}};
  const std::string page = heddle::report_page(content);
  if (page.find("three.js (Debian: libjs-three) was not found") != std::string::npos) GTEST_SKIP() << "three.js is not installed";
  // The second point, (1, 0, 0) in single precision, from byte 12 on.
  EXPECT_THAT(page, HasSubstr(R"("points":"AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAA)"));
  EXPECT_THAT(page, HasSubstr(R"("weft":true)"));
}

TEST_F(ReportPage, names_a_file_that_is_missing) {
  heddle::PageContent content;
  content.stages = {{"Weaving", folder_ / "nothing.json", {}, {}}};
  try {
    static_cast<void>(heddle::report_page(content));
    FAIL() << "a missing summary was taken";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), HasSubstr("nothing.json"));
  }
}

}  // namespace
