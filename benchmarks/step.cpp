// SPDX-License-Identifier: Apache-2.0
// Work of one step beside the bare closed form, in batches, the empty loop subtracted from both. Prints JSON.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "needleforce/insertion.hpp"

using namespace needleforce;

namespace {

constexpr int batch = 256;
constexpr int batches = 40000;
constexpr int fewer = 6000;  // of rows without a bar
volatile double sink;

/// Depth of an endless in and out, cheap and the same for every body.
double depth_at(long i) {
  const long n = i % 8000;
  return 3e-6 * static_cast<double>(n < 4000 ? n : 8000 - n);
}

/// Nanoseconds for each call of `body`, by batches.
template <class Body>
std::vector<double> measure(Body body, int count = batches) {
  std::vector<double> times(count);
  long i = 0;
  for (double& time : times) {
    const auto start = std::chrono::steady_clock::now();
    double sum = 0.0;
    for (int k = 0; k < batch; ++k) sum += body(depth_at(i++));
    sink = sum;
    time = std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() / batch;
  }
  std::sort(times.begin(), times.end());
  return times;
}

double at(const std::vector<double>& sorted, double share) {
  return sorted[static_cast<std::size_t>(share * (sorted.size() - 1))];
}

void print(const char* name, const std::vector<double>& times, double empty, const char* end) {
  std::printf("\"%s\": {\"p50\": %.3f, \"p99\": %.3f, \"p999\": %.3f, \"max\": %.3f}%s\n", name,
              at(times, 0.5) - empty, at(times, 0.99) - empty, at(times, 0.999) - empty, times.back() - empty,
              end);
}

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

/// A step as a loop calls it: through a function.
struct Step {
  Insertion insertion;
  [[gnu::noinline]] double operator()(double z) {
    if (z == 0.0) insertion.reset();  // every stroke finds fresh tissue, else nothing would be cut again
    return insertion.step(z, no_velocity, 1e-3).force;
  }
};

/// The cost of the loop and of a call.
struct Empty {
  [[gnu::noinline]] double operator()(double z) {
    asm volatile("" : "+x"(z));
    return z;
  }
};

/// The paper's model, whose laws a row replaces one at a time.
Model paper() {
  return {laws::Cone{117546.06, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
          laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
}

/// Every number of a law at its default, else at the geometric middle of its range.
template <Law L>
L typical() {
  L law{};
  for (const auto& parameter : L::table) {
    const double low = std::max(parameter.low, 1e-9 * parameter.high);
    const bool negative = parameter.high <= 0.0;
    const double middle = negative ? -1e-2 : std::sqrt(low * parameter.high);
    law.*parameter.member = parameter.initial == parameter.initial ? parameter.initial : middle;
  }
  return law;
}

// where the middle of the ranges would contradict itself, the presets' numbers
template <>
laws::LuGre typical() {
  return {1e6, 100.0, 200.0, 18.0, 25.0, 1e-3, 2.0};
}
template <>
laws::RelaxingSurface typical() {
  return {18.6, 20e-6, 1.0, 82.3, 0.0776};
}
template <>
laws::DraggedTissuePassive typical() {
  return {140.0, 220.0, 0.4e-3, 1e-3};
}
template <>
laws::DraggedTissueAsFitted typical() {
  return {140.0, 220.0, 0.4e-3, 1e-3};
}
template <>
laws::StickSlip typical() {
  return {0.1, 0.04, 1.5e-3, 25.07, 200.0};
}
template <>
laws::StribeckCutting typical() {
  return {0.1, 0.0033, 0.5714e-3, 20.73, 200.0, 2e-3};
}
template <>
laws::TipContact typical() {
  return {117546.06, 0.35e-3, tips::TangentOgive{0.35e-3, 1.3e-3}};
}

/// One row for every law of a family in place of the paper's.
template <class Laws, class Put>
void rows(double nothing, Put put) {
  [&]<class... L>(std::variant<L...>*) {
    const auto row = [&]<class Law>(const Law& law) {
      Model model = paper();
      put(model, law);
      if (!valid(model)) std::fprintf(stderr, "%s: give it numbers in typical()\n", Law::name), std::exit(1);
      print(Law::name, measure(Step{Insertion(model)}, fewer), nothing, ",");
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

/// The same with a clock that wavers, so that no exponential can be kept from the step before.
struct WaveringStep {
  Insertion insertion;
  double dt = 1e-3;
  [[gnu::noinline]] double operator()(double z) {
    if (z == 0.0) insertion.reset();
    dt = 2e-3 - dt + 1e-9;
    return insertion.step(z, no_velocity, dt).force;
  }
};

}  // namespace

int main() {
  const auto empty = measure(Empty{});
  const double nothing = at(empty, 0.5);
  std::printf("{\n");
  print("bare", measure(Bare{}), nothing, ",");
  print("step", measure(Step{Insertion(paper())}), nothing, ",");
  every_law(nothing);
  for (const int count : {1, 2, 4, 8}) {
    const std::string name = std::to_string(count) + " layers, bristles, relaxation, stick-slip";
    print(name.c_str(), measure(Step{Insertion(full(count))}), nothing, ",");
  }
  print("4 layers, wavering clock", measure(WaveringStep{Insertion(full(4))}, fewer), nothing, ",");
  std::printf("\"state_bytes\": %zu\n}\n", sizeof(Insertion));
}
