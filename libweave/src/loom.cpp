#include "weave/loom.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <stdexcept>

#include "weave/fiber_path.hpp"

namespace weave {
namespace {

constexpr double no_limit = 1e300;
constexpr double start_gap = 0.06;       ///< between fibers at the start [fiber diameters]
constexpr double guide_per_string = 50;  ///< guide stiffness in units of the string stiffness T/l
constexpr double rigid_factor = 1e3;     ///< transverse modulus of the reed's steel over the fibers'

double element_length(const Case& c, const FiberType& type) {
  return c.numerics.element_length * 2 * type.radius;
}

int rings_of(int fibers) {
  int k = 0;
  while (1 + 3 * k * (k + 1) < fibers) ++k;
  return k;
}

/// Yarns over one another in the sloping shed are nearer to each other than at the heddle: how much farther apart they must start.
double shed_stretch(const Case& c) {
  const double slope = 0.5 * c.loom.height / c.loom.length;
  return std::sqrt(1 + slope * slope);
}

double share_of_stroke(double t, double time) {
  const double u = time > 0 ? std::clamp(t / time, 0.0, 1.0) : (t >= 0 ? 1.0 : 0.0);
  return u * u;
}

/// Nodes that stay when a chain is edited: for each new node its old number, or none.
constexpr std::uint32_t none = 0xffffffffu;

/// Builds the model anew from fiber specs, with velocities and contacts carried over from the old nodes.
struct Rebuild {
  std::vector<FiberSpec> fibers;
  std::vector<std::vector<std::uint32_t>> old_node;  ///< per fiber, own nodes
  std::vector<Vec3> speed_of_new;                    ///< per fiber, of nodes without an old number
};

FiberSpec spec_of(const Model& m, const State& s, std::uint32_t f) {
  FiberSpec spec;
  spec.role = m.role[f];
  spec.periodic = m.periodic[f];
  spec.type = m.type[f];
  spec.yarn = m.yarn[f];
  spec.place = m.place[f];
  spec.end_force = m.end_force[f];
  spec.guide_stiffness = m.guide_stiffness[f];
  spec.guide_y = m.guide_y[f];
  const std::uint32_t begin = m.first[f], own = m.own_nodes(f);
  spec.x.assign(s.x.begin() + begin, s.x.begin() + begin + own);
  spec.rest_length.assign(m.rest_length.begin() + begin, m.rest_length.begin() + begin + (spec.periodic ? own : own - 1));
  spec.hold_all = spec.role == Role::reed || (spec.role == Role::weft && m.inverse_mass[begin] == 0);
  spec.hold_first = spec.role == Role::warp;
  return spec;
}

Rebuild take_apart(const Model& m, const State& s) {
  Rebuild r;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    r.fibers.push_back(spec_of(m, s, f));
    std::vector<std::uint32_t> old(m.own_nodes(f));
    for (std::uint32_t i = 0; i < old.size(); ++i) old[i] = m.first[f] + i;
    r.old_node.push_back(std::move(old));
    r.speed_of_new.emplace_back(Vec3::Zero());
  }
  return r;
}

void put_together(const Rebuild& r, Model& m, State& s) {
  Model next = m;
  for (auto* a : {&next.end_force, &next.guide_stiffness, &next.guide_y, &next.point_length, &next.rest_length, &next.tributary, &next.mass,
                  &next.inverse_mass}) {
    a->clear();
  }
  next.points.clear();
  next.first.clear();
  next.role.clear();
  next.periodic.clear();
  next.type.clear();
  next.yarn.clear();
  next.place.clear();
  next.fiber_of.clear();
  std::vector<Vec3> x, v;
  std::vector<std::uint32_t> new_node(m.nodes(), none);
  std::vector<std::uint32_t> new_fiber(m.fibers(), none);
  for (std::uint32_t f = 0; f < r.fibers.size(); ++f) {
    add_fiber(next, r.fibers[f], x);
    for (std::uint32_t i = 0; i < r.old_node[f].size(); ++i) {
      const std::uint32_t old = r.old_node[f][i];
      const std::uint32_t now = next.first[f] + i;
      v.push_back(old == none ? r.speed_of_new[f] : s.v[old]);
      if (next.inverse_mass[now] == 0 && next.role[f] != Role::reed) v.back().setZero();
      if (old == none) continue;
      new_node[old] = now;
      new_fiber[m.fiber_of[old]] = f;
    }
    if (r.fibers[f].periodic) v.push_back(v[next.first[f]]);
  }
  // Contacts whose nodes all stay keep their friction; a span is known by its node.
  ContactList contacts;
  std::vector<std::uint32_t> old_fiber(next.fibers(), none);
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (new_fiber[f] != none) old_fiber[new_fiber[f]] = f;
  }
  const auto carry_over = [&](const ActiveContacts& old, ActiveContacts& held) {
    held.of.assign(next.fibers() + 1, 0);
    for (std::uint32_t f = 0; f < next.fibers(); ++f) {
      if (const std::uint32_t o = old_fiber[f]; o != none && !old.of.empty()) {
        for (std::uint32_t i = old.of[o]; i < old.of[o + 1]; ++i) {
          LineContact c = old.line[i];
          if (!old.touch[i].is_held() || new_node[c.node] == none || new_node[c.span] == none) continue;
          c.node = new_node[c.node];
          c.span = new_node[c.span];
          c.asleep_until = 0;
          held.line.push_back(c);
          held.touch.push_back(old.touch[i]);
        }
      }
      held.of[f + 1] = static_cast<std::uint32_t>(held.line.size());
    }
  };
  carry_over(s.contacts.active, contacts.active);
  carry_over(s.contacts.on_reed, contacts.on_reed);
  m = std::move(next);
  s.x = std::move(x);
  s.v = std::move(v);
  s.moved.clear();
  s.x_pick.clear();
  s.travel.clear();
  s.amplitude.clear();
  s.tension.clear();
  s.contacts = std::move(contacts);
}

}  // namespace

