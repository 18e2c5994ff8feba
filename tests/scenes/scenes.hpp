#pragma once
#include <cstdint>
#include <random>
#include <vector>

#include "weave/engine.hpp"

/// Small scenes built straight on the engine, shared by truth tests, regression tests and benchmarks.
namespace scenes {

using weave::Vec3;

/// A model with its state at the start and the engine's options.
struct Scene {
  weave::Model model;
  weave::State state;
  weave::EngineOptions options;

  [[nodiscard]] weave::Engine engine() const { return {model, state, options}; }
};

/// Glass: E = 86.9 GPa, 2460 kg/m^3, E_T = 1 GPa, as stiff in compression as in tension, no bending.
weave::FiberType glass_fiber(double radius = 5e-5);

/// Straight chain of equal bars, stretched by `strain`, of type 0.
weave::FiberSpec chain(const Vec3& from, const Vec3& to, int bars, double strain = 0, int yarn = 0);

/// Chain through given points whose rest lengths are the distances between them.
weave::FiberSpec chain_through(std::vector<Vec3> x, int yarn = 0);

/// An empty scene with one fiber type, nothing damped, no friction; skin of 0.3 diameters.
Scene empty_scene(const weave::FiberType& type);

void add(Scene& scene, const weave::FiberSpec& fiber, const Vec3& velocity = Vec3::Zero());

/// To be called where nodes are moved by hand, which is not counted as travel: contacts are looked at, and what they overlap by counts.
void wake_contacts(weave::State& state);

/// Nothing is driven.
weave::Drive at_rest(const weave::Model& model);

/// Momentum of all nodes, and the sum of its parts' magnitudes, which bounds its round-off.
struct Momentum {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  ///< [kg m/s], about the origin [kg m^2/s]
  double linear_scale = 0, angular_scale = 0;
};
Momentum momentum(const weave::Engine& engine);

/// Two fibers of `bars` bars at an angle [rad] in parallel planes, axes `distance` apart along z at their middles; fiber 1 above.
Scene crossing_pair(const weave::FiberType& type, double angle, double length, int bars, double distance);

struct TangleSpec {
  int fibers = 8;
  int bars = 12;
  double bar_length = 1;    ///< [diameters]
  double box = 12;          ///< edge of the cube in which the fibers' middles lie [diameters]
  double speed = 5;         ///< towards the middle [m/s]
  double spin = 0;          ///< of the whole about z [1/s]
  double clearance = 1.05;  ///< least distance of the axes at the start [diameters]
  double period_y = 0;      ///< [diameters]
  std::uint64_t seed = 1;
};

/// Free fibers with random places, directions and bends that fly at one another.
Scene tangle(const weave::FiberType& type, const TangleSpec& spec);

/// A layer of free fibers along y that falls with some slip on a layer along x, and beside it a fiber on a parallel one.
Scene colliding_layers(const weave::FiberType& type, int fibers, double speed);

/// Straight warps along x and closed straight wefts along y at random heights with random waves, in a cell periodic in y; they may overlap.
Scene periodic_mesh(const weave::FiberType& type, double period_y, int warps, int wefts, double bar_length, double height,
                    std::uint64_t seed);

/// Plain weave: 2 warps and 2 closed wefts of single fibers, sinusoidal, at touch; pitch in diameters.
Scene plain_weave_cell(const weave::FiberType& type, double pitch, int bars_a_pitch);

/// Least distance of two poly-lines by looking at every pair of bars [m].
double polyline_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

/// Least distance of the bars p0-p1 and q0-q1 [m].
double bar_distance(const Vec3& p0, const Vec3& p1, const Vec3& q0, const Vec3& q1);

/// Uniform in (-1, 1), the same on every platform.
double uniform(std::mt19937_64& random);
Vec3 random_vector(std::mt19937_64& random);

}  // namespace scenes
