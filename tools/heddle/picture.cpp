#include "heddle/picture.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace heddle {

Color mix(Color a, Color b, double part) {
  return {a.red + part * (b.red - a.red), a.green + part * (b.green - a.green), a.blue + part * (b.blue - a.blue)};
}

namespace {

constexpr Color from_hex(std::uint32_t rgb) {
  return {((rgb >> 16) & 255) / 255.0, ((rgb >> 8) & 255) / 255.0, (rgb & 255) / 255.0};
}

}  // namespace

Color yarn_color(int index, bool weft) {
  static constexpr std::array<Color, 8> warm = {from_hex(0xd6402b), from_hex(0xf7b24d), from_hex(0x9c4a1a), from_hex(0xf28c6a),
                                                from_hex(0xb81f4a), from_hex(0xe6c229), from_hex(0xe8702a), from_hex(0xd98bb0)};
  static constexpr std::array<Color, 8> cool = {from_hex(0x2b6cb0), from_hex(0x6cc5b4), from_hex(0x1f3f77), from_hex(0x7fb5e0),
                                                from_hex(0x2f8f6b), from_hex(0x6a5bb5), from_hex(0x3d9dc4), from_hex(0xa3b5e6)};
  const auto place = static_cast<std::size_t>(index) % 8;
  return weft ? cool[place] : warm[place];
}

Color state_color(std::size_t index) {
  // Okabe & Ito 2008, Color Universal Design, without black and yellow.
  static constexpr std::array<Color, 6> colors = {from_hex(0x0072b2), from_hex(0xd55e00), from_hex(0x009e73),
                                                  from_hex(0xcc79a7), from_hex(0xe69f00), from_hex(0x56b4e9)};
  return colors[index % colors.size()];
}

Color scale_color(double part) {
  // viridis (S. van der Walt, N. Smith, matplotlib 2015) at every eighth.
  static constexpr std::array<Color, 9> stops = {from_hex(0x440154), from_hex(0x472d7b), from_hex(0x3b528b),
                                                 from_hex(0x2c728e), from_hex(0x21918c), from_hex(0x28ae80),
                                                 from_hex(0x5ec962), from_hex(0xaddc30), from_hex(0xfde725)};
  const double place = std::clamp(part, 0.0, 1.0) * 8;
  const auto low = std::min<std::size_t>(static_cast<std::size_t>(place), 7);
  return mix(stops[low], stops[low + 1], place - static_cast<double>(low));
}

struct Canvas::Page {
  std::filesystem::path file;
  bool is_png = false;
  double width = 0, height = 0;
  cairo_surface_t* surface = nullptr;
  cairo_t* cairo = nullptr;

  void color(Color c, double opacity = 1) const { cairo_set_source_rgba(cairo, c.red, c.green, c.blue, opacity); }

  void path(const std::vector<Point>& points) const {
    cairo_new_path(cairo);
    for (const Point& p : points) cairo_line_to(cairo, p.x, p.y);
  }

  void font(const TextStyle& style) const {
    cairo_select_font_face(cairo, "sans-serif", CAIRO_FONT_SLANT_NORMAL, style.bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cairo, style.size);
  }

  [[noreturn]] void fail(cairo_status_t status) const {
    throw std::runtime_error(file.string() + ": cannot write the picture: " + cairo_status_to_string(status));
  }
};

Canvas::Canvas(const std::filesystem::path& file, int width, int height) : page_(std::make_unique<Page>()) {
  page_->file = file;
  page_->width = width;
  page_->height = height;
  const std::string extension = file.extension().string();
  if (extension == ".png") {
    page_->is_png = true;
    page_->surface = cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height);
  } else if (extension == ".svg") {
    page_->surface = cairo_svg_surface_create(file.c_str(), width, height);
  } else if (extension == ".pdf") {
    page_->surface = cairo_pdf_surface_create(file.c_str(), width, height);
  } else {
    throw std::runtime_error(file.string() + ": a picture's extension must be .png, .svg or .pdf");
  }
  page_->cairo = cairo_create(page_->surface);
  cairo_set_line_join(page_->cairo, CAIRO_LINE_JOIN_ROUND);
  page_->color(white);
  cairo_paint(page_->cairo);
}

Canvas::~Canvas() {
  cairo_destroy(page_->cairo);
  cairo_surface_destroy(page_->surface);
}

double Canvas::width() const {
  return page_->width;
}
double Canvas::height() const {
  return page_->height;
}

void Canvas::line(const std::vector<Point>& points, Color color, double line_width, bool dashed) {
  page_->path(points);
  page_->color(color);
  cairo_set_line_width(page_->cairo, line_width);
  const std::array<double, 2> dash = {5 * line_width, 4 * line_width};
  cairo_set_dash(page_->cairo, dash.data(), dashed ? 2 : 0, 0);
  cairo_stroke(page_->cairo);
  cairo_set_dash(page_->cairo, nullptr, 0, 0);
}

