#include "relax/periodic_sets.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

namespace relax {
namespace {

/// -1, 0, 1 along each axis: on the low side, between, on the high side.
std::array<int, 3> side_of(const VolumeMesh& mesh, const Vec3& x) {
  std::array<int, 3> side{};
  for (int axis = 0; axis < 3; ++axis)
    side[static_cast<std::size_t>(axis)] = x[axis] == mesh.low[axis] ? -1 : x[axis] == mesh.high[axis] ? 1 : 0;
  return side;
}

std::string set_name(const std::array<int, 3>& side) {
  std::string place;
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (side[axis] != 0) place += std::string(1, static_cast<char>('X' + axis)) + (side[axis] < 0 ? "0" : "1");
  return (place.size() == 2 ? "FACE_" : place.size() == 4 ? "EDGE_" : "CORNER_") + place;
}

}  // namespace

PeriodicSets periodic_sets(const VolumeMesh& mesh, bool periodic_z) {
  using Place = std::array<double, 3>;
  const auto place = [](const Vec3& x) { return Place{x.x(), x.y(), x.z()}; };
  PeriodicSets result;
  std::map<std::string, std::vector<std::pair<Place, std::uint32_t>>> sets;
  std::map<Place, std::uint32_t> boundary;
  for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
    const std::array<int, 3> side = side_of(mesh, mesh.points[p]);
    if (side == std::array<int, 3>{0, 0, 0}) continue;
    // Sorted by the coordinates along the side, which opposite sets share.
    Place along = place(mesh.points[p]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (side[axis] > 0) result.high[axis].push_back(p);
      if (side[axis] != 0) along[axis] = 0;
    }
    sets[set_name(side)].emplace_back(along, p);
    boundary[place(mesh.points[p])] = p;
  }
  for (auto& [name, members] : sets) {
    std::sort(members.begin(), members.end());
    PointSet set{name, {}};
    for (const auto& member : members) set.points.push_back(member.second);
    result.sets.push_back(std::move(set));
  }

  const auto find = [&](const Place& at) {
    const auto found = boundary.find(at);
    if (found == boundary.end())
      throw std::invalid_argument("periodic sets: no point at (" + std::to_string(at[0]) + ", " + std::to_string(at[1]) + ", " +
                                  std::to_string(at[2]) + ") m, where a point on the opposite side has its image");
    return found->second;
  };
  for (std::uint32_t p = 0; p < mesh.points.size(); ++p) {
    const std::array<int, 3> side = side_of(mesh, mesh.points[p]);
    PeriodicPair pair{p, p, {side[0] > 0, side[1] > 0, side[2] > 0 && periodic_z}};
    if (pair.across == std::array<bool, 3>{false, false, false}) continue;
    Place image = place(mesh.points[p]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (pair.across[axis]) image[axis] = mesh.low[static_cast<Eigen::Index>(axis)];
    pair.image = find(image);
    result.pairs.push_back(pair);
  }
  result.corner = find(place(mesh.low));
  return result;
}

}  // namespace relax
