#include "relax/composite.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace relax {
namespace {

constexpr std::array<int, 3> in_plane = {0, 1, 5}, out_of_plane = {2, 3, 4};  // places in Voigt's order

Matrix6 compliance_along_x(const TransverseIsotropic& m) {
  Matrix6 s = Matrix6::Zero();
  s(0, 0) = 1 / m.e1;
  s(1, 1) = s(2, 2) = 1 / m.e2;
  s(0, 1) = s(1, 0) = s(0, 2) = s(2, 0) = -m.nu12 / m.e1;
  s(1, 2) = s(2, 1) = -m.nu23 / m.e2;
  s(3, 3) = 1 / m.g23();
  s(4, 4) = s(5, 5) = 1 / m.g12;
  return s;
}

/// Stress in Voigt's order in axes whose unit vectors are the columns of `axes`, to that in the cell's (Bond 1943).
Matrix6 stress_rotation(const Eigen::Matrix3d& axes) {
  constexpr std::array<std::array<int, 2>, 6> pair = {{{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};
  Matrix6 r;
  for (Eigen::Index to = 0; to < 6; ++to)
    for (Eigen::Index from = 0; from < 6; ++from) {
      const auto [i, j] = pair[static_cast<std::size_t>(to)];
      const auto [k, l] = pair[static_cast<std::size_t>(from)];
      r(to, from) = k == l ? axes(i, k) * axes(j, k) : axes(i, k) * axes(j, l) + axes(i, l) * axes(j, k);
    }
  return r;
}

TransverseIsotropic chamis(const TransverseIsotropic& f, const TransverseIsotropic& m, double fraction) {
  const double root = std::sqrt(fraction);
  const auto across = [root](double of_matrix, double of_fiber) { return of_matrix / (1 - root * (1 - of_matrix / of_fiber)); };
  TransverseIsotropic c;
  c.e1 = fraction * f.e1 + (1 - fraction) * m.e1;
  c.nu12 = fraction * f.nu12 + (1 - fraction) * m.nu12;
  c.e2 = across(m.e2, f.e2);
  c.g12 = across(m.g12, f.g12);
  c.nu23 = c.e2 / (2 * across(m.g23(), f.g23())) - 1;
  return c;
}

/// Bulk modulus of plane strain across the axis.
double plane_bulk_modulus(const TransverseIsotropic& m) {
  return 1 / (4 / m.e2 - 1 / m.g23() - 4 * m.nu12 * m.nu12 / m.e1);
}

TransverseIsotropic mori_tanaka(const TransverseIsotropic& f, const TransverseIsotropic& m, double fraction) {
  const double rest = 1 - fraction, kf = plane_bulk_modulus(f), km = plane_bulk_modulus(m), gm = m.g23();
  const double k = km + fraction * (kf - km) / (1 + rest * (kf - km) / (km + gm));
  const double g23 = gm + fraction * (f.g23() - gm) / (1 + rest * (f.g23() - gm) * (km + 2 * gm) / (2 * gm * (km + gm)));
  const double coupling = fraction * rest / (fraction / km + rest / kf + 1 / gm);
  TransverseIsotropic c;
  c.g12 = gm + fraction * (f.g12 - gm) / (1 + rest * (f.g12 - gm) / (2 * gm));
  c.e1 = fraction * f.e1 + rest * m.e1 + 4 * (f.nu12 - m.nu12) * (f.nu12 - m.nu12) * coupling;
  c.nu12 = fraction * f.nu12 + rest * m.nu12 + (f.nu12 - m.nu12) * (1 / km - 1 / kf) * coupling;
  c.e2 = 4 / (1 / g23 + 1 / k + 4 * c.nu12 * c.nu12 / c.e1);
  c.nu23 = c.e2 / (2 * g23) - 1;
  return c;
}

}  // namespace

Matrix6 stiffness(const TransverseIsotropic& material, const Vec3& axis) {
  Eigen::Matrix3d axes;
  axes.col(0) = axis;
  axes.col(1) = axis.unitOrthogonal();
  axes.col(2) = axis.cross(axes.col(1));
  const Matrix6 rotation = stress_rotation(axes);
  return rotation * compliance_along_x(material).inverse() * rotation.transpose();
}

TransverseIsotropic impregnated_yarn(const Constituents& c, double volume_fraction) {
  const TransverseIsotropic matrix = isotropic(c.matrix_e, c.matrix_nu);
  return c.rule == Micromechanics::chamis ? chamis(c.fiber, matrix, volume_fraction) : mori_tanaka(c.fiber, matrix, volume_fraction);
}

MaterialBins bin_materials(const VolumeMesh& mesh, const Constituents& constituents, int bins) {
  if (bins < 1) throw std::invalid_argument("bins of volume fraction: " + std::to_string(bins) + ": must be at least 1");
  check_constants(constituents.fiber, "fiber " + constituents.fiber_name);
  check_constants(isotropic(constituents.matrix_e, constituents.matrix_nu), "matrix " + constituents.matrix_name);
  MaterialBins result;
  result.bin.assign(mesh.elements(), -1);
  double low = 1e300, high = -1e300;
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    if (mesh.yarn[i] < 0) continue;
    if (mesh.volume_fraction[i] > largest_volume_fraction) ++result.capped;
    low = std::min(low, std::min(mesh.volume_fraction[i], largest_volume_fraction));
    high = std::max(high, std::min(mesh.volume_fraction[i], largest_volume_fraction));
  }
  if (high < low) return result;
  result.width = (high - low) / bins;

  std::vector<double> sum(static_cast<std::size_t>(bins), 0), volume(static_cast<std::size_t>(bins), 0);
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    if (mesh.yarn[i] < 0) continue;
    const double fraction = std::min(mesh.volume_fraction[i], largest_volume_fraction);
    const int bin = result.width > 0 ? std::min(bins - 1, static_cast<int>((fraction - low) / result.width)) : 0;
    result.bin[i] = bin;
    sum[static_cast<std::size_t>(bin)] += fraction * mesh.volume(i);
    volume[static_cast<std::size_t>(bin)] += mesh.volume(i);
  }
  std::vector<std::int32_t> renumbered(sum.size(), -1);
  for (std::size_t b = 0; b < sum.size(); ++b) {
    if (volume[b] == 0) continue;
    renumbered[b] = static_cast<std::int32_t>(result.material.size());
    result.volume_fraction.push_back(sum[b] / volume[b]);
    result.material.push_back(impregnated_yarn(constituents, sum[b] / volume[b]));
  }
  for (std::int32_t& bin : result.bin)
    if (bin >= 0) bin = renumbered[static_cast<std::size_t>(bin)];
  return result;
}

