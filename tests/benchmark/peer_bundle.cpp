// Speed of explicit dynamics on two crossing layers of 19-fiber yarns that just touch, beside that of a particle code on the same nodes:
//     heddle_peer_bundle [DIAMETERS] [STEPS] [node|line] [explicit|imex] [ELEMENT] [TIME_STEP]
//     heddle_peer_bundle --write-lammps FILE [DIAMETERS]
// The layers are DIAMETERS wide; an ELEMENT is one diameter long unless told otherwise, a time step 20 ns, or as long as stability lets it
// with TIME_STEP 0.
// The second form writes the nodes, bonds and velocities for LAMMPS; peer_bundle.lmp holds the rest. There the fibers along x are
// periodic too and weak tethers hold the nodes; here those fibers end at the sides, and nothing else holds them.
#include <fmt/format.h>
#include <fmt/os.h>
#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "weave/engine.hpp"
#include "weave/peak_memory.hpp"

namespace {

using weave::Vec3;

constexpr double diameter = 0.33e-3;                               // [m]
constexpr double contact_diameter = 1.005 * diameter;              // [m]
constexpr double density = 2460;                                   // [kg/m^3]
constexpr double youngs_modulus = 87e9, transverse_modulus = 2e9;  // [Pa]
constexpr double friction = 0.3;
constexpr double viscosity = 1.5e-3;     // of a node [N s/m]
constexpr double time_step = 2e-8;       // [s]
constexpr double random_speed = 0.1;     // standard deviation of each component [m/s]
constexpr double skin = 0.2 * diameter;  // [m]
constexpr double warm_up = 2e-5;         // [s]
constexpr int rounds = 5;
constexpr int yarn_pitch = 5;  // [diameters]

struct Fiber {
  int layer, yarn, place;  ///< layer 0 along x, above; 1 along y, below
  std::vector<Vec3> x;
};

/// Two layers of yarns over a square of n diameters; 19 fibers a yarn, hexagonally packed, with nodes `element` diameters apart.
std::vector<Fiber> bundle(int n, double element) {
  const double row = std::sqrt(3.0) / 2, half = (4 * row + 1) / 2;
  std::vector<Fiber> fibers;
  for (int layer = 0; layer < 2; ++layer) {
    for (int yarn = 0; yarn < n / yarn_pitch; ++yarn) {
      int place = 0;
      for (int r = -2; r <= 2; ++r) {
        const int wide = 5 - std::abs(r);
        for (int i = 0; i < wide; ++i) {
          Fiber fiber{layer, yarn, place++, {}};
          const double side = yarn_pitch * yarn + 2.25 + i - 0.5 * (wide - 1), z = r * row;
          for (int k = 0; k < static_cast<int>(n / element); ++k) {
            const double along = (k + 0.25) * element;
            fiber.x.push_back(diameter * (layer == 0 ? Vec3(along, side, half + z) : Vec3(side, along, z - half)));
          }
          fibers.push_back(std::move(fiber));
        }
      }
    }
  }
  return fibers;
}

std::vector<Vec3> random_velocities(std::size_t nodes) {
  std::mt19937_64 generator(12345);
  std::normal_distribution<double> component(0, random_speed);
  std::vector<Vec3> v(nodes);
  Vec3 sum = Vec3::Zero();
  for (Vec3& velocity : v) {
    velocity = {component(generator), component(generator), component(generator)};
    sum += velocity;
  }
  for (Vec3& velocity : v) velocity -= sum / static_cast<double>(nodes);
  return v;
}

void write_lammps(const std::string& file, int n) {
  const std::vector<Fiber> fibers = bundle(n, 1);
  const std::size_t nodes = fibers.size() * static_cast<std::size_t>(n);
  const std::vector<Vec3> v = random_velocities(nodes);
  const double mass = density * std::numbers::pi / 4 * std::pow(diameter, 3), side = n * diameter;
  const double sphere_density = mass / (std::numbers::pi / 6 * std::pow(contact_diameter, 3));
  auto out = fmt::output_file(file);
  out.print("bundle of {0} x {0} diameters\n\n{1} atoms\n{1} bonds\n2 atom types\n1 bond types\n\n0 {2:.12g} xlo xhi\n0 {2:.12g} ylo yhi\n",
            n, nodes, side);
  out.print("{:.12g} {:.12g} zlo zhi\n\nAtoms # hybrid\n\n", -8 * diameter, 8 * diameter);
  std::size_t id = 0;
  for (std::size_t f = 0; f < fibers.size(); ++f) {
    for (const Vec3& x : fibers[f].x) {
      const auto wrapped = [&](double a) { return a - side * std::floor(a / side); };
      out.print("{} {} {:.12g} {:.12g} {:.12g} {:.12g} {:.12g} {}\n", ++id, fibers[f].layer + 1, wrapped(x.x()), wrapped(x.y()), x.z(),
                contact_diameter, sphere_density, f + 1);
    }
  }
  out.print("\nVelocities\n\n");
  for (std::size_t i = 0; i < nodes; ++i) out.print("{} {:.8g} {:.8g} {:.8g} 0 0 0\n", i + 1, v[i].x(), v[i].y(), v[i].z());
  out.print("\nBonds\n\n");
  const auto width = static_cast<std::size_t>(n);
  for (std::size_t i = 0; i < nodes; ++i) out.print("{} 1 {} {}\n", i + 1, i + 1, i / width * width + (i + 1) % width + 1);
}

weave::Engine engine_of(int n, bool node_contact, bool implicit, double element, double step) {
  weave::Model model;
  weave::State state;
  model.period_y = n * diameter;
  model.friction = friction;
  model.damping = viscosity / (density * std::numbers::pi / 4 * std::pow(diameter, 3));
  model.axial_damping = 0;
  model.implicit_axial = implicit;
  model.node_contact = node_contact;
  weave::FiberType type;
  type.radius = contact_diameter / 2;
  type.area = std::numbers::pi / 4 * diameter * diameter;
  type.youngs_modulus = youngs_modulus;
  type.transverse_modulus = transverse_modulus;
  type.density = density;
  weave::add_type(model, type);
  weave::finish_types(model);
  const int yarns_a_layer = n / yarn_pitch;
  const int nodes = static_cast<int>(n / element);
  for (Fiber& fiber : bundle(n, element)) {
    weave::FiberSpec spec;
    spec.role = fiber.layer == 0 ? weave::Role::warp : weave::Role::weft;
    spec.periodic = fiber.layer == 1;
    spec.yarn = fiber.layer * yarns_a_layer + fiber.yarn;
    spec.place = fiber.place;
    spec.rest_length.assign(static_cast<std::size_t>(spec.periodic ? nodes : nodes - 1), element * diameter);
    spec.x = std::move(fiber.x);
    weave::add_fiber(model, spec, state.x);
  }
  const std::vector<Vec3> random = random_velocities(model.fibers() * static_cast<std::size_t>(nodes));
  state.v.assign(model.nodes(), Vec3::Zero());
  std::size_t next = 0;
  for (std::size_t f = 0; f < model.fibers(); ++f) {
    for (std::uint32_t p = model.first[f]; p < model.first[f] + model.own_nodes(f); ++p) state.v[p] = random[next++];
    if (model.periodic[f]) state.v[model.last(f)] = state.v[model.first[f]];
  }
  weave::EngineOptions options;
  options.skin = skin;
  options.outer_skin = 2 * skin;
  options.time_step = step;
  return {std::move(model), std::move(state), options};
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

}  // namespace

int main(int argc, char** argv) try {
  const std::vector<std::string> words(argv + 1, argv + argc);
  const auto word = [&](std::size_t i, const std::string& otherwise) { return i < words.size() ? words[i] : otherwise; };
  if (word(0, "") == "--write-lammps") {
    write_lammps(word(1, "bundle.data"), std::stoi(word(2, "50")));
    return 0;
  }
  const int n = std::stoi(word(0, "50")), steps = std::stoi(word(1, "4000"));
  const double element = std::stod(word(4, "1"));
  weave::Engine engine =
      engine_of(n, word(2, "node") == "node", word(3, "explicit") == "imex", element, words.size() > 5 ? std::stod(words[5]) : time_step);
  weave::Drive drive;
  drive.guide_z.assign(engine.model().fibers(), 0);
  drive.guide_speed.assign(engine.model().fibers(), 0);
  const auto run = [&](int count) {
    for (int i = 0; i < count; ++i) {
      if (const auto report = engine.step(drive); report.status != weave::StepStatus::ok) throw std::runtime_error(report.message);
    }
  };
  while (engine.state().time < warm_up) run(1);
  const double memory = weave::peak_memory_bytes();
  std::vector<double> all, search, contact, motion;
  const double node_steps = 1e-9 * static_cast<double>(engine.model().nodes()) * steps / rounds;
  const auto searches = engine.state().searches;
  const double time_before = engine.state().time;
  for (int i = 0; i < rounds; ++i) {
    const weave::StageTimes before = engine.stage_times();
    const auto start = std::chrono::steady_clock::now();
    run(steps / rounds);
    all.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / node_steps);
    const weave::StageTimes& after = engine.stage_times();
    search.push_back((after.search - before.search) / node_steps);
    contact.push_back((after.contact - before.contact) / node_steps);
    motion.push_back((after.integrate - before.integrate) / node_steps);
  }
  const auto nodes = static_cast<double>(engine.model().nodes());
  fmt::print("{} nodes, {} law, {} bars, {} threads, {} steps in {} rounds, medians\n", engine.model().nodes(), word(2, "node"),
             word(3, "explicit"), omp_get_max_threads(), steps, rounds);
  fmt::print("  a node and step [ns]: {:.1f} = search {:.1f} + contact {:.1f} + bars and motion {:.1f}\n", median(all), median(search),
             median(contact), median(motion));
  fmt::print("  a node: {:.2f} contacts listed, {:.2f} near, {:.0f} bytes at most; {} searches in these steps, {} late\n",
             static_cast<double>(engine.state().contacts.line.size()) / nodes,
             static_cast<double>(engine.state().contacts.active.number.size()) / nodes, memory / nodes, engine.state().searches - searches,
             engine.state().late_searches);
  const double mean_step = (engine.state().time - time_before) / (steps / rounds * rounds);
  fmt::print("  elements of {:g} d, steps of {:.3g} us: a microsecond of a diameter of fiber takes {:.3g} ns\n", element, 1e6 * mean_step,
             median(all) / (element * 1e6 * mean_step));
  return 0;
} catch (const std::exception& e) {
  fmt::print(stderr, "{}\n", e.what());
  return 1;
}