std::vector<Eigen::Vector2d> bundle_section(int fibers, double radius, double gap, double width) {
  const double d = 2 * radius + gap;
  const double row = d * std::numbers::sqrt3 / 2;
  const int k = rings_of(fibers);
  const bool fits = (fibers == 5 ? 3 : 2 * k + 1) * d <= width;
  std::vector<Eigen::Vector2d> places;
  if (fibers == 1) {
    places = {{0, 0}};
  } else if (fibers == 3 && 2 * d <= width) {
    places = {{0, 2 * row / 3}, {-d / 2, -row / 3}, {d / 2, -row / 3}};
  } else if (fibers == 5 && fits) {
    places = {{0, -0.4 * row}, {-d, -0.4 * row}, {d, -0.4 * row}, {-d / 2, 0.6 * row}, {d / 2, 0.6 * row}};
  } else if (fits) {
    for (int r = -k; r <= k; ++r) {
      const int in_row = 2 * k + 1 - std::abs(r);
      for (int i = 0; i < in_row; ++i) places.emplace_back((i - 0.5 * (in_row - 1)) * d, r * row);
    }
  } else {  // an upright block of full rows, one over the other
    const int across = std::max(1, static_cast<int>(width / d));
    const int rows = (fibers + across - 1) / across;
    for (int i = 0; i < fibers; ++i) {
      const int r = i / across, in_row = std::min(across, fibers - r * across);
      places.emplace_back((i % across - 0.5 * (in_row - 1)) * d, (0.5 * (rows - 1) - r) * d);
    }
  }
  std::stable_sort(places.begin(), places.end(), [](const auto& p, const auto& q) { return p.squaredNorm() < q.squaredNorm(); });
  return places;
}

double bundle_height(int fibers, double radius, double width) {
  double high = 0, low = 0;
  for (const auto& p : bundle_section(fibers, radius, 2 * start_gap * radius, width)) {
    high = std::max(high, p.y());
    low = std::min(low, p.y());
  }
  return high - low + 2 * radius;
}

