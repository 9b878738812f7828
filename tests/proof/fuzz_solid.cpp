// SPDX-License-Identifier: Apache-2.0
// A fuzzer on condensed solids: any table, laws and motion. Nothing that is not finite comes out, bad input
// is reported, forces stay within what the laws allow, the tip stays on its path, and the same input gives
// the same bits, also from saved bytes on and through the C face; a needle that bends in them, too.
#include "../../bindings/c/needleforce_solid.h"
#include "bent_trial.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "planted.hpp"
#include "trial.hpp"

namespace {

using namespace needleforce;
using needleforce::proof::require;
using needleforce::proof::same;
using solid::CondensedInsertion;
using solid::CondensedTissue;

/// Mostly positive definite: compliances that fall with the distance of the nodes, now and then with one that
/// does not fit.
CondensedTissue table(from_bytes::Bytes& bytes) {
  CondensedTissue tissue;
  tissue.nodes = 2 + bytes.below(solid::max_path_nodes - 1);
  tissue.spacing = bytes.number(1e-4, 5e-3);
  const double scale = bytes.number(1e-9, 1.0), fall = bytes.number(0.05, 3.0);
  for (std::size_t i = 0; i < tissue.nodes; ++i)
    for (std::size_t j = 0; j < tissue.nodes; ++j)
      tissue.compliance[i * solid::max_path_nodes + j] =
          scale * std::exp(-fall * std::abs(static_cast<double>(i) - static_cast<double>(j)));
  const std::size_t wrong = bytes.below(256);
  if (wrong < 8) tissue.compliance[wrong * 7] = bytes.number(-1.0, 1.0);
  return tissue;
}

/// Layers whose laws a solid takes, most of the time.
std::vector<Layer> solid_layers(from_bytes::Bytes& bytes) {
  std::vector<Layer> layers = from_bytes::layers(bytes);
  Relaxation relaxation = laws::NoRelaxation{};
  if (bytes.below(2) == 0)
    relaxation = laws::Prony{bytes.number(0.0, 0.6), bytes.number(1e-6, 1e3), bytes.number(0.0, 0.39), 5.0};
  for (Layer& layer : layers) {
    if (bytes.below(8) == 0) continue;
    layer.laws.relaxation = relaxation;
    if (solid::solid_fault(layer))
      layer.laws.friction = laws::Coulomb{bytes.number(0.0, 1e3), bytes.number(1e-9, 1e-3), 0.0};
  }
  return layers;
}

class CSolid {
 public:
  CSolid(const CondensedTissue& tissue, std::span<const Layer> layers, const Limits& limits)
      : memory_(nf_solid_size() / sizeof(double) + 1), kept_(nf_solid_snapshot_size()) {
    CLayers named(layers);
    nf_settings settings = nf_default_settings();
    settings.max_speed = limits.max_speed, settings.hold_time = limits.hold_time;
    settings.velocity_slack = limits.velocity_slack, settings.depth_noise = limits.depth_noise;
    settings.velocity_slack_ratio = limits.velocity_slack_ratio;
    std::vector<double> rows;
    for (std::size_t i = 0; i < tissue.nodes; ++i)
      rows.insert(rows.end(), tissue.row(i), tissue.row(i) + tissue.nodes);
    nf_fault why{};
    solid_ = nf_solid_init(memory_.data(), nf_solid_size(), named.data(), named.size(), &settings,
                           tissue.spacing, tissue.nodes, rows.data(), &why);
    require((solid_ == nullptr) == (why.reason != nullptr), "a refusal of a solid has a reason");
    keep();
  }
  bool made() const { return solid_; }
  nf_sample step(double depth, double velocity, double dt) {
    nf_sample sample;
    nf_solid_step(solid_, depth, velocity, dt, &sample);
    return sample;
  }
  void reset() { nf_solid_reset(solid_); }
  void keep() {
    if (solid_) require(nf_solid_snapshot(solid_, kept_.data(), kept_.size()) == 1, "a solid is kept");
  }
  void restore(std::size_t where, std::uint8_t change) {
    require(nf_solid_restore(solid_, kept_.data(), kept_.size()) == 1, "a solid is taken back");
    std::vector<std::uint8_t> altered = kept_;
    altered[where % altered.size()] ^= change ? change : 1;
    require(nf_solid_restore(solid_, altered.data(), altered.size()) == 0,
            "altered bytes of a solid are refused");
  }

