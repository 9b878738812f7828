// SPDX-License-Identifier: Apache-2.0
// The C face of what learns while the needle moves for JavaScript: its prior as numbers and a tip, its
// settings by name, before the loop.
#include <cstddef>

#include "../c/needleforce_online.h"
#include "pieces.hpp"

namespace {

constexpr std::size_t most_layers = 8;

struct Given {  // online.mjs writes it as doubles alone
  double radius, punctures, same_tissue, spacing;
  nf_layer_prior layer[most_layers];
  double mean[NF_EARLIER_POINTS], sd[NF_EARLIER_POINTS];
};
struct Known {  // and reads this
  nf_layer_learnt layer;
  nf_learnt surface;
  nf_ahead ahead;
  nf_event event;
};

Given given;
Known known;
nf_parameter parameters[24];  // more than there are, to be refused
nf_online* online;
unsigned char* snapshot;

}  // namespace

static_assert(offsetof(Given, layer) == 4 * sizeof(double) &&
              sizeof(Given) == (4 + 96 + 322) * sizeof(double));
static_assert(offsetof(nf_layer_learnt, touched) == 14 * sizeof(double) &&
              offsetof(Known, surface) == 15 * sizeof(double) &&
              offsetof(Known, ahead) == 18 * sizeof(double) && offsetof(Known, event) == 66 * sizeof(double));

extern "C" {

/// The settings follow, by give().
void EXPORT(open_online)() { pieces::open(parameters); }
Given* EXPORT(prior_at)() { return &given; }
/// With so many layers of the prior, and the tip that was chosen, if any; 1, or 0 and a fault with the
/// reason.
int EXPORT(make_online)(std::size_t layers) {
  void* memory = room(nf_online_size());
  snapshot = static_cast<unsigned char*>(room(nf_online_snapshot_size()));
  std::size_t count = 0;
  while (parameters[count].name) ++count;
  const nf_tip* tip = pieces::count ? pieces::layers[0].stiffness.tip : nullptr;
  const nf_prior prior{given.layer,
                       layers,
                       std::size_t(given.punctures),
                       given.same_tissue != 0.0,
                       given.radius,
                       tip,
                       given.mean,
                       given.sd,
                       given.spacing};
  online = nf_online_init(memory, nf_online_size(), &prior, parameters, count, &pieces::fault);
  return online != nullptr;
}

const Known* EXPORT(known_at)() { return &known; }
int EXPORT(online_step)(double force, double depth, double dt) {
  return nf_online_step(online, force, depth, dt, &known.event);
}
void EXPORT(online_layer)(std::size_t k) { nf_online_layer(online, k, &known.layer); }
void EXPORT(online_surface)() { nf_online_surface(online, &known.surface); }
void EXPORT(online_ahead)(double travel) { nf_online_ahead(online, travel, &known.ahead); }
int EXPORT(online_status)() { return nf_online_status(online); }
int EXPORT(online_regime)() { return nf_online_regime(online); }
std::size_t EXPORT(online_pierced)() { return nf_online_pierced(online); }
double EXPORT(online_innovation)() { return nf_online_innovation(online); }
void EXPORT(online_reset)() { nf_online_reset(online); }
unsigned char* EXPORT(online_snapshot_at)() { return snapshot; }
std::size_t EXPORT(online_snapshot_size)() { return nf_online_snapshot_size(); }
void EXPORT(online_save)() { nf_online_snapshot(online, snapshot, nf_online_snapshot_size()); }
int EXPORT(online_restore)(std::size_t size) { return nf_online_restore(online, snapshot, size); }
const char* EXPORT(regime_name)(int regime) { return nf_regime_name(regime); }

}  // extern "C"