std::vector<Eigen::Vector2d> warp_section(const Case& c, const WarpPlace& warp, double radius) {
  auto places = bundle_section(warp.fibers, radius, 2 * start_gap * radius, warp.width);
  for (auto& p : places) p.y() *= shed_stretch(c);
  return places;
}

LoomLayout lay_out(const Case& c) {
  LoomLayout layout;
  std::set<std::string> used;
  for (const WarpSection& s : c.sections) used.insert(s.yarn);
  for (const std::string& y : c.weft.yarn_of_layer) used.insert(y);
  layout.type_names.assign(used.begin(), used.end());
  const auto type_index = [&](const std::string& name) {
    return static_cast<int>(std::find(layout.type_names.begin(), layout.type_names.end(), name) - layout.type_names.begin());
  };
  layout.matrix = c.matrix();
  double weft_height = 0;
  for (const std::string& name : c.weft.yarn_of_layer) {
    layout.weft_type.push_back(type_index(name));
    const YarnType& y = c.yarns.at(name);
    weft_height = std::max(weft_height, bundle_height(y.fibers, y.fiber_radius(), no_limit));
  }
  for (const std::string& name : layout.type_names) {
    layout.fiber_diameter = std::max(layout.fiber_diameter, 2 * c.yarns.at(name).fiber_radius());
  }
  const double opening = c.loom.dent_width - (c.beat_up.enabled ? 2 * c.loom.reed_bar_radius : 0);
  for (int s = 0; s < static_cast<int>(c.sections.size()); ++s) {
    const WarpSection& section = c.sections[s];
    const YarnType& yarn = c.yarns.at(section.yarn);
    // The sections of a dent share its opening by their fibers' diameters.
    double before = 0, all = 0;
    for (int o = 0; o < static_cast<int>(c.sections.size()); ++o) {
      if (c.sections[o].dent != section.dent) continue;
      const double d = c.yarns.at(c.sections[o].yarn).fiber_radius();
      if (o < s) before += d;
      all += d;
    }
    const double share = yarn.fiber_radius() / all;
    const double width = share * opening * (1 - start_gap);
    const double pitch = bundle_height(yarn.fibers, yarn.fiber_radius(), width) * (1 + start_gap) * shed_stretch(c);
    const auto warps = static_cast<int>(section.matrix.cols());
    for (int w = 0; w < warps; ++w) {
      WarpPlace p;
      p.section = s;
      p.type = type_index(section.yarn);
      p.y = section.dent * c.loom.dent_width + 0.5 * (c.loom.dent_width - opening) + (before / all + 0.5 * share) * opening;
      p.stack_z = (0.5 * (warps - 1) - w) * pitch;
      p.tension = section.tension > 0 ? section.tension : c.loom.tension;
      p.fibers = yarn.fibers;
      p.width = width;
      layout.warps.push_back(p);
    }
  }
  // As where a cell is cut off, half way between two columns, so that the cloth has no room to creep back into; but not so near that the
  // straight warps press the first weft out of their fork.
  layout.start_length = std::max(0.5 * c.take_up.length, 1.5 * weft_height);
  // What one pick can draw: the take-up with its crimp, and a warp that crosses the cloth, which is at most half as thick as the shed is
  // high.
  layout.stored_length = 1.5 * c.take_up.length + 0.5 * c.loom.height + 2 * c.numerics.element_length * layout.fiber_diameter;
  return layout;
}

double heddle_z(const Case& c, const WarpPlace& warp, int entry) {
  return warp.stack_z + 0.5 * entry * c.loom.height;
}

