#include "weave/checkpoint.hpp"

#include <fmt/format.h>

#include <array>
#include <span>
#include <stdexcept>

#include "hdf5_file.hpp"
#include "history_file.hpp"

namespace weave {
namespace {

/// Rises with every change of what a checkpoint holds or of what it means.
constexpr std::int64_t format = 5;

void write_vectors(Hdf5File& file, const std::string& path, const std::vector<Vec3>& v) {
  file.write_rows<double>(path, std::span<const double>(v.empty() ? nullptr : v.front().data(), 3 * v.size()), 3);
}

std::vector<Vec3> read_vectors(const Hdf5File& file, const std::string& path) {
  const Hdf5Array<double> a = file.read_rows<double>(path);
  std::vector<Vec3> v(a.rows);
  for (std::size_t i = 0; i < a.rows; ++i) v[i] = Vec3(a.values[3 * i], a.values[3 * i + 1], a.values[3 * i + 2]);
  return v;
}

/// Pointers to the scalars of a state, const or not, in the order of the file.
auto scalars_of(auto& s) {
  auto& w = s.flows;
  return std::array{&s.time, &s.dt, &s.dt_before, &w.slip, &w.damping, &w.axial, &w.guides, &w.tension, &w.reed, &w.heddle, &w.take_up};
}

/// Calls f with each integer of a contact, const or not, in the order of the file.
void each_place(auto& c, auto&& f) {
  f(c.node);
  f(c.span);
  f(c.image);
}

/// And with each of its numbers.
void each_number(auto& c, auto&& f) {
  f(c.at);
  f(c.asleep_until);
}

void write_contacts(Hdf5File& file, const std::string& path, const std::vector<LineContact>& contacts) {
  std::vector<std::int64_t> places;
  std::vector<double> numbers;
  for (const LineContact& c : contacts) {
    each_place(c, [&](auto place) { places.push_back(place); });
    each_number(c, [&](auto number) { numbers.push_back(number); });
  }
  file.write(path, places);
  file.write(path + "_numbers", numbers);
}

std::vector<LineContact> read_contacts(const Hdf5File& file, const std::string& path) {
  const auto places = file.read<std::int64_t>(path);
  const auto numbers = file.read<double>(path + "_numbers");
  std::vector<LineContact> contacts;
  std::size_t place = 0, number = 0;
  while (place < places.size()) {
    LineContact& c = contacts.emplace_back();
    each_place(c, [&](auto& p) { p = static_cast<std::remove_reference_t<decltype(p)>>(places.at(place++)); });
    each_number(c, [&](auto& n) { n = static_cast<std::remove_reference_t<decltype(n)>>(numbers.at(number++)); });
  }
  return contacts;
}

void write_active(Hdf5File& file, const std::string& path, const ActiveContacts& active) {
  file.write(path, active.number);
  file.write(path + "_of", active.of);
  write_contacts(file, path + "_line", active.line);
  std::vector<double> touches;
  for (const Touch& t : active.touch) touches.insert(touches.end(), {t.along, t.across, t.stiffness, t.overlap, t.spared});
  file.write(path + "_touch", touches);
}

ActiveContacts read_active(const Hdf5File& file, const std::string& path) {
  ActiveContacts active;
  active.number = file.read<std::uint32_t>(path);
  active.of = file.read<std::uint32_t>(path + "_of");
  active.line = read_contacts(file, path + "_line");
  const std::vector<double> t = file.read<double>(path + "_touch");
  for (std::size_t i = 0; i < t.size(); i += 5) {
    active.touch.push_back({t.at(i), t.at(i + 1), t.at(i + 2), static_cast<float>(t.at(i + 3)), static_cast<float>(t.at(i + 4))});
  }
  return active;
}

template <class To, class From>
std::vector<To> as(const std::vector<From>& v) {
  std::vector<To> result;
  result.reserve(v.size());
  for (const From& e : v) result.push_back(static_cast<To>(e));
  return result;
}

/// Visits each plain member of the model's fiber arrays with its name, for writing and reading alike.
template <class M, class F>
void each_double(M& m, F&& f) {
  f("end_force", m.end_force);
  f("guide_stiffness", m.guide_stiffness);
  f("guide_y", m.guide_y);
  f("point_length", m.point_length);
  f("rest_length", m.rest_length);
  f("tributary", m.tributary);
  f("mass", m.mass);
  f("inverse_mass", m.inverse_mass);
}

std::vector<double> scalars_of(const Model& m) {
  std::vector<double> s = {m.period_y, m.friction,  m.damping, m.axial_damping, double(m.implicit_axial), double(m.node_contact),
                           m.guide_x,  m.guide_ramp};
  for (const FiberType& t : m.types) {
    s.insert(s.end(), {t.radius, t.area, t.youngs_modulus, t.compression_factor, t.transverse_modulus, t.density, t.bending_stiffness,
                       t.friction_within.value_or(m.friction)});
  }
  return s;
}

void set_scalars(const std::vector<double>& s, Model& m) {
  m.period_y = s[0];
  m.friction = s[1];
  m.damping = s[2];
  m.axial_damping = s[3];
  m.implicit_axial = s[4] != 0;
  m.node_contact = s[5] != 0;
  m.guide_x = s[6];
  m.guide_ramp = s[7];
  for (std::size_t i = 8; i + 7 < s.size(); i += 8) {
    add_type(m, {s[i], s[i + 1], s[i + 2], s[i + 3], s[i + 4], s[i + 5], s[i + 6], s[i + 7]});
  }
  finish_types(m);
}

}  // namespace

void write_checkpoint(const std::filesystem::path& path, const Checkpoint& c) {
  Hdf5File file = Hdf5File::create(path);
  file.write("/format", std::vector<std::int64_t>{format});
  file.write_text("/case", c.case_toml);
  file.write("/run/numbers", c.loom_numbers);
  file.write("/run/counters", c.loom_counters);
  const Model& m = c.model;
  file.write("/model/scalars", scalars_of(m));
  file.write("/model/first", m.first);
  file.write("/model/role", as<std::uint8_t>(m.role));
  file.write("/model/periodic", m.periodic);
  file.write("/model/type", as<std::uint32_t>(m.type));
  file.write("/model/yarn", as<std::int32_t>(m.yarn));
  file.write("/model/place", as<std::int32_t>(m.place));
  file.write("/model/points", m.points);
  file.write("/model/fiber_of", m.fiber_of);
  each_double(m, [&](const char* name, const std::vector<double>& v) { file.write(std::string("/model/") + name, v); });
  const State& s = c.state;
  std::vector<double> scalars;
  for (const double* v : scalars_of(s)) scalars.push_back(*v);
  file.write("/state/scalars", scalars);
  file.write("/state/counters", std::vector<std::int64_t>{s.step, s.searches, s.picks_of_active, s.late_searches, s.calm_steps});
  write_vectors(file, "/state/x", s.x);
  write_vectors(file, "/state/v", s.v);
  file.write("/state/moved", s.moved);
  write_vectors(file, "/state/x_pick", s.x_pick);
  file.write("/state/travel", s.travel);
  file.write("/state/frequency2", std::vector<double>{s.frequency2});
  file.write("/state/amplitude", s.amplitude);
  file.write("/state/tension", s.tension);
  write_contacts(file, "/contacts/line", s.contacts.line);
  file.write("/contacts/line_of", s.contacts.line_of);
  write_active(file, "/contacts/active", s.contacts.active);
  write_active(file, "/contacts/on_reed", s.contacts.on_reed);
  write_history(file, c.history);
  file.commit();
}

Checkpoint read_checkpoint(const std::filesystem::path& path) {
  const Hdf5File file = Hdf5File::open(path);
  const std::int64_t written = file.has("/format") ? file.read<std::int64_t>("/format").front() : 1;
  if (written != format) {
    throw std::runtime_error(
        fmt::format("{}: a checkpoint of format {}, but this version of Heddle reads format {}; go on with the version "
                    "that wrote it, or weave the case anew",
                    path.string(), written, format));
  }
  Checkpoint c;
  c.case_toml = file.read_text("/case");
  c.loom_numbers = file.read<double>("/run/numbers");
  c.loom_counters = file.read<std::int64_t>("/run/counters");
  Model& m = c.model;
  set_scalars(file.read<double>("/model/scalars"), m);
  m.first = file.read<std::uint32_t>("/model/first");
  for (const std::uint8_t r : file.read<std::uint8_t>("/model/role")) m.role.push_back(static_cast<Role>(r));
  m.periodic = file.read<std::uint8_t>("/model/periodic");
  m.type = as<std::uint16_t>(file.read<std::uint32_t>("/model/type"));
  m.yarn = as<int>(file.read<std::int32_t>("/model/yarn"));
  m.place = as<int>(file.read<std::int32_t>("/model/place"));
  m.points = file.read<std::uint32_t>("/model/points");
  m.fiber_of = file.read<std::uint32_t>("/model/fiber_of");
  each_double(m, [&](const char* name, std::vector<double>& v) { v = file.read<double>(std::string("/model/") + name); });
  State& s = c.state;
  const std::vector<double> scalars = file.read<double>("/state/scalars");
  for (std::size_t i = 0; double* v : scalars_of(s)) *v = scalars.at(i++);
  const std::vector<std::int64_t> k = file.read<std::int64_t>("/state/counters");
  s.step = k[0];
  s.searches = k[1];
  s.picks_of_active = k[2];
  s.late_searches = k[3];
  s.calm_steps = static_cast<int>(k[4]);
  s.x = read_vectors(file, "/state/x");
  s.v = read_vectors(file, "/state/v");
  s.moved = file.read<double>("/state/moved");
  s.x_pick = read_vectors(file, "/state/x_pick");
  s.travel = file.read<double>("/state/travel");
  s.frequency2 = file.read<double>("/state/frequency2").front();
  s.amplitude = file.read<double>("/state/amplitude");
  s.tension = file.read<double>("/state/tension");
  s.contacts.line = read_contacts(file, "/contacts/line");
  s.contacts.line_of = file.read<std::uint32_t>("/contacts/line_of");
  s.contacts.active = read_active(file, "/contacts/active");
  s.contacts.on_reed = read_active(file, "/contacts/on_reed");
  c.history = read_history(file);
  return c;
}

}  // namespace weave
