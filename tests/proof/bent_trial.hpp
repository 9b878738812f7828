// SPDX-License-Identifier: Apache-2.0
// One input of the fuzzer of needles that bend: the engine, one that continues from the last saved bytes, and
// the C face, each step compared to the bit; and one whose bytes somebody made on purpose.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <type_traits>

#include "bent_from_bytes.hpp"
#include "c_bending.hpp"
#include "needleforce/base_guard.hpp"
#include "planted.hpp"

namespace needleforce::proof {

/// Every number of a sample of either face, and its words as numbers.
auto bent_numbers_of(const auto& s) {
  std::array<double, 31> all{s.force, s.lateral, s.unsupported, double(s.status), double(s.buckled)};
  std::size_t n = 5;
  for (std::size_t i = 0; i < 3; ++i) all[n++] = s.tip[i], all[n++] = s.tangent[i];
  for (std::size_t i = 0; i < 6; ++i) all[n++] = s.wrench[i];
  for (const double number : numbers_of(s.axial)) all[n++] = number;
  return all;
}
bool same_bent(const auto& a, const auto& b) {
  using Bits = std::array<std::uint64_t, 31>;
  return std::bit_cast<Bits>(bent_numbers_of(a)) == std::bit_cast<Bits>(bent_numbers_of(b));
}

template <std::size_t dimension, class Axial = Insertion>
class BentTrial {
 public:
  using Engine = bending::FlexibleInsertion<dimension, Axial>;

  /// `axial` is made of these layers, limits and bevel; `axial_valid`: whether it has to be accepted.
  BentTrial(const Axial& axial, bool axial_valid, std::span<const Layer> layers, const Limits& limits,
            const Bevel& bevel, const bending::FlexibleSettings& settings)
      : settings_(settings),
        limits_(limits),
        axial_valid_(axial_valid),
        valid_(axial_valid_ && !fault(settings)),
        lateral_ratio_(axial.lateral_ratio()),
        max_(axial_valid_ ? bounds::of(layers, bounds::fastest_accepted(limits)) : bounds::Parts{}),
        engine_(std::make_unique<Engine>(axial, settings)),
        shadow_(std::make_unique<Engine>(*engine_)),
        kept_(std::make_unique<typename Engine::Saved>(engine_->save())),
        guard_(answer_, guarded),
        c_axial_(layers, limits, bevel) {
    constexpr bool in_c = dimension == 2 && std::is_same_v<Axial, Insertion>;
    if (!in_c || settings.small_slopes || !c_axial_.made() || settings.beam.elements == 0) return;
    c_ = std::make_unique<CNeedle>(c_axial_, settings);
    require(c_->made() == valid_, "C takes the needles that C++ takes");
    if (!valid_) c_.reset();
  }

  void ask(const from_bytes::BentCycle& cycle) {
    look_at(guard_.miss(1e-5 * cycle.where));
    if (cycle.ask == from_bytes::Ask::reset) {
      engine_->reset(), shadow_->reset(), guard_.reset();
      if (c_) c_->reset();
      return;
    }
    const bool keeps = cycle.ask == from_bytes::Ask::keep;
    if (keeps) *kept_ = engine_->save();
    if (c_) keeps ? c_->keep() : c_->restore();
    if (c_ && !keeps) c_->restore_altered(cycle.where, static_cast<std::uint8_t>(cycle.change));
    require(shadow_->restore(*kept_) == valid_, "saved bytes are taken back");
    if (keeps) return;
    require(engine_->restore(*kept_) == valid_, "saved bytes are taken back");
    alter(cycle.where, cycle.change);
  }

  /// True while the steps so far took less than some thousand solutions of the beam: in tissue that yields a
  /// single one can take many.
  bool in_time() const { return solutions_ < 2000.0; }

