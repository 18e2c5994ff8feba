#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace heddle {

/// A table with a row of column titles; the first cell of each row names it.
struct PageTable {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  ///< (rows x columns)
};

/// One stage of a pipeline on its page.
struct PageStage {
  std::string title;                            ///< e.g. "Weaving"
  std::filesystem::path summary;                ///< its summary.json
  std::vector<std::string> keys;                ///< of the summary that the page shows in a table, those that it has
  std::vector<std::filesystem::path> pictures;  ///< PNG or SVG, in the order shown
  std::vector<PageTable> tables = {};           ///< before the pictures
};

/// A yarn's surface to turn with the mouse: closed triangles in an OFF file.
struct PageYarn {
  std::filesystem::path surface;
  bool weft = false;
};

struct PageContent {
  std::string title, subtitle, case_toml;
  std::vector<PageStage> stages;
  std::vector<PageYarn> yarns;
  std::vector<PageTable> tables = {};  ///< of all stages together
};

/// The page as HTML that needs no other file and no network: pictures and surfaces are in it, and three.js where the machine has it
/// (Debian: libjs-three); without it the page says so in the place of the yarns. Throws std::runtime_error naming a file that it can not
/// read.
std::string report_page(const PageContent& content);

}  // namespace heddle