std::pair<Model, State> set_up_loom(const Case& c, const LoomLayout& layout) {
  Model m;
  State s;
  m.period_y = c.cell_width();
  m.friction = c.friction;
  m.damping = c.numerics.damping;
  m.axial_damping = c.numerics.axial_damping;
  m.implicit_axial = c.numerics.integrator == "imex";
  m.node_contact = c.numerics.contact == "node";
  m.guide_x = c.loom.length;
  double transverse = 0;
  for (const std::string& name : layout.type_names) {
    const YarnType& y = c.yarns.at(name);
    add_type(m, {y.fiber_radius(), y.fiber_area(), y.youngs_modulus, y.compression_factor, y.transverse_modulus, y.density,
                 y.bending_stiffness / y.fibers, y.friction_within});
    m.guide_ramp = std::max(m.guide_ramp, element_length(c, m.types.back()));
    transverse = std::max(transverse, y.transverse_modulus);
  }
  const double bar_radius = c.loom.reed_bar_radius;
  const std::uint16_t reed_type = add_type(
      m, {bar_radius, std::numbers::pi * bar_radius * bar_radius, rigid_factor * transverse, 1, rigid_factor * transverse, 7800, 0});
  finish_types(m);

  if (c.beat_up.enabled) {
    const double half_height = c.loom.height + layout.start_length + c.loom.length;
    for (int k = 0; k < c.dents(); ++k) {
      FiberSpec bar;
      bar.role = Role::reed;
      bar.type = reed_type;
      bar.yarn = -1;
      bar.place = k;
      const double x = c.beat_up.travel + bar_radius;
      bar.x = {Vec3(x, k * c.loom.dent_width, -half_height), Vec3(x, k * c.loom.dent_width, half_height)};
      bar.rest_length = {2 * half_height};
      bar.hold_all = true;
      add_fiber(m, bar, s.x);
    }
  }
  for (int w = 0; w < static_cast<int>(layout.warps.size()); ++w) {
    const WarpPlace& warp = layout.warps[w];
    const FiberType& type = m.types[warp.type];
    const double length = element_length(c, type);
    const double pull = warp.tension / warp.fibers;
    const double stretched = length * (1 + pull / (type.youngs_modulus * type.area));
    const double z_heddle = heddle_z(c, warp, layout.matrix(0, w));
    const auto places = warp_section(c, warp, type.radius);
    for (int i = 0; i < warp.fibers; ++i) {
      FiberSpec fiber;
      fiber.type = static_cast<std::uint16_t>(warp.type);
      fiber.yarn = w;
      fiber.place = i;
      fiber.hold_first = true;
      fiber.end_force = pull;
      fiber.guide_stiffness = guide_per_string * pull / length;
      fiber.guide_y = warp.y + places[i].x();
      const double offset = places[i].y();
      const Vec3 held(-layout.start_length, fiber.guide_y, warp.stack_z + offset);
      const Vec3 eye(c.loom.length, fiber.guide_y, z_heddle + offset);
      const double free_length = (eye - held).norm();
      const Vec3 along = (eye - held) / free_length;
      const auto nodes = static_cast<int>(std::ceil((free_length + layout.stored_length) / stretched)) + 1;
      for (int k = 0; k < nodes; ++k) {
        const double arc = k * stretched;
        fiber.x.push_back(arc <= free_length ? Vec3(held + arc * along) : Vec3(eye + Vec3(arc - free_length, 0, 0)));
        if (k > 0) fiber.rest_length.push_back(length);
      }
      add_fiber(m, fiber, s.x);
    }
  }
  s.v.assign(s.x.size(), Vec3::Zero());
  return {std::move(m), std::move(s)};
}

bool takes_up_after(const Case& c, int pick_in_cell) {
  return (pick_in_cell % c.layers + 1) % (c.layers / c.take_up.flags) == 0;
}

PickTimes pick_times(const Case& c, bool shed_changes, bool takes_up) {
  PickTimes t;
  const double stroke = c.beat_up.enabled ? 2 * c.beat_up.travel / c.beat_up.top_speed : 0;
  const double shed = shed_changes ? c.shedding.time : 0;
  t.beat_up = c.settle_time;
  const double at_fell = t.beat_up + stroke + (c.beat_up.enabled ? c.beat_up.dwell : 0);
  const double back = c.beat_up.enabled ? c.beat_up.return_time : 0;
  if (shed_changes && c.beat_up.return_delay > 0) {
    t.shedding = at_fell;
    t.reed_return = at_fell + c.beat_up.return_delay * shed;
    t.take_up = std::max(t.shedding + shed, t.reed_return + back) + c.settle_time;
  } else {
    t.reed_return = at_fell;
    t.shedding = at_fell + back + c.settle_time;
    t.take_up = t.shedding + shed + (shed_changes ? c.settle_time : 0);
  }
  t.end = t.take_up + (takes_up ? c.take_up.time + c.settle_time : 0);
  return t;
}

