#include "relax/series.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

namespace relax {
namespace {

/// a of the least squares line a + b n^-power, without count `left_out`.
double intercept(const std::vector<int>& counts, const std::vector<double>& values, double power, std::size_t left_out) {
  double n = 0, mean_t = 0, mean_v = 0;
  const auto t = [&](std::size_t i) { return std::pow(counts[i], -power); };
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (i == left_out) continue;
    n += 1;
    mean_t += t(i);
    mean_v += values[i];
  }
  mean_t /= n;
  mean_v /= n;
  double tt = 0, tv = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    if (i == left_out) continue;
    tt += (t(i) - mean_t) * (t(i) - mean_t);
    tv += (t(i) - mean_t) * (values[i] - mean_v);
  }
  return mean_v - tv / tt * mean_t;
}

}  // namespace

std::optional<Extrapolation> extrapolate(const std::vector<int>& counts, const std::vector<double>& values) {
  if (counts.size() != values.size()) throw std::invalid_argument("extrapolate: as many values as counts are needed");
  if (std::set<int>(counts.begin(), counts.end()).size() != counts.size() ||
      std::any_of(counts.begin(), counts.end(), [](int n) { return n < 1; }))
    throw std::invalid_argument("extrapolate: counts must be different and at least 1");
  if (counts.size() < 3) return std::nullopt;
  const std::size_t none = counts.size();
  Extrapolation e{intercept(counts, values, 1, none), 0};
  for (std::size_t i = 0; i < counts.size(); ++i)
    e.uncertainty = std::max(e.uncertainty, std::abs(intercept(counts, values, 1, i) - e.value));
  for (const double power : {0.5, 1.5}) e.uncertainty = std::max(e.uncertainty, std::abs(intercept(counts, values, power, none) - e.value));
  return e;
}

}  // namespace relax
