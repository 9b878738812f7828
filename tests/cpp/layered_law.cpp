// SPDX-License-Identifier: Apache-2.0
// The layered law against a direct transcription of its state update as the specification prints it, in that
// text's own variables and order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "needleforce/insertion.hpp"

using namespace needleforce;

namespace {

enum class Mode { intact, pierced, left };

/// One layer as the text has it; z is the depth, zm the greatest so far.
struct Transcribed {
  double z0, c, hs, f, kt, delta, zr, z1, g[2], tau[2];
  Mode mode = Mode::intact;
  double Fe = 0.0, q[2] = {0.0, 0.0}, Fp = 0.0, F = 0.0;

  double Fst(double h) const {
    if (h <= 0.0) return 0.0;
    return h <= hs ? c * h * h : c * (2.0 * hs * h - hs * hs);
  }
  double step(double z, double dz, double dt, double zm) {
    if (mode == Mode::left) return 0.0;
    const bool withdrawing = z < zm - 0.03e-3;
    const bool advancing = !withdrawing && dz > 0.1e-3 * dt;
    double a[2] = {1.0, 1.0}, phi[2] = {1.0, 1.0};
    for (int j = 0; j < 2; ++j) {  // 1. memory
      if (advancing) {
        q[j] = g[j] * Fe;
      } else {
        a[j] = std::exp(-dt / tau[j]);
        phi[j] = (1.0 - a[j]) * tau[j] / dt;
      }
    }
    const double sum = g[0] + g[1];
    const double A = (1.0 - sum) * Fe + q[0] * a[0] + q[1] * a[1];
    const double B = 1.0 - sum + g[0] * phi[0] + g[1] * phi[1];
    double d = 0.0;
    if (mode == Mode::intact) {  // 2.
      if (zm >= z1) {
        Fp = F;
        mode = Mode::pierced;
      } else {
        d = Fst(z - z0) - Fe;
      }
    }
    if (mode == Mode::pierced) {  // 3.
      double l = z - zr - Fe / kt;
      if (withdrawing && l <= 0.0) {
        mode = Mode::left;
        return F = Fe = 0.0;
      }
      l = std::max(l, 0.0);
      const double least = f * l, most = f * l + std::max(0.0, Fp - f * l) * std::exp(-(zm - z1) / delta);
      d = std::clamp(kt * dz, (-least - A) / B, (most - A) / B);
    }
    F = A + B * d;  // 4.
    Fe += d;
    for (int j = 0; j < 2; ++j) q[j] = q[j] * a[j] + g[j] * phi[j] * d;
    return F;
  }
};

constexpr double angle = 0.2618, radius = 1e-3;
constexpr double share_1 = 0.31, share_2 = 0.26, time_1 = 0.7, time_2 = 5.0;

/// Two layers near the medians of the recordings, in the text's words and in the project's.
struct LayerOfBoth {
  double z0, Er, f, kt, delta, zr, z1;

  Transcribed transcribed() const {
    const double c = 2.0 / std::numbers::pi * Er * std::tan(angle);
    const double hs = 0.5 * std::numbers::pi * radius / std::tan(angle);
    return {z0, c, hs, f, kt, delta, zr, z1, {share_1, share_2}, {time_1, time_2}};
  }
  Layer layer() const {
    return {z0, Model{laws::ConeCylinder{Er, angle, radius}, laws::PunctureDepth{z1 - z0},
                      laws::DraggedTissueAsFitted{f, kt, delta, zr - z0}, laws::NoCutting{},
                      laws::PronyAtRest{share_1, time_1, share_2, time_2}}};
  }
};
const LayerOfBoth skin{0.0, 176e3, 140.0, 220.0, 0.4e-3, 3.2e-3, 9e-3};
const LayerOfBoth muscle{7e-3, 90e3, 90.0, 180.0, 0.8e-3, 8.5e-3, 15e-3};

/// In to 22 mm, hold for 5 s, out and clear of the specimen, at 100 Hz, with the noise of a position sensor.
std::vector<double> in_hold_out(double speed, double noise) {
  std::vector<double> depths;
  for (double z = -2e-3; z < 22e-3; z += speed * 0.01) depths.push_back(z);
  for (int i = 0; i < 500; ++i) depths.push_back(depths.back());
  for (double z = depths.back(); z > -8e-3; z -= speed * 0.01) depths.push_back(z);
  std::mt19937_64 generator{7};
  std::normal_distribution<double> normal{0.0, noise};
  for (double& z : depths) z += noise > 0.0 ? normal(generator) : 0.0;
  return depths;
}

/// The largest difference of the two over a motion, over the largest force.
double disagreement(const std::vector<double>& depths) {
  Insertion insertion(std::array{skin.layer(), muscle.layer()});
  Transcribed first = skin.transcribed(), second = muscle.transcribed();
  double last = depths.front(), deepest = last, largest = 0.0, peak = 0.0;
  int punctures = 0;
  for (const double z : depths) {
    const Sample sample = insertion.step(z, no_velocity, 0.01);
    EXPECT_EQ(sample.status, Status::ok);
    deepest = std::max(deepest, z);
    const double text = first.step(z, z - last, 0.01, deepest) + second.step(z, z - last, 0.01, deepest);
    largest = std::max(largest, std::abs(sample.force - text));
    peak = std::max(peak, std::abs(text));
    punctures += sample.punctured;
    last = z;
  }
  EXPECT_EQ(punctures, 2);
  EXPECT_EQ(first.mode, Mode::left);
  EXPECT_EQ(second.mode, Mode::left);
  EXPECT_GT(peak, 1.0);
  return largest / peak;
}

TEST(LayeredLaw, EqualsTheSpecifiedUpdateOverInsertionHoldAndWithdrawal) {
  for (const double speed : {1e-3, 2e-3, 3e-3})
    EXPECT_LT(disagreement(in_hold_out(speed, 0.0)), 1e-9) << speed;
}

TEST(LayeredLaw, EqualsTheSpecifiedUpdateOverNoisyMotion) {
  for (const double speed : {1e-3, 2e-3, 3e-3})
    EXPECT_LT(disagreement(in_hold_out(speed, 2e-6)), 1e-9) << speed;
}

}  // namespace