void Canvas::polygon(const std::vector<Point>& points, Color fill, double opacity) {
  page_->path(points);
  cairo_close_path(page_->cairo);
  page_->color(fill, opacity);
  cairo_fill(page_->cairo);
}

void Canvas::outline(const std::vector<Point>& points, Color color, double line_width) {
  page_->path(points);
  cairo_close_path(page_->cairo);
  page_->color(color);
  cairo_set_line_width(page_->cairo, line_width);
  cairo_stroke(page_->cairo);
}

void Canvas::ellipse(Point center, double half_axis_a, double half_axis_b, double angle, Color fill, Color edge, double edge_width) {
  cairo_t* cairo = page_->cairo;
  cairo_save(cairo);
  cairo_translate(cairo, center.x, center.y);
  cairo_rotate(cairo, angle);
  cairo_scale(cairo, half_axis_a, half_axis_b);
  cairo_new_path(cairo);
  cairo_arc(cairo, 0, 0, 1, 0, 2 * std::numbers::pi);
  cairo_restore(cairo);
  page_->color(fill);
  cairo_fill_preserve(cairo);
  page_->color(edge);
  cairo_set_line_width(cairo, edge_width);
  cairo_stroke(cairo);
}

void Canvas::rectangle(Point top_left, double width, double height, Color fill) {
  cairo_new_path(page_->cairo);
  cairo_rectangle(page_->cairo, top_left.x, top_left.y, width, height);
  page_->color(fill);
  cairo_fill(page_->cairo);
}

void Canvas::frame(Point top_left, double width, double height, Color color, double line_width) {
  outline({top_left, {top_left.x + width, top_left.y}, {top_left.x + width, top_left.y + height}, {top_left.x, top_left.y + height}}, color,
          line_width);
}

void Canvas::text(Point at, const std::string& text, const TextStyle& style, Align align) {
  cairo_t* cairo = page_->cairo;
  page_->font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(cairo, text.c_str(), &extents);
  cairo_save(cairo);
  cairo_translate(cairo, at.x, at.y);
  if (style.upward) cairo_rotate(cairo, -std::numbers::pi / 2);
  // The height of capitals, the same for every text, keeps labels on one line.
  const double cap_height = 0.73 * style.size;
  cairo_move_to(cairo, -align.x * extents.x_advance, (1 - align.y) * cap_height);
  page_->color(style.color);
  cairo_show_text(cairo, text.c_str());
  cairo_restore(cairo);
}

double Canvas::text_width(const std::string& text, const TextStyle& style) const {
  page_->font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(page_->cairo, text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::image(const Image& image, Point top_left, double width, double height, double opacity) {
  if (image.width == 0 || image.height == 0) return;
  cairo_surface_t* picture = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, image.width, image.height);
  cairo_surface_flush(picture);
  unsigned char* rows = cairo_image_surface_get_data(picture);
  const auto stride = static_cast<std::size_t>(cairo_image_surface_get_stride(picture));
  const auto columns = static_cast<std::size_t>(image.width);
  for (std::size_t row = 0; row < static_cast<std::size_t>(image.height); ++row)
    std::copy_n(reinterpret_cast<const unsigned char*>(image.pixels.data() + row * columns), 4 * columns, rows + row * stride);
  cairo_surface_mark_dirty(picture);
  cairo_t* cairo = page_->cairo;
  cairo_save(cairo);
  cairo_translate(cairo, top_left.x, top_left.y);
  cairo_scale(cairo, width / image.width, height / image.height);
  cairo_set_source_surface(cairo, picture, 0, 0);
  cairo_pattern_set_filter(cairo_get_source(cairo), CAIRO_FILTER_GOOD);
  cairo_pattern_set_extend(cairo_get_source(cairo), CAIRO_EXTEND_PAD);
  cairo_rectangle(cairo, 0, 0, image.width, image.height);
  cairo_clip(cairo);
  cairo_paint_with_alpha(cairo, opacity);
  cairo_restore(cairo);
  cairo_surface_destroy(picture);
}

void Canvas::clip(Point top_left, double width, double height) {
  cairo_save(page_->cairo);
  cairo_new_path(page_->cairo);
  cairo_rectangle(page_->cairo, top_left.x, top_left.y, width, height);
  cairo_clip(page_->cairo);
}

void Canvas::unclip() {
  cairo_restore(page_->cairo);
}

void Canvas::finish() {
  if (const cairo_status_t status = cairo_status(page_->cairo); status != CAIRO_STATUS_SUCCESS) page_->fail(status);
  cairo_show_page(page_->cairo);
  if (page_->is_png) {
    const cairo_status_t status = cairo_surface_write_to_png(page_->surface, page_->file.c_str());
    if (status != CAIRO_STATUS_SUCCESS) page_->fail(status);
  }
  cairo_surface_finish(page_->surface);
  if (const cairo_status_t status = cairo_surface_status(page_->surface); status != CAIRO_STATUS_SUCCESS) page_->fail(status);
}

}  // namespace heddle
