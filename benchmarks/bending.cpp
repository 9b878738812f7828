// SPDX-License-Identifier: Apache-2.0
// Time of a step of a needle that bends, 40 elements, at 1 kHz and 5 mm/s. Prints JSON.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <span>
#include <vector>

#include "needleforce/bending/flexible_insertion.hpp"

using namespace needleforce;
using namespace needleforce::bending;

namespace {

/// Without a lateral force on the tip, bending shortens the needle and the axial laws feel it: coupled.
FlexibleSettings settings(FoundationForm form, bool coupled) {
  const std::array section{Section{.stiffness = 0.0206517998}};
  FlexibleSettings result;
  result.beam.sections = Sections(std::span<const Section>(section));
  result.beam.support.guide_distance = 0.03;
  result.beam.layers[0] = {.modulus = 20e3, .scale = 3e-4, .tip_force = coupled ? 0.0 : 0.2, .form = form};
  result.beam.layer_count = 1;
  result.lengths.bevel_length = 0.002612;
  return result;
}

Model paper() {
  return {laws::Cone{117546.06, 15.0 * tips::degree}, laws::PunctureDepth{3.237e-3},
          laws::Coulomb{18.6, 20e-6, 0.0}, laws::ConstantCutting{0.0776, 20e-6}};
}

/// Median and 99.9th percentile [us] of a step, in batches of ten, on 10 mm from a depth [m] on; the base
/// moves aside and rolls where the needle bends in space.
template <std::size_t dimension>
std::array<double, 2> cost(FoundationForm form, double depth, bool coupled = false) {
  FlexibleInsertion<dimension> needle(Insertion(paper()), settings(form, coupled));
  constexpr double travel = 5e-6;
  Base base;
  while (base.depth < depth) base.depth += travel, needle.step(base, 1e-3);
  std::vector<double> times;
  double sum = 0.0;
  for (int batch = 0; batch < 200; ++batch) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < 10; ++i) {
      base.depth += travel;
      base.lateral[0] += 1e-7;
      if (dimension > 1) base.roll += 1e-3;
      sum += needle.step(base, 1e-3).force;
    }
    const std::chrono::duration<double, std::micro> took = std::chrono::steady_clock::now() - start;
    times.push_back(0.1 * took.count());
  }
  asm volatile("" : "+x"(sum));
  std::sort(times.begin(), times.end());
  return {times[times.size() / 2], times[times.size() - 1 - times.size() / 1000]};
}

void print(const char* name, std::array<double, 2> took, const char* end) {
  std::printf("\"%s\": {\"median_us\": %.4f, \"p999_us\": %.4f}%s\n", name, took[0], took[1], end);
}

}  // namespace

int main() {
  std::printf("{");
  print("planar 40 mm", cost<1>(FoundationForm::linear, 0.04), ",");
  print("planar 80 mm", cost<1>(FoundationForm::linear, 0.08), ",");
  print("planar 160 mm", cost<1>(FoundationForm::linear, 0.16), ",");
  print("space 80 mm", cost<2>(FoundationForm::linear, 0.08), ",");
  print("planar 80 mm, coupled", cost<1>(FoundationForm::linear, 0.08, true), ",");
  print("space 80 mm, coupled", cost<2>(FoundationForm::linear, 0.08, true), ",");
  print("planar cubic 80 mm", cost<1>(FoundationForm::cubic, 0.08), ",");
  print("planar hyperbolic 80 mm", cost<1>(FoundationForm::hyperbolic, 0.08), ",");
  print("planar tanh 80 mm", cost<1>(FoundationForm::tanh, 0.08), ",");
  print("planar tanh 80 mm, coupled", cost<1>(FoundationForm::tanh, 0.08, true), ",");
  print("space tanh 80 mm", cost<2>(FoundationForm::tanh, 0.08), "}");
}
