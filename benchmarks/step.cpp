// SPDX-License-Identifier: Apache-2.0
// Time of one step compared with the bare closed form, in batches, the empty loop subtracted from both.
// Prints JSON.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "batches.hpp"
#include "needleforce/guard.hpp"
#include "needleforce/live.hpp"
#include "typical.hpp"

using namespace needleforce;

namespace {

constexpr int many = 4000, few = 1000, least = 50;  // batches: p99.9 needs many

/// The paper's three phases written out, direction from the last depth: the floor of what a step must do.
struct Bare {
  double last = 0.0;
  [[gnu::noinline]] double operator()(double z) {
    const bool inwards = z >= last;
    last = z;
    if (!inwards) return -18.6 * z;
    return z <= 3.237e-3 ? 20051.0 * z * z : 18.6 * z + 0.0776;
  }
};

/// The cost of the loop and of a call.
struct Empty {
  [[gnu::noinline]] double operator()(double z) {
    asm volatile("" : "+x"(z));
    return z;
  }
};

/// As long as a step and nothing else, neither memory nor a branch that varies: what its tail shows is the
/// machine's.
struct Still {
  int turns;
  [[gnu::noinline]] double operator()(double z) {
    for (int i = 0; i < turns; ++i) asm volatile("addsd %0, %0" : "+x"(z));
    return z;
  }
};

/// A step as a loop calls it, through a function, of anything that steps; every insertion finds fresh tissue,
/// otherwise nothing would be cut again.
template <class Engine>
struct Step {
  Engine engine;
  [[gnu::noinline]] double operator()(double z) {
    if (z == 0.0) engine.reset();
    return engine.step(z, no_velocity, 1e-3).force;
  }
};

/// The same with a clock that wavers, so that no exponential can be kept from the step before.
template <class Engine>
struct WaveringStep {
  Engine engine;
  double dt = 1e-3;
  [[gnu::noinline]] double operator()(double z) {
    if (z == 0.0) engine.reset();
    dt = 2e-3 - dt + 1e-9;
    return engine.step(z, no_velocity, dt).force;
  }
};

/// The paper's model, whose laws a row replaces one at a time.
Model paper() {
  return {laws::Cone{117546.06, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
          laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
}

/// Layers every 3 mm: bristle friction, relaxation with two time constants, stick-slip.
std::vector<Layer> full(int count) {
  std::vector<Layer> layers;
  for (int i = 0; i < count; ++i)
    layers.push_back({3e-3 * i,
                      {laws::ConeCylinder{117546.06, 15.0 * tips::degree, 0.35e-3}, laws::PunctureDepth{2e-3},
                       laws::LuGre{2e5, 5.0, 8.0, 18.6, 25.0, 1e-3, 2.0},
                       laws::StickSlip{0.1, 0.04, 1.5e-3, 25.07, 200.0}, laws::Prony{0.3, 0.7, 0.2, 5.0}}});
  return layers;
}

/// One row for every law of a family in place of the paper's.
template <class Laws, class Put>
void rows(double nothing, Put put) {
  [&]<class... L>(std::variant<L...>*) {
    const auto row = [&]<class Law>(const Law& law) {
      Model model = paper();
      put(model, law);
      if (!valid(model))
        std::fprintf(stderr, "%s: give it parameters in typical()\n", Law::name), std::exit(1);
      print(Law::name, batches::measure(Step<Insertion>{Insertion(model)}, few), nothing);
    };
    (row(typical<L>()), ...);
  }(static_cast<Laws*>(nullptr));
}

void every_law(double nothing) {
  rows<Stiffness>(nothing, [](Model& model, const auto& law) { model.stiffness = law; });
  rows<Friction>(nothing, [](Model& model, const auto& law) {
    model.friction = law;
    if (!valid(model)) model.cutting = laws::NoCutting{};  // it counts the tip itself
  });
  rows<Cutting>(nothing, [](Model& model, const auto& law) { model.cutting = law; });
  rows<Relaxation>(nothing, [](Model& model, const auto& law) { model.relaxation = law; });
}

/// Around one layer: the guard with everything on, and the engine whose model may be replaced.
void around(double nothing) {
  const GuardSettings settings{.max_force = 20.0,
                               .max_slew = 1e4,
                               .stale_after = 5e-3,
                               .fall_time = 50e-3,
                               .max_jump = 1e-3,
                               .longest_cycle = 10e-3,
                               .max_speed = 1.0,
                               .delay = 1.0};
  const Guard<Insertion> guard(Insertion(paper()), settings);
  print("guarded", batches::measure(Step<Guard<Insertion>>{guard}, few), nothing);
  const std::vector<Layer> layers{{0.0, paper()}};
  LiveInsertion live(layers);
  print("live", batches::measure(Step<LiveInsertion&>{live}, few), nothing);
}

/// The same insertion after 10^3 to 10^7 steps of one object, never reset.
void by_history(double nothing) {
  struct Going {
    Insertion insertion;
    [[gnu::noinline]] double operator()(double z) { return insertion.step(z, no_velocity, 1e-3).force; }
  } going{Insertion(full(4))};
  long done = 0;
  for (int power = 3; power <= 7; ++power) {
    for (const long until = std::lround(std::pow(10.0, power)); done < until; ++done)
      batches::sink = going(batches::depth_at(done));
    const std::string name = "4 layers after 10^" + std::to_string(power) + " steps";
    print(name.c_str(), batches::measure(going, few), nothing);
  }
}

/// What is kept and taken back, in and out of the process.
template <class Keep>
struct Keeping {
  Insertion insertion;
  Keep keep;
  [[gnu::noinline]] double operator()(double z) { return keep(insertion, z); }
};

void keeping(double nothing) {
  const Insertion insertion(full(4));
  const auto row = [&](const char* name, auto keep) {
    print(name, batches::measure(Keeping<decltype(keep)>{insertion, keep}, least), nothing);
  };
  row("snapshot and back, a copy", [](Insertion& own, double z) {
    own = own.snapshot();
    return z + static_cast<double>(own.pierced_layers());
  });
  row("memory and back, a copy", [](Insertion& own, double z) {
    const Insertion::State kept = own.state();
    asm volatile("" : : "r"(&kept) : "memory");
    own.return_to(kept);
    return z + static_cast<double>(own.pierced_layers());
  });
  row("save and restore", [](Insertion& own, double z) { return z + own.restore(own.save()); });
}

/// How many additions take as long as a step.
Still as_long_as(double step, double nothing) {
  const double hundred = batches::at(batches::measure(Still{100}, few).alone, 0.5) - nothing;
  return {static_cast<int>(100.0 * step / hundred)};
}

}  // namespace

int main() {
  const batches::Times empty = batches::measure(Empty{}, many);
  const double nothing = batches::at(empty.alone, 0.5);
  std::printf("{\n");
  print("empty", empty, 0.0);
  print("bare", batches::measure(Bare{}, many), nothing);
  const batches::Times step = batches::measure(Step<Insertion>{Insertion(paper())}, many);
  print("step", step, nothing);
  print("still", batches::measure(as_long_as(batches::at(step.alone, 0.5) - nothing, nothing), many),
        nothing);
  every_law(nothing);
  for (const int count : {1, 2, 4, 8}) {
    const std::string name = std::to_string(count) + (count == 1 ? " layer" : " layers");
    print(name.c_str(), batches::measure(Step<Insertion>{Insertion(full(count))}, many), nothing);
  }
  print("4 layers, wavering clock", batches::measure(WaveringStep<Insertion>{Insertion(full(4))}, few),
        nothing);
  around(nothing);
  by_history(nothing);
  keeping(nothing);
  std::printf("\"object_bytes\": %zu, \"memory_bytes\": %zu\n}\n", sizeof(Insertion),
              sizeof(Insertion::Saved));
}
