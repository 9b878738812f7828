// SPDX-License-Identifier: Apache-2.0
// Derivatives of the force: what a step with eight of them costs, and every law and parameter against
// differences of the sixth order of the same laws, compiled for numbers of 64 binary digits. A parameter
// without smooth differences above rounding along the motion has a dash.
//   g++ -std=c++20 -O3 -fno-math-errno -fno-trapping-math -Iinclude -Itests/cpp benchmarks/gradients.cpp
//   -lgtest
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "every_model.hpp"
#include "needleforce/insertion.hpp"
#include "wide.hpp"

using namespace needleforce;

namespace {

constexpr double cycle = 1e-3;
const Limits any_speed{.max_speed = Limits::endless};

/// A first contact, a puncture, a reversal, a return, a hold, and out.
std::vector<double> motion() {
  const double corners[][2] = {{0.0, -1.1e-3}, {1.0, 10.3e-3}, {1.2, 8.1e-3},
                               {1.5, 12.7e-3}, {2.0, 12.7e-3}, {3.5, -1.3e-3}};
  std::vector<double> depth;
  for (int i = 0, k = 0; i < 3500; ++i) {
    const double time = cycle * i;
    while (time > corners[k + 1][0]) ++k;
    const auto &from = corners[k], &to = corners[k + 1];
    depth.push_back(from[1] + (to[1] - from[1]) * (time - from[0]) / (to[0] - from[0]));
  }
  return depth;
}

struct Named {
  Direction at;
  std::string name;  // family, law and parameter
  double value;
};

std::vector<Named> parameters_of(const Layer& layer) {
  static constexpr const char* families[] = {"stiffness", "puncture", "friction", "cutting", "relaxation"};
  std::vector<Named> found;
  detail::each_law(layer.laws, [&]<class L>(const L& law, std::size_t part) {
    for (std::size_t k = 0; k < L::table.size(); ++k)
      found.push_back({{0, part, k},
                       std::string(families[part]) + " " + L::name + " " + L::table[k].name,
                       law.*L::table[k].member});
  });
  return found;
}

std::vector<long double> wide_forces(const Layer& layer, const Direction& at, long double by,
                                     const std::vector<double>& depth) {
  const std::array layers{layer};
  const std::array wide{widened(layer, at, by)};
  const BasicPreparedInsertion<Wide> prepared(layers, wide, any_speed, Bevel{});
  BasicInsertionState<Wide> state{};
  std::vector<long double> force;
  for (const double z : depth) force.push_back(prepared.step(state, z, no_velocity, cycle).force.value);
  return force;
}

/// The largest error over the largest derivative, where two orders of the differences agree: an event lies
/// between the runs elsewhere.
double error_of(const Layer& layer, const Named& parameter, const std::vector<double>& depth) {
  GradientInsertion<8> steps(std::array{layer}, std::array{parameter.at}, any_speed);
  const long double h = 1e-4L * std::fabs(static_cast<long double>(parameter.value));
  std::vector<long double> f[7];
  for (int j = -3; j <= 3; ++j)
    if (j != 0) f[j + 3] = wide_forces(layer, parameter.at, j * h, depth);
  std::vector<double> sixth, apart, error;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const long double one = f[4][i] - f[2][i], two = f[5][i] - f[1][i], three = f[6][i] - f[0][i];
    const long double fine = (45 * one - 9 * two + three) / (60 * h), coarse = (8 * one - two) / (12 * h);
    sixth.push_back(std::fabs(static_cast<double>(fine)));
    apart.push_back(std::fabs(static_cast<double>(fine - coarse)));
    const double found = steps.step(depth[i], no_velocity, cycle).force.derivatives()[0];
    error.push_back(std::fabs(found - static_cast<double>(fine)));
  }
  const double most = *std::max_element(sixth.begin(), sixth.end());
  double scale = 0.0, worst = 0.0;
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (apart[i] < 1e-9 * most) scale = std::max(scale, sixth[i]);
  for (std::size_t i = 0; i < depth.size(); ++i)
    if (apart[i] <= 1e-8 * scale) worst = std::max(worst, error[i]);
  // a force that the parameter does not move by more than rounding has no derivative to compare
  return scale * std::fabs(parameter.value) > 1e-12 ? worst / scale : -1.0;
}

/// A contact that relaxes is punctured at the end of a step, where differences of it do not move.
bool punctures_late(const Model& model) {
  return !std::holds_alternative<laws::NoRelaxation>(model.relaxation) &&
         !std::holds_alternative<laws::PunctureDepth>(model.puncture);
}

void print_errors() {
  const auto depth = motion();
  std::map<std::string, std::pair<double, std::string>> worst;
  for (const Model& model : every_model()) {
    if (std::holds_alternative<laws::TipContact>(model.stiffness) || punctures_late(model)) continue;
    const Layer layer{0.0, model};
    for (const Named& parameter : parameters_of(layer)) {
      if (parameter.value == 0.0) continue;  // differences on one side only
      auto& entry = worst.try_emplace(parameter.name, -1.0, "").first->second;
      const double error = error_of(layer, parameter, depth);
      if (error >= entry.first) entry = {error, name_of(model)};
    }
  }
  for (const auto& [name, entry] : worst)
    if (entry.first < 0.0)
      std::printf("       -  %s\n", name.c_str());
    else
      std::printf("%8.1e  %s   in %s\n", entry.first, name.c_str(), entry.second.c_str());
}

template <class Run>
double seconds(Run run) {
  const auto begin = std::chrono::steady_clock::now();
  run();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

[[gnu::noinline]] double walk(Insertion& steps, const std::vector<double>& depth) {
  double sum = 0.0;
  for (const double z : depth) sum += steps.step(z, no_velocity, cycle).force;
  return sum;
}
[[gnu::noinline, gnu::flatten]] double walk(GradientInsertion<8>& steps, const std::vector<double>& depth,
                                            std::vector<GradientInsertion<8>::Number>& forces) {
  for (std::size_t i = 0; i < depth.size(); ++i) forces[i] = steps.step(depth[i], no_velocity, cycle).force;
  return forces.back().value;
}

/// The least of many rounds of each, one after the other.
void print_cost() {
  const auto depth = motion();
  const std::array paper{paper::one(paper::model())[0]};
  std::vector<Direction> along;
  for (const Named& parameter : parameters_of(paper[0])) along.push_back(parameter.at);
  std::vector<GradientInsertion<8>::Number> forces(depth.size());
  double plain = 1e9, with = 1e9, sum = 0.0;
  for (int i = 0; i < 500; ++i) {
    Insertion one(paper, any_speed);
    GradientInsertion<8> all(paper, along, any_speed);
    plain = std::min(plain, seconds([&] { sum += walk(one, depth); }));
    with = std::min(with, seconds([&] { sum += walk(all, depth, forces); }));
  }
  const double each = 1e9 / static_cast<double>(depth.size());
  std::printf("step %.1f ns, with 8 derivatives %.1f ns: %.2f steps (%g)\n", plain * each, with * each,
              with / plain, sum);
}

}  // namespace

int main() {
  print_cost();
  print_errors();
}