double reed_position(const Case& c, const PickTimes& times, double t) {
  const double stroke = 2 * c.beat_up.travel / c.beat_up.top_speed;
  const double forward = share_of_stroke(t - times.beat_up, stroke);
  const double back = share_of_stroke(t - times.reed_return, c.beat_up.return_time);
  return c.loom.reed_bar_radius + c.beat_up.travel * (1 - forward + back);
}

double shed_progress(const Case& c, const PickTimes& times, double t) {
  return share_of_stroke(t - times.shedding, c.shedding.time);
}

double take_up_progress(const Case& c, const PickTimes& times, double t) {
  return share_of_stroke(t - times.take_up, c.take_up.time);
}

void insert_weft(const Case& c, const LoomLayout& layout, int pick, Model& m, State& s) {
  const int row = pick % c.picks_per_cell();
  const int layer = c.layer_of_pick(row);
  const std::string& yarn_name = c.weft.yarn_of_layer[layer];
  const YarnType& yarn = c.yarns.at(yarn_name);
  const int type_number = layout.weft_type[layer];
  const FiberType& type = m.types[type_number];
  const double x = c.insertion.distance;

  double roof = 1e300, floor = -1e300;  // lowest surface of the raised warps, highest of the lowered ones, at the weft's place
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] != Role::warp) continue;
    const double r = m.type_of(f).radius;
    const std::optional<Vec3> at = fiber_at_x(m, s.x, f, x);
    if (!at) continue;
    if (layout.matrix(row, m.yarn[f]) > 0) {
      roof = std::min(roof, at->z() - r);
    } else {
      floor = std::max(floor, at->z() + r);
    }
  }
  const double height = bundle_height(yarn.fibers, type.radius, no_limit);
  if (roof == 1e300) roof = floor + 2 * height;
  if (floor == -1e300) floor = roof - 2 * height;
  if (roof - floor < height) {
    throw std::runtime_error(fmt::format(
        "pick {}: the shed is {:.4g} mm high at the weft's place, {:.4g} mm from the fell, but the weft yarn '{}' is {:.4g} mm high; "
        "raise loom.height or insertion.distance, or lengthen settle.time",
        pick + 1, 1e3 * (roof - floor), 1e3 * x, yarn_name, 1e3 * height));
  }
  const double z = 0.5 * (roof + floor);
  const auto elements = std::max(weft_bars_least, static_cast<int>(std::lround(m.period_y / element_length(c, type))));
  const double rest = m.period_y * c.weft.length_coefficient / elements;
  const auto places = bundle_section(yarn.fibers, type.radius, 2 * start_gap * type.radius, no_limit);

  Rebuild r = take_apart(m, s);
  for (int i = 0; i < yarn.fibers; ++i) {
    FiberSpec fiber;
    fiber.role = Role::weft;
    fiber.periodic = true;
    fiber.type = static_cast<std::uint16_t>(type_number);
    fiber.yarn = static_cast<int>(layout.warps.size()) + pick;
    fiber.place = i;
    for (int k = 0; k < elements; ++k) {
      fiber.x.emplace_back(x + places[i].x(), (k + 0.5) * m.period_y / elements, z + places[i].y());
    }
    fiber.rest_length.assign(elements, rest);
    r.fibers.push_back(std::move(fiber));
    r.old_node.emplace_back(elements, none);
    r.speed_of_new.emplace_back(Vec3::Zero());
  }
  put_together(r, m, s);
}

std::string stored_warp_lack(const Case& c, const LoomLayout& layout, const Model& m, const State& s) {
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] != Role::warp || s.x[m.last(f)].x() >= c.loom.length) continue;
    return fmt::format("a pick has drawn more than the {:.4g} mm of warp {} that is stored behind the heddle", 1e3 * layout.stored_length,
                       m.yarn[f] + 1);
  }
  return "";
}

