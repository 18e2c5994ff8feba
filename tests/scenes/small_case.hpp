#pragma once
#include <fmt/format.h>

#include <string>

namespace scenes {

/// A pair of warps in two dents that change places.
inline constexpr const char* plain_sections = R"(
[[section]]
yarn = "glass"
dent = 0
matrix = ["+", "-"]
[[section]]
yarn = "glass"
dent = 1
matrix = ["-", "+"]
)";

/// Case file of a short loom with one yarn, glass of three fibers, that weaves in seconds: plain weave, unless other sections are given.
inline std::string small_case_text(const std::string& sections = plain_sections, int layers = 1, double height_ratio = 0.7) {
  return fmt::format(R"(
name = "small"
[fabric]
layers = {}
cells = 1
friction = 0.2
[yarns.glass]
linear_density = "66.7 tex"
density = "2460 kg/m^3"
youngs_modulus = "86.9 GPa"
fibers = 3
{}
[weft]
yarn = "glass"
[loom]
length = "2.5 mm"
height_ratio = {}
dent_width = "0.8 mm"
tension = "1 N"
reed_bar_radius = "0.08 mm"
[insertion]
time = "0.05 ms"
[beat_up]
top_speed = "10 m/s"
[shedding]
time = "0.4 ms"
[take_up]
length = "0.8 mm"
time = "0.2 ms"
[settle]
time = "0.05 ms"
[numerics]
element_length = 3.0
)",
                     layers, sections, height_ratio);
}

}  // namespace scenes
