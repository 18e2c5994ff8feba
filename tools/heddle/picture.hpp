#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace heddle {

struct Color {
  double red = 0, green = 0, blue = 0;  ///< 0 ... 1
};

inline constexpr Color white{1, 1, 1};
inline constexpr Color ink{0.22, 0.22, 0.24};        ///< of text and axes
inline constexpr Color faint_ink{0.55, 0.55, 0.58};  ///< of secondary lines
inline constexpr Color grid_gray{0.90, 0.90, 0.91};

/// a where part is 0, b where it is 1.
Color mix(Color a, Color b, double part);

/// Warm hues for warps, cool ones for wefts, such that neighbors differ. index: of the warp or of the weft, from 0.
Color yarn_color(int index, bool weft);

/// Of the states of one cell that are drawn over one another, from 0: told apart by color-blind readers too; they repeat after six.
Color state_color(std::size_t index);

/// Perceptually uniform map (viridis) from 0 ... 1; values outside are clamped.
Color scale_color(double part);

struct Point {
  double x = 0, y = 0;  ///< [px], y down
};

/// Pixels row by row from the top left, 0xAARRGGBB with colors multiplied by alpha.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint32_t> pixels;
};

/// Where a text's anchor is in it: 0 left or top, 0.5 middle, 1 right or bottom.
struct Align {
  double x = 0, y = 0.5;
};

struct TextStyle {
  double size = 14;  ///< [px]
  Color color = ink;
  bool bold = false;
  bool upward = false;  ///< turned by 90 degrees, reading from bottom to top
};

/// A white page that becomes a PNG, SVG or PDF file by the file's extension. Lengths are pixels (points in SVG and PDF), y down.
class Canvas {
 public:
  /// Throws std::runtime_error naming the file if the extension is none of these.
  Canvas(const std::filesystem::path& file, int width, int height);
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas();

  [[nodiscard]] double width() const;
  [[nodiscard]] double height() const;

  void line(const std::vector<Point>& points, Color color, double line_width, bool dashed = false);
  void polygon(const std::vector<Point>& points, Color fill, double opacity = 1);
  void outline(const std::vector<Point>& points, Color color, double line_width);
  /// angle: of the first half-axis against x, [rad], clockwise on the page.
  void ellipse(Point center, double half_axis_a, double half_axis_b, double angle, Color fill, Color edge, double edge_width);
  void rectangle(Point top_left, double width, double height, Color fill);
  void frame(Point top_left, double width, double height, Color color, double line_width);
  void text(Point at, const std::string& text, const TextStyle& style, Align align = {});
  [[nodiscard]] double text_width(const std::string& text, const TextStyle& style) const;
  /// Fits the image into the rectangle.
  void image(const Image& image, Point top_left, double width, double height, double opacity = 1);

  /// Until unclip(), nothing is drawn outside the rectangle. Not nested.
  void clip(Point top_left, double width, double height);
  void unclip();

  /// Writes the file. Throws std::runtime_error naming file and cause.
  void finish();

 private:
  struct Page;
  std::unique_ptr<Page> page_;
};

}  // namespace heddle