std::size_t supply_warp(const Case& c, const LoomLayout& layout, Model& m, State& s) {
  if (const std::string lack = stored_warp_lack(c, layout, m, s); !lack.empty()) throw std::runtime_error(lack);
  Rebuild r = take_apart(m, s);
  std::size_t added = 0;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    FiberSpec& fiber = r.fibers[f];
    if (fiber.role != Role::warp) continue;
    const double left = fiber.x.back().x() - c.loom.length;
    const FiberType& type = m.types[fiber.type];
    const double rest = fiber.rest_length.back();
    const double stretched = rest * (1 + fiber.end_force / (type.youngs_modulus * type.area));
    r.speed_of_new[f] = Vec3(s.v[m.last(f)].x(), 0, 0);
    const auto count = static_cast<int>(std::ceil((layout.stored_length - left) / stretched));
    for (int k = 0; k < count; ++k) {
      fiber.x.emplace_back(fiber.x.back() + Vec3(stretched, 0, 0));
      fiber.rest_length.push_back(rest);
      r.old_node[f].push_back(none);
      ++added;
    }
  }
  if (added > 0) put_together(r, m, s);
  return added;
}

void cut_cloth(double plane, int first_kept_weft, int held_wefts, Model& m, State& s) {
  const Rebuild whole = take_apart(m, s);
  Rebuild r;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    FiberSpec fiber = whole.fibers[f];
    std::vector<std::uint32_t> old = whole.old_node[f];
    if (fiber.role == Role::weft && fiber.yarn < first_kept_weft) continue;
    if (fiber.role == Role::weft && fiber.yarn < first_kept_weft + held_wefts) fiber.hold_all = true;
    if (fiber.role == Role::warp) {
      std::size_t first = fiber.x.size() - 2;
      while (first > 0 && fiber.x[first - 1].x() >= plane) --first;
      const auto cut = static_cast<std::ptrdiff_t>(first);
      fiber.x.erase(fiber.x.begin(), fiber.x.begin() + cut);
      fiber.rest_length.erase(fiber.rest_length.begin(), fiber.rest_length.begin() + cut);
      old.erase(old.begin(), old.begin() + cut);
    }
    r.fibers.push_back(std::move(fiber));
    r.old_node.push_back(std::move(old));
    r.speed_of_new.emplace_back(Vec3::Zero());
  }
  put_together(r, m, s);
}

std::optional<Vec3> weft_center(const Model& m, const State& s, int yarn) {
  Vec3 sum = Vec3::Zero();
  int count = 0;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] != Role::weft || m.yarn[f] != yarn) continue;
    for (std::uint32_t p = m.first[f]; p < m.last(f); ++p) {
      sum += s.x[p];
      ++count;
    }
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

OrderCheck check_order(const Case& c, const LoomLayout& layout, const Model& m, const State& s) {
  OrderCheck result;
  const auto warps = static_cast<int>(layout.warps.size());
  std::vector<std::vector<std::uint32_t>> fibers_of_warp(warps);
  int weft_low = 1 << 30, weft_high = -1;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] == Role::warp) fibers_of_warp[m.yarn[f]].push_back(f);
    if (m.role[f] == Role::weft) {
      weft_low = std::min(weft_low, m.yarn[f]);
      weft_high = std::max(weft_high, m.yarn[f]);
    }
  }
  std::vector<std::vector<std::uint32_t>> fibers_of_weft(std::max(0, weft_high - weft_low + 1));
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] == Role::weft) fibers_of_weft[m.yarn[f] - weft_low].push_back(f);
  }
  struct WrongSide {
    int warp, wanted;
    Vec3 weft;
  };
  const auto pick_of = [&](std::size_t k) { return weft_low + static_cast<int>(k) - warps; };
  std::vector<std::vector<WrongSide>> wrong_sides(fibers_of_weft.size());