  void step(const bending::Base& base, double dt) {
    solutions_ += solutions(at_, base);
    at_ = base;
    const bending::BentSample sample = engine_->step(base, dt);
    require(same_bent(sample, shadow_->step(base, dt)), "saved bytes continue as the needle does");
    if (c_) require(same_bent(sample, c_->step(base, dt)), "C gives the bits of C++ for a needle");
    planted_.step([](const auto& made) { return bent_numbers_of(made); }, base, dt);
    answer_.sample = sample;
    look_at(guard_.step(base, dt));
    check(sample);
    check_shape(sample);
    const double across = base.lateral[0] + base.lateral[1] + base.tilt[0] + base.tilt[1];
    const bool bad = !std::isfinite(base.depth + base.roll + across + dt) || !(dt > 0.0) ||
                     !(std::abs(base.depth) <= farthest);
    require(!bad || sample.status != Status::ok, "bad input of a base is reported");
    require(valid_ || sample.status == Status::invalid_parameter, "invalid settings are reported");
    if (!((bad || !valid_) && limits_.hold_time == 0.0)) return;
    for (const double component : sample.wrench) require(component == 0.0, "bad input lets go of the base");
    require(sample.force == 0.0 && sample.lateral == 0.0, "bad input lets go");
  }

 private:
  /// An engine that has answered already.
  struct Answer {
    bending::BentSample sample{};
    bending::BentSample step(const bending::Base&, double) noexcept { return sample; }
  };
  static constexpr GuardSettings guarded{.max_force = 3.0,
                                         .max_slew = 1e3,
                                         .stale_after = 5e-3,
                                         .fall_time = 2e-2,
                                         .longest_cycle = 2e-3,
                                         .max_speed = 0.5,
                                         .max_acceleration = 20.0,
                                         .delay = 1.0,
                                         .max_lateral_force = 1.0,
                                         .max_moment = 0.1,
                                         .max_angular_speed = 5.0};
  void look_at(const BaseOutput& output) const {
    const BaseForce& f = output.force;
    for (const double number :
         {f.depth, f.lateral[0], f.lateral[1], f.tilt[0], f.tilt[1], f.roll, output.energy, output.reserve})
      require(std::isfinite(number), "every number of the guard of a needle is finite");
    const double above = 1.0 + 1e-12;
    require(std::abs(f.depth) <= guarded.max_force &&
                std::hypot(f.lateral[0], f.lateral[1]) <= above * guarded.max_lateral_force &&
                std::hypot(f.tilt[0], f.tilt[1], f.roll) <= above * guarded.max_moment,
            "no force of a needle above its clamp");
  }
  void check(const bending::BentSample& sample) const {
    for (const double number : bent_numbers_of(sample))
      require(std::isfinite(number), "every number of a needle is finite");
    const Sample& axial = sample.axial;
    require(axial.stiffness >= 0.0 && axial.stiffness <= max_.stiffness, "a contact pushes as far as it can");
    require(axial.cutting >= 0.0 && axial.cutting <= max_.cutting, "cutting pushes as far as it can");
    require(std::abs(axial.friction) <= max_.friction, "friction is no more than it can be");
    if (!valid_) return;
    // a needle that bending shortens has the axial part of the lateral forces, too
    require(shortens() || std::abs(sample.force - axial.force) <= rubbing(),
            "the pressure rubs as far as it can");
    require(sample.lateral <= steering(axial.cutting), "the bevel pushes as far as it can");
    require(sample.unsupported >= 0.0 && sample.unsupported <= 2.0, "no more than the needle is free");
    double square = 0.0;
    for (const double component : sample.tangent) square += component * component;
    const bool unit = settings_.small_slopes || square == 0.0 || std::abs(square - 1.0) < 1e-3;
    require(unit, "the tangent is a unit vector");
  }
  void check_shape(const bending::BentSample& sample) const {
    std::size_t points = 0;
    bending::Vector first{}, last{};
    engine_->shape([&](const bending::Vector& point) {
      for (const double number : point) require(std::isfinite(number), "the shape is finite");
      if (points++ == 0) first = point;
      last = point;
    });
    require(points == engine_->shape_points(), "the shape has as many points as it states");
    if (c_) require(points == c_->shape_points(), "C gives the shape of C++");
    const bool accepted = sample.status == Status::ok && !settings_.small_slopes;
    require(!accepted || last == sample.tip, "the shape ends at the tip");
    const double reach = std::hypot(last[0] - first[0], last[1] - first[1], last[2] - first[2]);
    require(!valid_ || reach <= 1.01 * settings_.beam.support.needle_length,
            "no needle is longer than it is");
  }
  /// How many solutions of the beam a step takes, about.
  double solutions(const bending::Base& from, const bending::Base& to) const {
    const bending::Bending& lengths = settings_.lengths;
    double moved = std::abs(to.depth - from.depth);
    for (std::size_t d = 0; d < 2; ++d)
      moved += std::abs(to.lateral[d] - from.lateral[d]) + std::abs(to.tilt[d] - from.tilt[d]);
    return valid_ && moved < 3.0 * lengths.max_travel ? 1.0 + moved / lengths.path_spacing : 1.0;
  }
  /// Largest friction [N] of the lateral pressure, where every layer softens: p < K u_c, along 1 m at most.
  double rubbing() const {
    double max = 0.0;
    for (std::size_t i = 0; i < std::min(settings_.beam.layer_count, bending::max_lateral_layers); ++i) {
      const bending::LateralLayer& layer = settings_.beam.layers[i];
      const bool softens = layer.form == FoundationForm::hyperbolic || layer.form == FoundationForm::tanh;
      max = std::max(max, softens ? layer.modulus * layer.scale : std::numeric_limits<double>::max());
    }
    return 1.001 * settings_.lengths.pressure_friction * max;
  }
  /// Cutting pays for what pushes its tip aside, or nothing does.
  bool shortens() const { return engine_->shortens(); }
  /// Largest lateral force [N] of a layer on a tip.
  double pushing() const {
    double max = 0.0;
    for (const bending::LateralLayer& layer : settings_.beam.layers)
      max = std::max(max, std::abs(layer.tip_force));
    return max;
  }
  /// Largest lateral force [N] on the tip: a share of the cutting force, of what is cut ten times it; or of a
  /// needle that bending does not shorten that of the bevel's face when it last cut, and of the tissue.
  double steering(double cutting) const {
    const double ratio = std::abs(lateral_ratio_), above = 1.0 + 1e-12;
    if (shortens()) return above * cutting * (ratio + (pushing() > 0.0 ? 10.0 : 0.0));
    return above * (ratio * max_.cutting + pushing());
  }
  /// Altered bytes are refused; with right sums they are refused or lead to numbers that are finite.
  void alter(std::size_t where, std::uint64_t change) {
    auto altered = std::make_unique<typename Engine::Saved>(*kept_);
    altered->bending.words[where % altered->bending.words.size()] ^= change ? change : 1;
    require(!engine_->restore(*altered), "altered bytes are refused");
    planted_.restore(*engine_, [&](auto& saved) {
      const std::size_t words = saved.bending.words.size(), near = words - 1 - where / 3 % 800;
      // a third of them in the axial state, another where most is that is no path
      if (where % 3 == 0)
        plant(saved.axial, where / 3, change);
      else
        plant(saved.bending, where % 3 == 1 ? near : where / 3, change);
    });
    planted_.engine()->shape([](const bending::Vector& point) {
      for (const double number : point)
        require(std::isfinite(number), "the shape from planted bytes is finite");
    });
  }

