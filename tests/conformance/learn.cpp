// SPDX-License-Identifier: Apache-2.0
// Streams through the online identifier of the C++ headers; README.md says what a stream is.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "needleforce/online/online_identifier.hpp"

using namespace needleforce;
using namespace needleforce::online;

static std::vector<double> numbers(const std::string& line) {
  std::vector<double> found;
  char* rest = nullptr;
  for (const char* from = line.c_str();; from = rest) {
    const double number = std::strtod(from, &rest);
    if (rest == from) return found;
    found.push_back(number);
  }
}

static OnlinePrior prior_of(const std::vector<double>& n) {
  OnlinePrior prior;
  prior.layers = std::size_t(n[0]);
  prior.same_tissue = n[1] != 0.0;
  prior.radius = n[2];
  prior.tip = tips::Cone{n[3]};
  prior.earlier.spacing = n[4];
  for (std::size_t k = 0; k < 2; ++k) {
    const auto part = [&](std::size_t i) { return Expected{n[5 + 12 * k + 2 * i], n[6 + 12 * k + 2 * i]}; };
    prior.layer[k] = {part(0), part(1), part(2), part(3), part(4), part(5)};
  }
  for (std::size_t i = 0; i < EarlierInsertions::points && n.size() > 29; ++i) {
    prior.earlier.mean[i] = n[29 + i];
    prior.earlier.sd[i] = n[29 + EarlierInsertions::points + i];
  }
  return prior;
}

static void write(const OnlineIdentifier& online, const events::Detection& event) {
  const Learnt surface = online.surface();
  std::printf("%.17g %.17g %.17g", online.innovation(), surface.value, surface.sd);
  for (std::size_t k = 0; k < 2; ++k) {
    const LayerLearnt each = online.layer(k);
    for (const Learnt& known : {each.modulus, each.cutting, each.friction})
      std::printf(" %.17g %.17g", known.value, known.sd);
    std::printf(" %.17g %.17g", each.puncture_depth, each.puncture_force);
  }
  const ForceAhead ahead = online.ahead(2e-3);
  for (const std::size_t i : {0, 5, 10})
    std::printf(" %.17g %.17g %.17g", ahead.at[i].force, ahead.at[i].low, ahead.at[i].high);
  std::printf(" %.17g %.17g %zu %s %s %s\n", ahead.puncture_probability, ahead.puncture_depth,
              online.pierced(), events::event_kind_names[std::size_t(event.kind)],
              regime_names[std::size_t(online.regime())],
              events::stream_status_names[std::size_t(online.status())]);
}

int main(int count, char** paths) {
  for (int i = 1; i < count; ++i) {
    std::printf("case %s\n", paths[i]);
    std::ifstream file(paths[i]);
    OnlineIdentifier online;
    OnlineIdentifier::Saved kept = online.save();
    long samples = 0;
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with("prior ")) online = OnlineIdentifier(prior_of(numbers(line.substr(6))));
      if (line == "keep") kept = online.save();
      if (line == "restore") std::puts(online.restore(kept) ? "taken" : "refused");
      if (line == "reset") online.reset();
      const std::vector<double> sample = numbers(line);
      if (sample.size() != 3) continue;
      const events::Detection event = online.step(sample[0], sample[1], sample[2]);
      if (++samples % 20 == 0 || event.kind != events::EventKind::none) write(online, event);
    }
  }
}
