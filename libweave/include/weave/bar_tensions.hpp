#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "weave/vec.hpp"

namespace weave {

/// Bars of one fiber at a step's start. Bar s goes from node s to node s + 1; the last node of a closed chain is the first one's image.
struct BarChain {
  bool closed = false;
  double axial_stiffness = 0;                   ///< E A [N]
  double compression_factor = 1;                ///< of it where a bar is slack
  std::span<const Vec3> tangent;                ///< (bars) of length one
  std::span<const double> length, rest_length;  ///< (bars) [m]
  std::span<const double> inverse_length;       ///< (bars) [1/m]
  std::span<const double> inverse_mass;         ///< (nodes) [1/kg]; 0: held
  std::span<const Vec3> v;                      ///< (nodes) half a step earlier [m/s]
};

/// Tensions of one fiber's bars, taken at the step's end: tau = k (l' - l0) with the predicted length l' = l + dt t.u + dt^2 |u_n|^2/(2 l),
/// u the difference of the end velocities and u_n its part normal to the bar, without which a turning bar would grow (SHAKE: Ryckaert et
/// al. 1977, with the bar's compliance; normal part from the velocities before the bars' pull). One unknown a bar, h the time of the kick:
/// (1/(dt h k) + J M^-1 J^T) lambda = J v + (l - l0)/dt + dt |u_n|^2/(2 l), lambda = h tau.
class BarTensions {
 public:
  /// Room for fibers of so many nodes.
  explicit BarTensions(std::size_t nodes);
  /// Adds the bars' pull over the time `kick` [s] to the nodes' change of velocity (nodes) [m/s], and notes the tensions (bars) [N].
  void pull(const BarChain& chain, double dt, double kick, std::span<Vec3> change, std::span<double> tension);

 private:
  void solve(std::uint32_t bars, double seam);

  std::vector<double> rate_, diagonal_, inverse_, upper_, multiplier_, corner_;  ///< (bars)
  std::vector<std::uint8_t> slack_;                                              ///< (bars)
};

}  // namespace weave
