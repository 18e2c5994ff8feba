// Time of the kernels that a step is made of, each by itself on two crossing yarns of nineteen fibers at a touch: seconds an item (a
// contact, a bar, a node), printed by Google Benchmark as its counter "each".
#include <benchmark/benchmark.h>

#include <algorithm>
#include <vector>

#include "scenes/bundles.hpp"
#include "scenes/scenes.hpp"
#include "weave/bar_tensions.hpp"

namespace {

using namespace scenes;
using benchmark::Counter;

constexpr int bars = 40, rings = 2;  // 19 fibers a yarn
constexpr double bar_length = 2;     // diameters

/// A warp yarn along x and a weft yarn along y on top of it, their fibers packed so that neighbors overlap a little.
Scene crossing_yarns() {
  Scene scene = empty_scene(glass_fiber());
  scene.model.friction = 0.3;
  scene.options.time_step = 1e-13;  // nothing moves
  const double radius = scene.model.types[0].radius, packed = 0.99 * radius, half = bars * bar_length * radius;
  scene.options.skin = 0.5 * 2 * radius;
  scene.options.outer_skin = 1.6 * 2 * radius;
  const std::vector<Eigen::Vector2d> places = hexagon(rings);
  const double height = 2 * std::max_element(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.y() < b.y(); })->y();
  for (const bool weft : {false, true}) {
    int place = 0;
    for (const Eigen::Vector2d& p : places) {
      const double side = packed * p.x(), up = packed * p.y() + (weft ? packed * (height + 2) : 0);
      const Vec3 middle = weft ? Vec3(side, 0, up) : Vec3(0, side, up), along = weft ? Vec3(0, half, 0) : Vec3(half, 0, 0);
      weave::FiberSpec fiber = chain(middle - along, middle + along, bars, 1e-4, weft);
      fiber.place = place++;
      add(scene, fiber);
    }
  }
  return scene;
}

/// An engine on the scene after a few steps, so that its contacts have friction.
weave::Engine warm_engine(const Scene& scene) {
  weave::Engine engine = scene.engine();
  for (int i = 0; i < 3; ++i) engine.step(at_rest(scene.model));
  return engine;
}

void count(benchmark::State& state, std::size_t items) {
  state.counters["items"] = static_cast<double>(items);
  state.counters["each"] = Counter(static_cast<double>(items), Counter::kIsIterationInvariantRate | Counter::kInvert);
}

void pair_law(benchmark::State& state) {
  const weave::PairLaw law = weave::PairLaw::of(5e-5, 4e-5, 1e9, 2e9);
  double overlap = 1e-6;
  for (auto _ : state) {
    benchmark::DoNotOptimize(overlap);
    benchmark::DoNotOptimize(law.line_response(overlap));
  }
  count(state, 1);
}
BENCHMARK(pair_law);

void closest_point(benchmark::State& state) {
  const weave::Engine engine = warm_engine(crossing_yarns());
  const weave::FiberGeometry g = engine.geometry();
  const std::vector<weave::LineContact>& contacts = engine.state().contacts.active.line;
  for (auto _ : state) {
    for (const weave::LineContact& c : contacts) {
      std::uint32_t span = c.span;
      std::int32_t image = c.image;
      benchmark::DoNotOptimize(weave::walk_to_point(engine.model(), g, weave::contact_point(engine.model(), g, c), span, image));
    }
  }
  count(state, contacts.size());
}
BENCHMARK(closest_point);

/// Range: 1 counts the contacts near enough to be looked at, 0 those that touch.
void contact(benchmark::State& state) {
  const weave::Engine engine = warm_engine(crossing_yarns());
  const weave::Model& m = engine.model();
  const weave::FiberGeometry g = engine.geometry();
  weave::ContactList contacts = engine.state().contacts;
  std::vector<Vec3> force(m.nodes(), Vec3::Zero());
  std::vector<weave::DirectionalStiffness> stiffness(m.nodes());
  std::vector<double> couple(m.nodes());
  std::size_t touching = 0;
  for (auto _ : state) {
    touching = 0;
    for (std::uint32_t f = 0; f < m.fibers(); ++f) {
      touching += weave::evaluate_contacts(m, g, f, engine.state().dt, false, contacts, force, stiffness, couple).touching;
    }
  }
  count(state, state.range(0) ? contacts.active.line.size() : touching);
}
BENCHMARK(contact)->ArgName("near")->Arg(1)->Arg(0);

void bar_tensions(benchmark::State& state) {
  const weave::Engine engine = warm_engine(crossing_yarns());
  const weave::Model& m = engine.model();
  const std::size_t n = bars;
  std::vector<Vec3> tangent(n, Vec3::UnitX()), change(n + 1);
  std::vector<double> length(m.rest_length.begin(), m.rest_length.begin() + n), tension(n);
  std::vector<double> inverse_length;
  for (double& l : length) inverse_length.push_back(1 / (l *= 1 + 1e-4));
  const weave::BarChain chain{false,
                              m.types[0].youngs_modulus * m.types[0].area,
                              1,
                              tangent,
                              length,
                              {m.rest_length.data(), n},
                              inverse_length,
                              {m.inverse_mass.data(), n + 1},
                              {engine.state().v.data(), n + 1}};
  weave::BarTensions tensions(n + 1);
  for (auto _ : state) {
    std::fill(change.begin(), change.end(), Vec3::Zero());
    tensions.pull(chain, 1e-6, 1e-6, change, tension);
    benchmark::DoNotOptimize(tension.data());
  }
  count(state, n);
}
BENCHMARK(bar_tensions);

void search(benchmark::State& state) {
  const weave::Engine engine = warm_engine(crossing_yarns());
  const std::size_t n = engine.model().nodes();
  weave::NeighborSearch neighbor_search;
  for (auto _ : state) {
    weave::ContactList contacts;
    std::vector<double> moved(n, std::numeric_limits<double>::infinity());
    neighbor_search.build(engine.model(), engine.geometry(), crossing_yarns().options.outer_skin, std::numeric_limits<double>::infinity(),
                          0, moved, contacts);
    benchmark::DoNotOptimize(contacts.line.data());
  }
  count(state, n);
}
BENCHMARK(search);

void pick(benchmark::State& state) {
  const Scene scene = crossing_yarns();
  const weave::Engine engine = warm_engine(scene);
  weave::ContactList contacts = engine.state().contacts;
  for (auto _ : state) weave::pick_active(engine.model(), engine.geometry(), scene.options.skin, contacts);
  count(state, contacts.line.size());
}
BENCHMARK(pick);

void step(benchmark::State& state) {
  const Scene scene = crossing_yarns();
  weave::Engine engine = warm_engine(scene);
  const weave::Drive drive = at_rest(scene.model);
  for (auto _ : state) benchmark::DoNotOptimize(engine.step(drive));
  count(state, scene.model.nodes());
}
BENCHMARK(step);

}  // namespace

BENCHMARK_MAIN();
