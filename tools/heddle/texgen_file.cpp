#include "heddle/texgen_file.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "heddle/escaped.hpp"

namespace heddle {
namespace {

using relax::YarnEnvelope;
using relax::YarnSection;
using weave::Vec3;

constexpr double per_mm = 1e3;  ///< millimeters in a meter

/// Control characters, which XML forbids or folds, become blanks.
std::string attribute_text(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  return escaped(text);
}

std::string text_of(const Vec3& v) {
  return fmt::format("{}, {}, {}", v.x(), v.y(), v.z());
}

/// TexGen's axes of a section: the tangent is the section's normal, a point of the polygon (x, y) lies at x (tangent x up) + y up from the
/// node.
Vec3 up_of(const YarnSection& s) {
  return s.normal.cross(s.lateral).normalized();
}

/// A ring's points in the axes of its section [mm].
std::vector<Eigen::Vector2d> outline(const YarnEnvelope& e, std::size_t ring) {
  const YarnSection& s = e.sections[ring];
  const Vec3 up = up_of(s), side = s.normal.cross(up);
  std::vector<Eigen::Vector2d> points;
  for (std::uint32_t j = 0; j < e.ring_points; ++j) {
    const Vec3 from_node = per_mm * (e.surface.points[ring * e.ring_points + j] - s.centroid);
    points.emplace_back(from_node.dot(side), from_node.dot(up));
  }
  return points;
}

double signed_area(const std::vector<Eigen::Vector2d>& points) {
  double area = 0;
  for (std::size_t j = 0; j < points.size(); ++j) {
    const Eigen::Vector2d &a = points[j], &b = points[(j + 1) % points.size()];
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return area;
}

/// Solid area of a yarn's fibers, mean over its sections [mm^2].
double fiber_area(const YarnEnvelope& e) {
  double sum = 0;
  for (const YarnSection& s : e.sections) sum += s.area * s.fiber_volume_fraction;
  return per_mm * per_mm * sum / static_cast<double>(e.sections.size());
}

void add_yarn(std::string& text, const YarnEnvelope& e, std::size_t index, double length, double width) {
  const auto out = std::back_inserter(text);
  constexpr int to_be_built = 7;  // TexGen's line, surface and volume
  fmt::format_to(out,
                 "<Yarn index=\"{}\" FibreAreaValue=\"{}\" FibreAreaUnits=\"mm^2\" NumSlaveNodes=\"{}\" NumSectionPoints=\"{}\" "
                 "NeedsBuilding=\"{}\">\n"
                 "<Interpolation Periodic=\"1\" ForceInPlaneTangent=\"0\" ForceMasterNodeTangent=\"0\" type=\"CInterpolationBezier\"/>\n"
                 "<YarnSection type=\"CYarnSectionInterpNode\" ConstMesh=\"1\" Ramped=\"0\" Polar=\"0\">\n",
                 index, fiber_area(e), e.rings, e.ring_points, to_be_built);
  // TexGen's polygons run counterclockwise and start at their right; points of one number belong together in all of them.
  const std::vector<Eigen::Vector2d> first = outline(e, 0);
  const auto right = std::max_element(first.begin(), first.end(), [](const auto& a, const auto& b) { return a.x() < b.x(); });
  const bool clockwise = signed_area(first) < 0;
  for (std::size_t k = 0; k < e.rings; ++k) {
    std::vector<Eigen::Vector2d> points = outline(e, k);
    std::rotate(points.begin(), points.begin() + (right - first.begin()), points.end());
    if (clockwise) std::reverse(points.begin() + 1, points.end());
    fmt::format_to(out, "<NodeSection nodeindex=\"{}\">\n<Section type=\"CSectionPolygon\">\n", k);
    for (const Eigen::Vector2d& p : points) fmt::format_to(out, "<PolygonPoint value=\"{}, {}\"/>\n", p.x(), p.y());
    text += "</Section>\n</NodeSection>\n";
  }
  text += "</YarnSection>\n<FibreDistribution type=\"CFibreDistributionConst\"/>\n";
  for (const Vec3& repeat : {Vec3(length, 0, 0), Vec3(0, width, 0)})
    fmt::format_to(out, "<Repeat value=\"{}\"/>\n", text_of(per_mm * repeat));
  for (std::size_t k = 0; k < e.rings; ++k) {
    const YarnSection& s = e.sections[k];
    fmt::format_to(out, "<MasterNode index=\"{}\" Position=\"{}\" Tangent=\"{}\" Up=\"{}\" Angle=\"0\"/>\n", k,
                   text_of(per_mm * s.centroid), text_of(s.normal), text_of(up_of(s)));
  }
  text += "</Yarn>\n";
}

}  // namespace

std::string texgen_text(const relax::Envelopes& envelopes, const std::string& name) {
  if (envelopes.yarns.empty()) throw std::invalid_argument("a TG3 file needs at least one yarn");
  const weave::Snapshot& cell = envelopes.fibers;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const YarnEnvelope& e : envelopes.yarns)
    for (const Vec3& x : e.surface.points) {
      low = std::min(low, x.z());
      high = std::max(high, x.z());
    }
  std::string text = fmt::format(
      "<?xml version=\"1.0\"?>\n<TexGenModel version=\"3.9.0\">\n<Textile name=\"{}\" GeometryScale=\"mm\" type=\"CTextile\" "
      "NeedsBuilding=\"0\">\n"
      "<Domain type=\"CDomainPlanes\">\n",
      attribute_text(name));
  // A point x is inside where normal . x > d for each plane.
  const std::pair<Vec3, double> planes[] = {{Vec3::UnitX(), cell.x_min},        {-Vec3::UnitX(), -cell.x_max}, {Vec3::UnitY(), 0},
                                            {-Vec3::UnitY(), -cell.cell_width}, {Vec3::UnitZ(), low},          {-Vec3::UnitZ(), -high}};
  for (const auto& [normal, d] : planes)
    fmt::format_to(std::back_inserter(text), "<Plane Normal=\"{}\" d=\"{}\"/>\n", text_of(normal), per_mm * d);
  text += "</Domain>\n";
  for (std::size_t i = 0; i < envelopes.yarns.size(); ++i) add_yarn(text, envelopes.yarns[i], i, cell.x_max - cell.x_min, cell.cell_width);
  return text + "</Textile>\n</TexGenModel>\n";
}

}  // namespace heddle
