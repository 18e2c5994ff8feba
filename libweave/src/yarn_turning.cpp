#include "weave/yarn_turning.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace weave {
namespace {

constexpr auto none = std::numeric_limits<std::uint32_t>::max();

}  // namespace

YarnTurning::YarnTurning(const Model& m) {
  std::map<std::pair<Role, int>, std::vector<std::uint32_t>> fibers_of;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] != Role::reed) fibers_of[{m.role[f], m.yarn[f]}].push_back(f);
  }
  yarn_of_.assign(m.fibers(), none);
  for (auto& [name, fibers] : fibers_of) {
    if (fibers.size() < 2) continue;
    Yarn yarn;
    yarn.start.resize(fibers.size());
    for (const std::uint32_t f : fibers) yarn_of_[f] = static_cast<std::uint32_t>(yarn_.size());
    yarn.fibers = std::move(fibers);
    yarn_.push_back(std::move(yarn));
  }
  rate_.assign(m.nodes(), 0);
  couple_.assign(m.nodes(), 0);
}

void YarnTurning::align(const Model& m, std::span<const Vec3> x, double active_x_max) {
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t y = 0; y < yarn_.size(); ++y) {
    Yarn& yarn = yarn_[y];
    const std::uint32_t f = yarn.fibers.front();
    for (const std::uint32_t fiber : yarn.fibers) std::fill(rate_.begin() + m.first[fiber], rate_.begin() + m.first[fiber + 1], 0);
    // Where along the first fiber the others are looked for: near the fell, where yarns are dense.
    std::uint32_t place = m.first[f];
    for (std::uint32_t p = place; p < m.first[f] + m.own_nodes(f); ++p) {
      if (std::abs(x[p].x()) < std::abs(x[place].x())) place = p;
    }
    if (m.periodic[f]) place = m.first[f];
    std::uint32_t before = place - m.first[f], after = m.own_nodes(f) - before;
    for (std::size_t k = 0; k < yarn.fibers.size(); ++k) {
      const std::uint32_t other = yarn.fibers[k];
      std::uint32_t beside = m.first[other];
      for (std::uint32_t p = beside; p < m.first[other] + m.own_nodes(other) && !m.periodic[other]; ++p) {
        if ((x[p] - x[place]).squaredNorm() < (x[beside] - x[place]).squaredNorm()) beside = p;
      }
      yarn.start[k] = beside;
      before = std::min(before, beside - m.first[other]);
      after = std::min(after, m.first[other] + m.own_nodes(other) - beside);
    }
    while (after > 0 && x[place + after - 1].x() > active_x_max) --after;
    for (std::uint32_t& start : yarn.start) start -= before;
    yarn.sections = before + after < 2 ? 0 : before + after;
    yarn.needed = {0, yarn.sections};
  }
  std::uint32_t sections = 0;
  for (Yarn& yarn : yarn_) {
    yarn.first = sections;
    sections += yarn.sections;
  }
  section_.resize(sections);
}

void YarnTurning::leave_out_untouched(const Model& m, const ActiveContacts& contacts) {
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t y = 0; y < yarn_.size(); ++y) {
    Yarn& yarn = yarn_[y];
    yarn.needed = {};
    for (std::size_t k = 0; k < yarn.fibers.size(); ++k) {
      const std::uint32_t fiber = yarn.fibers[k], start = yarn.start[k];
      for (std::uint32_t i = contacts.of[fiber]; i < contacts.of[fiber + 1]; ++i) {
        const LineContact& c = contacts.line[i];
        if (yarn_of_[m.fiber_of[c.span]] == y && c.node >= start && c.node < start + yarn.sections) yarn.needed.add(c.node - start);
      }
    }
  }
}

bool YarnTurning::is_first(std::uint32_t fiber) const {
  return yarn_of_[fiber] != none && yarn_[yarn_of_[fiber]].fibers.front() == fiber;
}

void YarnTurning::find(const Model& m, std::uint32_t first_fiber, std::span<const Vec3> x, std::span<const Vec3> v) {
  const Yarn& yarn = yarn_[yarn_of_[first_fiber]];
  if (yarn.needed.empty()) return;
  const double share = 1.0 / static_cast<double>(yarn.start.size());
  const auto centroid = [&](std::uint32_t i) {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t start : yarn.start) sum += x[start + i];
    return Vec3(share * sum);
  };
  const bool closed = m.periodic[m.fiber_of[yarn.start.front()]];
  const Vec3 period(0, closed ? m.period_y : 0, 0);
  const std::uint32_t begin = yarn.needed.begin;
  Vec3 here = centroid(begin);
  Vec3 before = begin > 0 ? centroid(begin - 1) : closed ? Vec3(centroid(yarn.sections - 1) - period) : here;
  for (std::uint32_t i = begin; i < yarn.needed.end; ++i) {
    const bool at_end = i + 1 == yarn.sections;
    const Vec3 after = !at_end ? centroid(i + 1) : closed ? Vec3(centroid(0) + period) : here;
    Section& section = section_[yarn.first + i];
    section.centroid = here;
    section.axis = (after - before).normalized();
    double momentum = 0, inertia = 0;
    for (const std::uint32_t start : yarn.start) {
      const Vec3 arm = section.axis.cross(x[start + i] - here);
      momentum += arm.dot(v[start + i]);
      inertia += arm.squaredNorm();
    }
    section.inverse_inertia = inertia > 0 ? 1 / inertia : 0;
    const double rate = section.inverse_inertia * momentum;
    for (const std::uint32_t start : yarn.start) rate_[start + i] = rate;
    before = here;
    here = after;
  }
}

void YarnTurning::add_forces(std::uint32_t fiber, std::span<const Vec3> x, std::span<Vec3> force) const {
  if (yarn_of_[fiber] == none) return;
  const Yarn& yarn = yarn_[yarn_of_[fiber]];
  const std::uint32_t start = yarn.start[static_cast<std::size_t>(std::ranges::lower_bound(yarn.fibers, fiber) - yarn.fibers.begin())];
  for (std::uint32_t i = yarn.needed.begin; i < yarn.needed.end; ++i) {
    double couple = 0;
    for (const std::uint32_t s : yarn.start) couple += couple_[s + i];
    if (couple == 0) continue;
    const Section& section = section_[yarn.first + i];
    const std::uint32_t p = start + i;
    force[p] += (couple * section.inverse_inertia) * section.axis.cross(x[p] - section.centroid);
  }
}

}  // namespace weave
