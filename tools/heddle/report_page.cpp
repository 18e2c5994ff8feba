#include "heddle/report_page.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>

#include "heddle/base64.hpp"
#include "heddle/escaped.hpp"
#include "relax/surface_file.hpp"

namespace heddle {
namespace {

using nlohmann::json;

constexpr const char* page_style = R"css(
body { font: 15px/1.45 "DejaVu Sans", Helvetica, Arial, sans-serif; color: #222; max-width: 1080px; margin: 2em auto; padding: 0 1em; }
h1 { margin-bottom: 0; } h2 { margin-top: 2em; border-bottom: 1px solid #ccc; }
.subtitle, figcaption, .note { color: #666; } figure { margin: 1.2em 0; } figure img { max-width: 100%; }
table { border-collapse: collapse; } td { padding: 0.15em 1.2em 0.15em 0; vertical-align: top; font-variant-numeric: tabular-nums; }
td.key { color: #555; } th { text-align: left; font-weight: normal; color: #555; padding: 0.15em 1.2em 0.15em 0; }
pre { background: #f5f6f7; padding: 1em; overflow: auto; } #yarns { width: 100%; height: 600px; background: #f5f6f7; }
)css";

/// Draws the yarns: colors by yarn, wefts in blues; the mouse turns, zooms and moves.
constexpr const char* yarns_script = R"js(
const place = document.getElementById("yarns");
const renderer = new THREE.WebGLRenderer({ antialias: true });
renderer.setPixelRatio(window.devicePixelRatio);
place.appendChild(renderer.domElement);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xf5f6f7);
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const all = new THREE.Box3();
const count = { warp: 0, weft: 0 };
for (const yarn of yarnSurfaces) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(bytes(yarn.points)), 3));
  geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes(yarn.triangles)), 1));
  geometry.computeVertexNormals();
  const kind = yarn.weft ? "weft" : "warp";
  const shade = (count[kind]++ % 5) / 5;
  const color = new THREE.Color().setHSL((yarn.weft ? 0.52 : 0.02) + 0.12 * shade, 0.55, 0.5);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: color, side: THREE.DoubleSide }));
  scene.add(mesh);
  all.expandByObject(mesh);
}
const center = all.getCenter(new THREE.Vector3()), size = all.getSize(new THREE.Vector3()).length();
scene.add(new THREE.AmbientLight(0xffffff, 0.55));
const camera = new THREE.PerspectiveCamera(35, 1, 0.01 * size, 20 * size);
camera.up.set(0, 0, 1);
camera.position.set(center.x - 0.75 * size, center.y - 0.95 * size, center.z + 0.75 * size);
const lamp = new THREE.DirectionalLight(0xffffff, 0.65);
camera.add(lamp);
scene.add(camera);
const controls = new THREE.OrbitControls(camera, renderer.domElement);
controls.target.copy(center);
controls.update();
const draw = () => renderer.render(scene, camera);
const fit = () => {
  renderer.setSize(place.clientWidth, place.clientHeight);
  camera.aspect = place.clientWidth / place.clientHeight;
  camera.updateProjectionMatrix();
  draw();
};
controls.addEventListener("change", draw);
window.addEventListener("resize", fit);
fit();
)js";

std::string read_file(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::stringstream text;
  text << in.rdbuf();
  if (!in) throw std::runtime_error(file.string() + ": can not be read");
  return text.str();
}

template <typename T>
std::string base64_of(const std::vector<T>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return base64(bytes);
}

std::string value_text(const json& value) {
  if (value.is_number_float()) return fmt::format("{:.5g}", value.get<double>());
  if (value.is_string()) return value.get<std::string>();
  if (value.is_array()) {
    std::string text;
    for (const json& v : value) text += (text.empty() ? "" : v.is_array() ? "\n" : ", ") + value_text(v);
    return text;
  }
  if (value.is_object()) {
    std::string text;
    for (const auto& [key, v] : value.items()) text += (text.empty() ? "" : ", ") + key + " " + value_text(v);
    return text;
  }
  return value.dump();
}

