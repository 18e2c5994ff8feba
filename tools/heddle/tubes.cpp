#include "heddle/tubes.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace heddle {

namespace {

using weave::Vec3;

struct Hit {
  double depth = std::numeric_limits<double>::infinity();
  Vec3 normal = Vec3::Zero();
  double part = 0;  ///< of the way from a to b
};

void keep_nearer(Hit& best, const Hit& hit) {
  if (hit.depth < best.depth) best = hit;
}

Hit hit_sphere(const Vec3& center, double radius, double u, double v, double part) {
  const double du = u - center.x(), dv = v - center.y();
  const double square = radius * radius - du * du - dv * dv;
  if (square < 0) return {};
  const double depth = center.z() - std::sqrt(square);
  return {depth, Vec3(du, dv, depth - center.z()) / radius, part};
}

/// The flat end of a fiber: a disc at `center` that faces along `outward`.
Hit hit_disc(const Vec3& center, const Vec3& outward, double radius, double u, double v, double part) {
  if (outward.z() > -1e-6) return {};
  const double du = u - center.x(), dv = v - center.y();
  const double dw = -(outward.x() * du + outward.y() * dv) / outward.z();
  if (du * du + dv * dv + dw * dw > radius * radius) return {};
  return {center.z() + dw, outward, part};
}

/// The side of the cylinder from a to b, seen along depth through (u, v).
Hit hit_cylinder(const Vec3& a, const Vec3& axis, double length, double radius, double u, double v) {
  // Point on the ray: p + t w with w = (0, 0, 1) and p at depth 0; its part across the axis has length `radius`.
  const Vec3 p(u - a.x(), v - a.y(), -a.z());
  const double along_p = p.dot(axis), along_w = axis.z();
  const Vec3 across_p = p - along_p * axis;
  const Vec3 across_w = Vec3(0, 0, 1) - along_w * axis;
  const double A = across_w.squaredNorm();
  if (A < 1e-12) return {};
  const double B = across_p.dot(across_w);
  const double root = B * B - A * (across_p.squaredNorm() - radius * radius);
  if (root < 0) return {};
  const double t = (-B - std::sqrt(root)) / A;
  const double along = along_p + t * along_w;
  if (along < 0 || along > length) return {};
  return {t, (across_p + t * across_w) / radius, along / length};
}

/// What the viewer sees of one point, before depth is taken into account.
Color lit(Color color, const Vec3& normal) {
  static const Vec3 light = Vec3(-0.45, 0.65, -1).normalized();
  static const Vec3 half = (light + Vec3(0, 0, -1)).normalized();
  const double diffuse = std::max(0.0, normal.dot(light));
  const double gloss = 0.18 * std::pow(std::max(0.0, normal.dot(half)), 24);
  return mix(mix({0, 0, 0}, color, 0.42 + 0.62 * diffuse), white, gloss);
}

std::uint32_t packed(Color color) {
  const auto byte = [](double value) { return static_cast<std::uint32_t>(std::lround(255 * std::clamp(value, 0.0, 1.0))); };
  return 0xff000000U | byte(color.red) << 16 | byte(color.green) << 8 | byte(color.blue);
}

}  // namespace

Image render_tubes(const std::vector<Tube>& tubes, double left, double bottom, double scale, int width_px, int height_px) {
  constexpr double darkest = 0.62;  // brightness of the farthest fiber
  Image image{width_px, height_px, {}};
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  std::vector<float> depth(pixels, std::numeric_limits<float>::infinity());
  std::vector<Color> color(pixels);

  for (const Tube& tube : tubes)
    for (std::size_t i = 0; i + 1 < tube.points.size(); ++i) {
      const Vec3 &a = tube.points[i], &b = tube.points[i + 1];
      const double length = (b - a).norm();
      if (length == 0) continue;
      const Vec3 axis = (b - a) / length;
      const bool first = i == 0, last = i + 2 == tube.points.size();
      const double r = tube.radius;
      const auto column = [&](double u) { return (u - left) * scale; };
      const auto row = [&](double v) { return height_px - (v - bottom) * scale; };
      const int column_from = static_cast<int>(std::clamp(std::floor(column(std::min(a.x(), b.x()) - r)), 0.0, width_px * 1.0));
      const int column_to = static_cast<int>(std::clamp(std::ceil(column(std::max(a.x(), b.x()) + r)), 0.0, width_px * 1.0));
      const int row_from = static_cast<int>(std::clamp(std::floor(row(std::max(a.y(), b.y()) + r)), 0.0, height_px * 1.0));
      const int row_to = static_cast<int>(std::clamp(std::ceil(row(std::min(a.y(), b.y()) - r)), 0.0, height_px * 1.0));
      for (int y = row_from; y < row_to; ++y)
        for (int x = column_from; x < column_to; ++x) {
          const double u = left + (x + 0.5) / scale, v = bottom + (height_px - y - 0.5) / scale;
          Hit hit = hit_cylinder(a, axis, length, r, u, v);
          keep_nearer(hit, first ? hit_disc(a, -axis, r, u, v, 0) : hit_sphere(a, r, u, v, 0));
          if (last) keep_nearer(hit, hit_disc(b, axis, r, u, v, 1));
          const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) + static_cast<std::size_t>(x);
          if (static_cast<float>(hit.depth) >= depth[pixel]) continue;
          depth[pixel] = static_cast<float>(hit.depth);
          color[pixel] = lit(mix(tube.colors[i], tube.colors[i + 1], hit.part), hit.normal);
        }
    }

  float nearest = std::numeric_limits<float>::infinity(), farthest = -nearest;
  for (const float d : depth)
    if (std::isfinite(d)) {
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
  const double range = std::max(1e-12, static_cast<double>(farthest) - static_cast<double>(nearest));
  image.pixels.assign(pixels, 0);
  for (std::size_t i = 0; i < pixels; ++i)
    if (std::isfinite(depth[i])) {
      const double distance = (static_cast<double>(depth[i]) - static_cast<double>(nearest)) / range;
      image.pixels[i] = packed(mix(color[i], {0, 0, 0}, (1 - darkest) * distance));
    }
  return image;
}

}  // namespace heddle