StiffnessBounds stiffness_bounds(const VolumeMesh& mesh, const Constituents& constituents, const MaterialBins& bins) {
  const Matrix6 of_matrix = stiffness(isotropic(constituents.matrix_e, constituents.matrix_nu), Vec3::UnitX());
  Matrix6 stiff = Matrix6::Zero(), compliant = Matrix6::Zero();
  double matrix_volume = 0, whole = 0;
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const double volume = mesh.volume(i);
    whole += volume;
    if (bins.bin[i] < 0) {
      matrix_volume += volume;
      continue;
    }
    const Matrix6 c = stiffness(bins.material[static_cast<std::size_t>(bins.bin[i])], mesh.direction[i]);
    stiff += volume * c;
    compliant += volume * c.inverse();
  }
  stiff += matrix_volume * of_matrix;
  compliant += matrix_volume * of_matrix.inverse();
  return {stiff / whole, (compliant / whole).inverse()};
}

Matrix6 laminate_stiffness(const std::vector<Layer>& layers) {
  Eigen::Matrix3d in = Eigen::Matrix3d::Zero(), out = in, coupled = in;
  for (const Layer& layer : layers) {
    const Matrix6& c = layer.stiffness;
    const Eigen::Matrix3d compliance = Eigen::Matrix3d(c(out_of_plane, out_of_plane)).inverse();
    in += layer.share * plane_stress_stiffness(c)(in_plane, in_plane);
    out += layer.share * compliance;
    coupled += layer.share * c(in_plane, out_of_plane) * compliance;
  }
  const Eigen::Matrix3d stiff_out = out.inverse();
  Matrix6 result;
  result(out_of_plane, out_of_plane) = stiff_out;
  result(in_plane, out_of_plane) = coupled * stiff_out;
  result(out_of_plane, in_plane) = stiff_out * coupled.transpose();
  result(in_plane, in_plane) = in + coupled * stiff_out * coupled.transpose();
  return result;
}