 private:
  std::vector<double> memory_;
  std::vector<std::uint8_t> kept_;
  nf_solid* solid_ = nullptr;
};

class SolidTrial {
 public:
  SolidTrial(const CondensedTissue& tissue, std::span<const Layer> layers, const Limits& limits)
      : limits_(limits),
        valid_(!CondensedInsertion::fault(tissue, layers) && valid(limits)),
        max_(valid_ ? bounds::of(layers, bounds::fastest_accepted(limits)) : bounds::Parts{}),
        engine_(tissue, layers, limits),
        shadow_(engine_),
        kept_(engine_.save()),
        c_(tissue, layers, limits) {
    require(engine_.accepted() == valid_ && c_.made() == valid_, "both faces take the same solids");
  }
  void ask(const from_bytes::Cycle& cycle) {
    if (cycle.ask == from_bytes::Ask::reset) {
      engine_.reset(), shadow_.reset();
      if (valid_) c_.reset();
    } else if (cycle.ask == from_bytes::Ask::keep) {
      kept_ = engine_.save();
      c_.keep();
      require(shadow_.restore(kept_) == valid_, "saved bytes of a solid are taken back");
    } else {
      require(engine_.restore(kept_) == valid_ && shadow_.restore(kept_) == valid_,
              "saved bytes are taken back");
      if (!valid_) return;
      c_.restore(cycle.where, cycle.change);
      planted_.restore(engine_, [&](auto& saved) { proof::plant(saved, cycle.where, cycle.change); });
    }
  }
  void step(double depth, double velocity, double dt) {
    const Sample sample = engine_.step(depth, velocity, dt);
    require(same(sample, shadow_.step(depth, velocity, dt)), "saved bytes continue as the solid does");
    planted_.step([](const Sample& made) { return proof::numbers_of(made); }, depth, velocity, dt);
    if (valid_) require(same(sample, c_.step(depth, velocity, dt)), "C gives the bits of C++ for a solid");
    for (const double number : proof::numbers_of(sample))
      require(std::isfinite(number), "every number of a solid is finite");
    const solid::CondensedState& state = engine_.state();
    const double length = engine_.tissue().length();
    require(!valid_ || (state.tip >= 0.0 && state.tip <= state.cut && state.cut <= length),
            "the tip is on its path");
    require(sample.stiffness >= 0.0 && sample.stiffness <= max_.stiffness,
            "a contact pushes as far as it can");
    require(sample.cutting >= 0.0 && sample.cutting <= max_.cutting, "cutting pushes as far as it can");
    require(std::abs(sample.friction) <= max_.friction, "friction is no more than it can be");
    const bool bad = !std::isfinite(depth + velocity + dt) || !(dt > 0.0) || !(std::abs(depth) <= farthest);
    require(!(bad || !valid_) || sample.status != Status::ok, "bad input of a solid is reported");
    require(!((bad || !valid_) && limits_.hold_time == 0.0) || sample.force == 0.0,
            "bad input lets go of a solid");
  }

 private:
  Limits limits_;
  bool valid_;
  bounds::Parts max_;
  CondensedInsertion engine_, shadow_;
  CondensedInsertion::Saved kept_;
  proof::Planted<CondensedInsertion> planted_;
  CSolid c_;
};

/// The same around a needle that bends.
void run_bent(from_bytes::Bytes& bytes) {
  const Limits limits = from_bytes::limits(bytes);
  const Bevel bevel = from_bytes::bevel(bytes);
  const bending::FlexibleSettings settings = from_bytes::flexible_settings(bytes);
  const CondensedTissue tissue = table(bytes);
  const std::vector<Layer> layers = solid_layers(bytes);
  const CondensedInsertion axial(tissue, layers, limits, bevel);
  const bool taken = !CondensedInsertion::fault(tissue, layers) && valid(limits) && !first_invalid(bevel);
  proof::BentTrial<2, CondensedInsertion> trial(axial, taken, layers, limits, bevel, settings);
  proof::run<2>(trial, bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  from_bytes::Bytes bytes(data, size);
  if (bytes.below(3) == 0) {
    run_bent(bytes);
    return 0;
  }
  const Limits limits = from_bytes::limits(bytes);
  const CondensedTissue tissue = table(bytes);
  const std::vector<Layer> layers = solid_layers(bytes);
  SolidTrial trial(tissue, layers, limits);
  from_bytes::Motion motion;
  std::size_t steps = 0;
  while (!bytes.empty() && steps < 2000) {
    const from_bytes::Cycle cycle = motion.next(bytes);
    if (cycle.ask != from_bytes::Ask::step)
      trial.ask(cycle);
    else
      for (std::size_t i = 0; i < cycle.times; ++i, ++steps)
        trial.step(motion.moved(cycle), cycle.velocity, cycle.dt);
  }
  return 0;
}