  bending::FlexibleSettings settings_;
  Limits limits_;
  bool axial_valid_, valid_;
  bending::Base at_{};
  double solutions_ = 0.0;
  double lateral_ratio_;
  bounds::Parts max_;
  std::unique_ptr<Engine> engine_, shadow_;
  Planted<Engine> planted_;
  std::unique_ptr<typename Engine::Saved> kept_;
  Answer answer_{};
  Guard<Answer&> guard_;
  CFace c_axial_;
  std::unique_ptr<CNeedle> c_;
};

/// Motions of the base and other requests, as long as there are bytes.
template <std::size_t dimension>
void run(auto& trial, from_bytes::Bytes& bytes) {
  from_bytes::BentMotion motion;
  bending::Base kept;
  while (!bytes.empty() && trial.in_time()) {
    const from_bytes::BentCycle cycle = motion.next(bytes);
    if (cycle.ask == from_bytes::Ask::step) {
      for (std::size_t i = 0; i < cycle.times; ++i) trial.step(motion.moved(cycle, i, dimension), cycle.dt);
      continue;
    }
    trial.ask(cycle);
    if (cycle.ask == from_bytes::Ask::keep) kept = motion.base();
    motion.set(cycle.ask == from_bytes::Ask::reset ? bending::Base{} : kept);
  }
}

}  // namespace needleforce::proof