#pragma omp parallel for schedule(dynamic, 1)
  for (std::size_t k = 0; k < fibers_of_weft.size(); ++k) {
    const int pick = pick_of(k);
    for (int w = 0; w < warps; ++w) {
      // Fiber by fiber: a yarn may be spread far along the other.
      const int wanted = layout.matrix(pick % c.picks_per_cell(), w);
      Vec3 weft = Vec3::Zero();
      int right = 0, wrong = 0;
      for (const std::uint32_t f : fibers_of_weft[k]) {
        const Vec3 at = periodic_fiber_at_y(m, s.x, f, layout.warps[w].y);
        for (const std::uint32_t g : fibers_of_warp[w]) {
          const int side = passes_over(m, s.x, g, at);
          right += side == wanted;
          wrong += side == -wanted;
        }
        weft += at / static_cast<double>(fibers_of_weft[k].size());
      }
      if (wrong > right) wrong_sides[k].push_back({w, wanted, weft});
    }
  }
  for (std::size_t k = 0; k < wrong_sides.size(); ++k) {
    for (const auto& [w, wanted, weft] : wrong_sides[k]) {
      if (result.violations++ > 0) continue;
      result.first =
          fmt::format("warp {} lies {} weft {} at x = {:.4g} mm, y = {:.4g} mm, but the weaving matrix puts it {}", w + 1,
                      wanted > 0 ? "under" : "over", pick_of(k) + 1, 1e3 * weft.x(), 1e3 * weft.y(), wanted > 0 ? "over" : "under");
    }
  }
  return result;
}

namespace {

/// Mean tension of the bars at a node.
double node_tension(const Model& m, const std::vector<double>& bar_tension, std::uint32_t f, std::uint32_t p) {
  const bool closed = m.periodic[f];
  const std::uint32_t last = m.last(f);
  const double after = p < last ? bar_tension[p] : (closed ? bar_tension[m.first[f]] : bar_tension[p - 1]);
  const double before = p > m.first[f] ? bar_tension[p - 1] : (closed ? bar_tension[last - 1] : after);
  return 0.5 * (before + after);
}

void begin_fiber(const Model& m, std::uint32_t f, Snapshot& snap) {
  if (snap.offset.empty()) snap.offset.push_back(0);
  snap.yarn.push_back(m.yarn[f]);
  snap.fiber.push_back(m.place[f]);
  snap.weft.push_back(m.role[f] == Role::weft);
  snap.radius.push_back(m.type_of(f).radius);
  snap.area.push_back(m.type_of(f).area);
}

void add_whole_fiber(const Model& m, const Engine& engine, std::uint32_t f, Snapshot& snap) {
  begin_fiber(m, f, snap);
  double arc = 0;
  for (std::uint32_t p = m.first[f]; p <= m.last(f); ++p) {
    snap.x.push_back(engine.state().x[p]);
    snap.tension.push_back(node_tension(m, engine.tension(), f, p));
    snap.arc.push_back(arc);
    arc += m.rest_length[p];
  }
  snap.offset.push_back(static_cast<std::int64_t>(snap.x.size()));
}

}  // namespace

Snapshot snapshot_of_loom(const Case& c, const Engine& engine, int pick) {
  const Model& m = engine.model();
  Snapshot snap;
  snap.time = engine.state().time;
  snap.pick = pick;
  snap.cell_width = m.period_y;
  snap.x_max = c.loom.length;
  for (std::uint32_t f = 0; f < m.fibers(); ++f) {
    if (m.role[f] == Role::reed) continue;
    add_whole_fiber(m, engine, f, snap);
    if (m.role[f] == Role::warp) snap.x_min = std::min(snap.x_min, engine.state().x[m.first[f]].x());
  }
  return snap;
}

double cell_end(const Case& c, const LoomLayout& layout, const Model& m, const State& s, int first_pick) {
  double x_last = 0;
  int count = 0;
  for (int k = c.picks_per_cell() - c.layers; k < c.picks_per_cell(); ++k) {
    if (const auto center = weft_center(m, s, static_cast<int>(layout.warps.size()) + first_pick + k)) {
      x_last += center->x();
      ++count;
    }
  }
  if (count == 0) throw std::runtime_error(fmt::format("the cell of picks {}... is no longer on the loom", first_pick + 1));
  return x_last / count + 0.5 * c.take_up.length;
}

}  // namespace weave
