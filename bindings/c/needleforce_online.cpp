// SPDX-License-Identifier: Apache-2.0
#include "needleforce_online.h"

#include <array>
#include <cstring>
#include <new>
#include <span>
#include <type_traits>

#include "by_name.hpp"
#include "needleforce/online/online_identifier.hpp"
#include "needleforce/online/prior_flaw.hpp"

using namespace needleforce;
using online::OnlineIdentifier;
using online::OnlinePrior;

struct nf_online {
  OnlineIdentifier learner;
};

static_assert(NF_REGIME_REST == int(online::Regime::rest) &&
              online::regime_names.size() == NF_REGIME_REST + 1);
static_assert(NF_EARLIER_POINTS == int(online::EarlierInsertions::points) &&
              NF_AHEAD_POINTS == int(online::ForceAhead::points));
static_assert(std::is_standard_layout_v<nf_ahead> && std::is_trivially_copyable_v<nf_ahead>);
static_assert(sizeof(nf_layer_prior) == sizeof(online::LayerPrior));

namespace {

online::Expected plain(const nf_expected& given) noexcept { return {given.mean, given.sd}; }
nf_learnt plain(const online::Learnt& known) noexcept { return {known.value, known.sd, known.before}; }

bool read_earlier(online::EarlierInsertions& earlier, const nf_prior& given, nf_fault& why) noexcept {
  if (given.spacing == 0.0) return true;
  if (!given.mean || !given.sd) return c::refuse(why, "prior", "mean and sd", "are missing", given.spacing);
  earlier.spacing = given.spacing;
  std::memcpy(earlier.mean.data(), given.mean, sizeof earlier.mean);
  std::memcpy(earlier.sd.data(), given.sd, sizeof earlier.sd);
  return true;
}

bool read_tip(Tip& tip, const nf_tip* given, nf_fault& why) noexcept {
  return !given || c::choose(given->name, tip, why, "tip",
                             [&](auto& shape) { return c::fill_tip(shape, *given, why); });
}

bool read(OnlinePrior& prior, const nf_prior& given, nf_fault& why) noexcept {
  if (given.count > online::most_layers || (given.count && !given.layers))
    return c::refuse(why, "prior", "layers", "are missing or too many", double(given.count), 0.0, 8.0);
  prior.layers = given.punctures;
  prior.same_tissue = given.same_tissue != 0;
  if (given.radius != 0.0) prior.radius = given.radius;
  for (std::size_t k = 0; k < given.count; ++k) {
    const nf_layer_prior& layer = given.layers[k];
    prior.layer[k] = {plain(layer.modulus), plain(layer.cutting),  plain(layer.friction),
                      plain(layer.top),     plain(layer.puncture), plain(layer.remainder)};
  }
  if (!read_tip(prior.tip, given.tip, why) || !read_earlier(prior.earlier, given, why)) return false;
  const tips::Flaw flaw = flaw_of(prior);
  if (flaw.limit && flaw.index >= 0) why.layer = std::size_t(flaw.index);
  return !flaw.limit || c::refuse(why, "prior", flaw.quantity, flaw.limit, flaw.value);
}

using events::EventSettings;
using online::OnlineSettings;

/// Settings of two tables, each of which is given those that it knows; what neither knows the second refuses.
struct SettingsOfBoth {
  OnlineSettings learnt;
  EventSettings watched;

  bool read(std::span<const nf_parameter> given, nf_fault& why) noexcept {
    // one more than there are, to be refused
    std::array<nf_parameter, OnlineSettings::table.size() + 1> of_learning;
    std::array<nf_parameter, EventSettings::table.size() + 1> of_events;
    std::size_t n = 0, m = 0;
    for (const nf_parameter& each : given)
      if (c::parameter_named<OnlineSettings>(each.name)) {
        if (n < of_learning.size()) of_learning[n++] = each;
      } else if (m < of_events.size()) {
        of_events[m++] = each;
      }
    return c::fill(learnt, std::span(of_learning.data(), n), why) &&
           c::fill(watched, std::span(of_events.data(), m), why);
  }
};

}  // namespace

extern "C" {

const char* nf_regime_name(int regime) {
  return regime >= 0 && regime <= NF_REGIME_REST ? online::regime_names[std::size_t(regime)] : "unknown";
}

size_t nf_online_size(void) { return sizeof(nf_online); }

nf_online* nf_online_init(void* memory, size_t size, const nf_prior* given, const nf_parameter* settings,
                          size_t count, nf_fault* why) {
  nf_fault ignored{};
  nf_fault& fault = why ? *why : ignored;
  fault = nf_fault{};
  OnlinePrior prior;
  SettingsOfBoth both;
  if (!c::holds<nf_online>(memory, size, fault)) return nullptr;
  if (!settings && count && !c::refuse(fault, "online", "settings", "are missing")) return nullptr;
  if (!both.read(std::span(settings, count), fault)) return nullptr;
  if (given && !read(prior, *given, fault)) return nullptr;
  return new (memory) nf_online{OnlineIdentifier(prior, both.learnt, both.watched)};
}

int nf_online_step(nf_online* self, double force, double depth, double dt, nf_event* out) {
  const events::Detection found = self->learner.step(force, depth, dt);
  *out = {found.time, found.depth, found.size, found.probability, found.delay, int(found.kind)};
  return out->kind;
}
int nf_online_status(const nf_online* self) { return int(self->learner.status()); }
int nf_online_regime(const nf_online* self) { return int(self->learner.regime()); }
size_t nf_online_pierced(const nf_online* self) { return self->learner.pierced(); }
double nf_online_innovation(const nf_online* self) { return self->learner.innovation(); }
void nf_online_layer(const nf_online* self, size_t layer, nf_layer_learnt* out) {
  const online::LayerLearnt known = self->learner.layer(layer);
  *out = {plain(known.modulus), plain(known.cutting), plain(known.friction), known.top,
          known.puncture_depth, known.puncture_force, known.remaining,       known.probability,
          known.touched,        known.pierced};
}
void nf_online_surface(const nf_online* self, nf_learnt* out) { *out = plain(self->learner.surface()); }
void nf_online_ahead(const nf_online* self, double travel, nf_ahead* out) {
  const online::ForceAhead found = self->learner.ahead(travel);
  for (std::size_t i = 0; i < found.at.size(); ++i) {
    out->depth[i] = found.at[i].depth;
    out->force[i] = found.at[i].force;
    out->low[i] = found.at[i].low;
    out->high[i] = found.at[i].high;
  }
  out->puncture_probability = found.puncture_probability;
  out->puncture_depth = found.puncture_depth;
  out->earliest = found.earliest;
  out->latest = found.latest;
}
void nf_online_reset(nf_online* self) { self->learner.reset(); }

size_t nf_online_snapshot_size(void) { return sizeof(OnlineIdentifier::Saved); }

int nf_online_snapshot(const nf_online* self, void* bytes, size_t size) {
  if (!bytes || size < sizeof(OnlineIdentifier::Saved)) return 0;
  const OnlineIdentifier::Saved saved = self->learner.save();
  std::memcpy(bytes, &saved, sizeof saved);
  return 1;
}
int nf_online_restore(nf_online* self, const void* bytes, size_t size) {
  if (!bytes || size < sizeof(OnlineIdentifier::Saved)) return 0;
  OnlineIdentifier::Saved saved;
  std::memcpy(&saved, bytes, sizeof saved);
  return self->learner.restore(saved);
}

}  // extern "C"