Matrix6 laminate_stiffness(const VolumeMesh& mesh, const Constituents& constituents) {
  std::vector<Vec3> along(mesh.yarns.size(), Vec3::Zero());  // of each yarn, its crimp averaged out
  for (std::size_t i = 0; i < mesh.elements(); ++i)
    if (mesh.yarn[i] >= 0) along[static_cast<std::size_t>(mesh.yarn[i])] += mesh.volume(i) * mesh.yarn_tangent[i];
  double matrix = 0;
  std::array<double, 2> yarns{}, fibers{};  // volumes, of warps and of wefts
  for (std::size_t i = 0; i < mesh.elements(); ++i) {
    const double volume = mesh.volume(i);
    if (mesh.yarn[i] < 0) {
      matrix += volume;
      continue;
    }
    const Vec3& path = along[static_cast<std::size_t>(mesh.yarn[i])];
    const std::size_t weft = std::abs(path.y()) > std::abs(path.x()) ? 1 : 0;
    yarns[weft] += volume;
    fibers[weft] += volume * std::min(mesh.volume_fraction[i], largest_volume_fraction);
  }
  const double whole = matrix + yarns[0] + yarns[1];
  std::vector<Layer> layers = {{stiffness(isotropic(constituents.matrix_e, constituents.matrix_nu), Vec3::UnitX()), matrix / whole}};
  for (const std::size_t weft : {0U, 1U}) {
    if (yarns[weft] == 0) continue;
    const TransverseIsotropic yarn = impregnated_yarn(constituents, fibers[weft] / yarns[weft]);
    layers.push_back({stiffness(yarn, weft == 1 ? Vec3::UnitY() : Vec3::UnitX()), yarns[weft] / whole});
  }
  return laminate_stiffness(layers);
}

EngineeringConstants engineering_constants(const Matrix6& stiffness) {
  const Matrix6 s = stiffness.inverse();
  EngineeringConstants c;
  c.ex = 1 / s(0, 0);
  c.ey = 1 / s(1, 1);
  c.ez = 1 / s(2, 2);
  c.gyz = 1 / s(3, 3);
  c.gxz = 1 / s(4, 4);
  c.gxy = 1 / s(5, 5);
  c.nu_xy = -s(1, 0) / s(0, 0);
  c.nu_xz = -s(2, 0) / s(0, 0);
  c.nu_yz = -s(2, 1) / s(1, 1);
  return c;
}

EngineeringConstants plane_engineering_constants(const Matrix6& plane_stiffness) {
  const Eigen::Matrix3d s = Eigen::Matrix3d(plane_stiffness(in_plane, in_plane)).inverse();
  EngineeringConstants c;
  c.ex = 1 / s(0, 0);
  c.ey = 1 / s(1, 1);
  c.gxy = 1 / s(2, 2);
  c.nu_xy = -s(1, 0) / s(0, 0);
  return c;
}

Matrix6 plane_stress_stiffness(const Matrix6& m) {
  const Eigen::Matrix3d out = m(out_of_plane, out_of_plane), coupling = m(in_plane, out_of_plane);
  Matrix6 plane = Matrix6::Zero();
  plane(in_plane, in_plane) = m(in_plane, in_plane) - coupling * out.inverse() * coupling.transpose();
  return plane;
}

}  // namespace relax
