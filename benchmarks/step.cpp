// SPDX-License-Identifier: Apache-2.0
// Work of one step beside the bare closed form, in batches, the empty loop subtracted from both. Prints JSON.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "needleforce/insertion.hpp"

using namespace needleforce;

namespace {

constexpr int batch = 256;
constexpr int batches = 40000;
volatile double sink;

/// Depth of an endless in and out, cheap and the same for every body.
double depth_at(long i) {
  const long n = i % 8000;
  return 3e-6 * static_cast<double>(n < 4000 ? n : 8000 - n);
}

/// Nanoseconds for each call of `body`, by batches.
template <class Body>
std::vector<double> measure(Body body) {
  std::vector<double> times(batches);
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
  [[gnu::noinline]] double operator()(double z) { return insertion.step(z, no_velocity, 1e-3).force; }
};

/// The cost of the loop and of a call.
struct Empty {
  [[gnu::noinline]] double operator()(double z) {
    asm volatile("" : "+x"(z));
    return z;
  }
};

}  // namespace

int main() {
  const Model model{laws::Cone{117546.06, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
                    laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
  const auto empty = measure(Empty{});
  const auto bare = measure(Bare{});
  const auto step = measure(Step{Insertion(model)});
  const double nothing = at(empty, 0.5);
  std::printf("{\n");
  print("bare", bare, nothing, ",");
  print("step", step, nothing, ",");
  std::printf("\"state_bytes\": %zu\n}\n", sizeof(Insertion));
}