std::string figure(const std::filesystem::path& picture) {
  const std::string kind = picture.extension() == ".svg" ? "svg+xml" : "png";
  return fmt::format("<figure><img alt=\"{0}\" src=\"data:image/{1};base64,{2}\"><figcaption>{0}</figcaption></figure>\n",
                     escaped(picture.stem().string()), kind, base64(read_file(picture)));
}

std::string table_section(const PageTable& table) {
  std::string html = fmt::format("<h3>{}</h3>\n<table>\n<tr>", escaped(table.title));
  for (const std::string& column : table.columns) html += "<th>" + escaped(column) + "</th>";
  html += "</tr>\n";
  for (const std::vector<std::string>& row : table.rows) {
    html += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i) html += (i == 0 ? "<td class=\"key\">" : "<td>") + escaped(row[i]) + "</td>";
    html += "</tr>\n";
  }
  return html + "</table>\n";
}

std::string stage_section(const PageStage& stage) {
  std::string html = fmt::format("<h2>{}</h2>\n<table>\n", escaped(stage.title));
  const json summary = json::parse(read_file(stage.summary));
  for (const std::string& key : stage.keys) {
    if (!summary.contains(key)) continue;
    html += fmt::format("<tr><td class=\"key\">{}</td><td style=\"white-space: pre-line\">{}</td></tr>\n", escaped(key),
                        escaped(value_text(summary[key])));
  }
  html += "</table>\n";
  for (const PageTable& table : stage.tables) html += table_section(table);
  for (const auto& picture : stage.pictures) html += figure(picture);
  return html;
}

/// Surfaces for the script, in millimeters, so that single precision and the camera suit them.
std::string surfaces_json(const std::vector<PageYarn>& yarns) {
  json list = json::array();
  for (const PageYarn& yarn : yarns) {
    const relax::SurfaceMesh surface = relax::read_closed_off(yarn.surface);
    std::vector<float> points;
    for (const auto& x : surface.points) {
      for (int axis = 0; axis < 3; ++axis) points.push_back(static_cast<float>(1e3 * x[axis]));
    }
    std::vector<std::uint32_t> triangles;
    for (const auto& t : surface.triangles) triangles.insert(triangles.end(), t.begin(), t.end());
    list.push_back({{"weft", yarn.weft}, {"points", base64_of(points)}, {"triangles", base64_of(triangles)}});
  }
  return list.dump();
}

std::string yarns_section(const std::vector<PageYarn>& yarns) {
  const std::filesystem::path three = HEDDLE_THREE_JS;  // its folder
  std::string html = "<h2>Yarns</h2>\n";
  if (!std::filesystem::exists(three / "three.min.js")) {
    return html +
           "<p class=\"note\">three.js (Debian: libjs-three) was not found when this page was made, so the yarns can not be turned "
           "here.</p>\n";
  }
  html += "<p class=\"note\">Drag to turn, wheel to zoom, right button to move.</p>\n<div id=\"yarns\"></div>\n";
  html += "<script>" + read_file(three / "three.min.js") + "</script>\n";
  html += "<script>" + read_file(three / "examples/js/controls/OrbitControls.js") + "</script>\n";
  html += "<script>const yarnSurfaces = " + surfaces_json(yarns) + ";\n" + yarns_script + "</script>\n";
  return html;
}

}  // namespace

std::string report_page(const PageContent& content) {
  std::string html = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n"
      "<p class=\"subtitle\">{2}</p>\n",
      escaped(content.title), page_style, escaped(content.subtitle));
  if (!content.yarns.empty()) html += yarns_section(content.yarns);
  for (const PageStage& stage : content.stages) html += stage_section(stage);
  for (const PageTable& table : content.tables) html += table_section(table);
  html +=
      "<h2>Case</h2>\n<details><summary>with every default written out</summary><pre>" + escaped(content.case_toml) + "</pre></details>\n";
  return html + "</body></html>\n";
}

}  // namespace heddle
