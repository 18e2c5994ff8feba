#include "weave/case.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <numbers>

namespace weave {
namespace {

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (code < 0x20 || code == 0x7f) {
      result += fmt::format("\\u{:04X}", code);
    } else {
      result += c;
    }
  }
  return result + '"';
}

std::string list(const std::vector<std::string>& texts) {
  std::string result;
  for (const std::string& text : texts) result += (result.empty() ? "" : ", ") + quoted(text);
  return "[" + result + "]";
}

class TomlText {
 public:
  void heading(const std::string& text) { text_ += fmt::format("\n{}\n", text); }
  void comment(const std::string& text) { text_ += fmt::format("# {}\n", text); }
  void raw(const char* key, const std::string& value) { text_ += fmt::format("{} = {}\n", key, value); }
  void write(const char* key, const std::string& value) { raw(key, quoted(value)); }
  void write(const char* key, const char* value) { write(key, std::string(value)); }
  void write(const char* key, int value) { raw(key, fmt::format("{}", value)); }
  void write(const char* key, bool value) { raw(key, value ? "true" : "false"); }
  /// Shortest decimal that reads back as the same double.
  void write(const char* key, double value) { raw(key, fmt::format("{}", value)); }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

}  // namespace

double YarnType::fiber_area() const {
  return linear_density / density / fibers;
}

double YarnType::fiber_radius() const {
  return std::sqrt(fiber_area() / (std::numbers::pi * packing));
}

int Case::warps() const {
  Eigen::Index count = 0;
  for (const WarpSection& section : sections) count += section.matrix.cols();
  return static_cast<int>(count);
}

double Case::warp_tension() const {
  double sum = 0;
  for (const WarpSection& section : sections) sum += section.tension * static_cast<double>(section.matrix.cols());
  return sum;
}

int Case::dents() const {
  int last = -1;
  for (const WarpSection& section : sections) last = std::max(last, section.dent);
  return last + 1;
}

double Case::cell_width() const {
  return dents() * loom.dent_width;
}

double Case::cell_length() const {
  return columns * take_up.length;
}

int Case::layer_of_pick(int pick) const {
  return weave::layer_of_pick(pick, layers, insertion_order);
}

WeavingMatrix Case::matrix() const {
  std::vector<WeavingMatrix> matrices;
  for (const WarpSection& section : sections) matrices.push_back(section.matrix);
  return assemble(matrices);
}

Case load_case(const std::filesystem::path& given, const std::vector<std::string>& overrides) {
  const std::filesystem::path file = std::filesystem::is_directory(given) ? given / "case.toml" : given;
  std::ifstream stream(file, std::ios::binary);
  if (!stream.is_open()) {
    throw CaseError(fmt::format("{}: can not be read as a case file", file.string()));
  }
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  return parse_case(text, file.string(), overrides);
}

std::vector<std::string> accuracy_overrides(const std::string& level) {
  if (level == "draft") return {"numerics.element_length=3", "numerics.safety=0.95"};
  if (level == "normal") return {"numerics.element_length=2", "numerics.safety=0.95"};
  if (level == "reference") return {"numerics.element_length=0.5", "numerics.safety=0.4"};
  throw std::invalid_argument(fmt::format("accuracy \"{}\": must be draft, normal or reference", level));
}

std::string to_toml(const Case& c) {
  TomlText t;
  t.comment("Lengths in m, linear densities in kg/m, densities in kg/m^3, moduli in Pa, forces in N, speeds in m/s, times in s.");
  t.write("name", c.name);
  t.write("title", c.title);

  t.heading("[fabric]");
  t.write("layers", c.layers);
  t.write("columns", c.columns);
  t.write("insertion_order", c.insertion_order == InsertionOrder::alternating ? "alternating" : "top_first");
  t.write("cells", c.cells);
  t.write("kept_cells", c.kept_cells);
  t.write("columns_behind_fell", c.columns_behind_fell);
  t.write("friction", c.friction);

  for (const auto& [name, yarn] : c.yarns) {
    t.heading(fmt::format("[yarns.{}]", quoted(name)));
    t.write("linear_density", yarn.linear_density);
    t.write("density", yarn.density);
    t.write("youngs_modulus", yarn.youngs_modulus);
    t.write("transverse_modulus", yarn.transverse_modulus);
    t.write("packing", yarn.packing);
    t.write("compression_factor", yarn.compression_factor);
    t.write("bending_stiffness", yarn.bending_stiffness);
    if (yarn.friction_within) t.write("friction_within", *yarn.friction_within);
    t.write("fibers", yarn.fibers);
    if (!yarn.material.empty()) t.write("material", yarn.material);
  }

  for (const auto& [name, material] : c.materials) {
    t.heading(fmt::format("[material.{}]", quoted(name)));
    t.write("e1", material.e1);
    t.write("e2", material.e2);
    t.write("g12", material.g12);
    t.write("nu12", material.nu12);
    t.write("nu23", material.nu23);
  }

  if (c.matrix_material) {
    t.heading("[matrix]");
    t.write("e", c.matrix_material->e);
    t.write("nu", c.matrix_material->nu);
  }

  for (const WarpSection& section : c.sections) {
    t.heading("[[section]]");
    t.write("yarn", section.yarn);
    t.write("dent", section.dent);
    t.write("tension", section.tension);
    t.raw("matrix", list(rows_of(section.matrix)));
  }

  t.heading("[weft]");
  t.raw("yarn_of_layer", list(c.weft.yarn_of_layer));
  t.write("length_coefficient", c.weft.length_coefficient);

  t.heading("[loom]");
  t.write("length", c.loom.length);
  t.write("height", c.loom.height);
  t.write("dent_width", c.loom.dent_width);
  t.write("tension", c.loom.tension);
  t.write("reed_bar_radius", c.loom.reed_bar_radius);

  t.heading("[insertion]");
  t.write("distance", c.insertion.distance);
  t.write("time", c.insertion.time);

  t.heading("[beat_up]");
  t.write("enabled", c.beat_up.enabled);
  t.write("travel", c.beat_up.travel);
  t.write("top_speed", c.beat_up.top_speed);
  t.write("dwell", c.beat_up.dwell);
  t.write("return_time", c.beat_up.return_time);
  t.write("return_delay", c.beat_up.return_delay);

  t.heading("[shedding]");
  t.write("time", c.shedding.time);

  t.heading("[take_up]");
  t.write("length", c.take_up.length);
  t.write("flags", c.take_up.flags);
  t.write("time", c.take_up.time);

  t.heading("[settle]");
  t.write("time", c.settle_time);

  t.heading("[numerics]");
  t.write("element_length", c.numerics.element_length);
  t.write("contact", c.numerics.contact);
  t.write("integrator", c.numerics.integrator);
  t.write("time_step", c.numerics.time_step);
  t.write("safety", c.numerics.safety);
  t.write("damping", c.numerics.damping);
  t.write("axial_damping", c.numerics.axial_damping);
  t.write("skin", c.numerics.skin);
  t.write("outer_skin", c.numerics.outer_skin);

  t.heading("[output]");
  t.write("checkpoint_interval", c.output.checkpoint_interval);
  t.write("history_interval", c.output.history_interval);
  return t.text();
}

}  // namespace weave
