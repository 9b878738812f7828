// SPDX-License-Identifier: Apache-2.0
// Saved states that somebody made on purpose, with right sums: what no needle can have is refused by name,
// and whatever is taken gives numbers that are finite. The fuzzers do the same with several words at once.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <vector>

#include "../proof/bounds.hpp"
#include "bending.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

namespace {

using namespace solid_tests;
using bending_tests::guided;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Numbers, counts and flags that no needle has.
std::vector<std::uint64_t> planted_words() {
  std::vector<std::uint64_t> words{~0ull, 2, 65, 3001, 1ull << 40, 0x0202020202020202ull};
  for (const double number :
       {infinite - infinite, infinite, -infinite, 1e300, -1e300, 1e30, -1e30, 1e9, -1.0, 1e-310})
    words.push_back(std::bit_cast<std::uint64_t>(number));
  return words;
}

/// Plants each of them in each word of one part of saved bytes, or every few of them, and goes on from what
/// is taken.
template <class Engine>
void plant(const Engine& engine, const typename Engine::Saved& whole, auto part_of, std::size_t every,
           auto go_on) {
  auto saved = std::make_unique<typename Engine::Saved>(whole);
  auto made = std::make_unique<Engine>(engine);
  auto& part = part_of(*saved);
  std::size_t refused = 0;
  for (std::size_t i = 0; i < part.words.size(); i += every)
    for (const std::uint64_t word : planted_words()) {
      const std::uint64_t before = std::exchange(part.words[i], word);
      part.checksum = part.sum();
      *made = engine;
      const bool taken = made->restore(*saved);
      ASSERT_EQ(taken, made->restore_fault(*saved) == nullptr);
      taken ? go_on(*made, i, word) : void(++refused);
      part.words[i] = before;
      if (::testing::Test::HasFatalFailure()) return;
    }
  EXPECT_GT(refused, part.words.size() / every);
}
constexpr auto itself = [](auto& saved) -> auto& { return saved; };

/// Some steps around where it was, one of them refused; forces stay within what the laws allow.
template <class Engine>
void step_around(Engine& engine, double from, const bounds::Parts& most, std::size_t i, std::uint64_t word) {
  const double depths[] = {from, infinite, from + 2e-5, from + 4e-5, from - 1e-3, from - 3e-3, from - 2e-2};
  for (const double depth : depths) {
    const Sample sample = engine.step(depth, no_velocity, 0.1);
    ASSERT_TRUE(
        std::isfinite(sample.force + sample.lateral + sample.force_by_depth + sample.force_by_velocity))
        << i << " " << std::bit_cast<double>(word);
    if (sample.status != Status::ok) continue;
    ASSERT_LE(std::abs(sample.stiffness), most.stiffness) << i << " " << std::bit_cast<double>(word);
    ASSERT_LE(std::abs(sample.friction), most.friction) << i << " " << std::bit_cast<double>(word);
    ASSERT_LE(std::abs(sample.cutting), most.cutting) << i << " " << std::bit_cast<double>(word);
  }
}

/// An engine that went in by small steps, and its states on the way.
template <class Engine>
void plant_on_the_way(Engine engine, const std::vector<Layer>& layers, const Limits& limits) {
  const bounds::Parts most = bounds::of(layers, bounds::fastest_accepted(limits));
  double depth = -1e-3;
  for (const double stop : {2e-3, 25e-3}) {
    for (; depth < stop; depth += 1e-4) engine.step(depth, no_velocity, 0.1);
    plant(engine, engine.save(), itself, 1,
          [&](Engine& made, std::size_t i, std::uint64_t word) { step_around(made, depth, most, i, word); });
  }
}

constexpr Limits noisy{.hold_time = 0.2, .depth_noise = 2e-5};

TEST(PlantedStates, OfAnInsertionAreRefusedOrHarmless) {
  Model relaxing = paper::model(), cracking = paper::model();
  relaxing.relaxation = laws::Prony{0.3, 0.5, 0.1, 5.0};
  relaxing.friction = laws::LuGre{1e6, 1e2, 1e2, 18.0, 20.0, 1e-3, 2.0};
  cracking.cutting = laws::StickSlip{0.3, 0.1, 1e-2, 1.0, 200.0};
  cracking.friction = laws::Karnopp{20.0, -20.0, 0.0, 0.0, 25.0, -25.0, 1e-3, 1e-5};
  for (const Model& model : {relaxing, cracking}) {
    const std::vector<Layer> layers{{0.0, model}, {0.02, model}};
    plant_on_the_way(Insertion(layers, noisy), layers, noisy);
  }
}

TEST(PlantedStates, OfACondensedSolidAreRefusedOrHarmless) {
  for (const bool relaxes : {false, true}) {
    Model model = laws_of(20.0, 0.1, 0.2);
    if (relaxes) model.relaxation = laws::Prony{0.4, 0.5, 0.1, 5.0};
    const std::vector<Layer> layers{{0.0, model}, {0.02, model}};
    plant_on_the_way(CondensedInsertion(tissue(2e-3, 30), layers, noisy), layers, noisy);
  }
}

template <class Engine>
void plant_in_bent(Engine needle, std::size_t every) {
  bending::Base base;
  for (base.depth = -1e-3; base.depth < 0.012; base.depth += 1e-3, base.lateral[0] += 2e-5)
    needle.step(base, 0.1);
  const auto look = [](Engine& made, const bending::BentSample& sample, std::size_t i, std::uint64_t word) {
    double sum = sample.force + sample.lateral + sample.unsupported;
    for (const double number : sample.wrench) sum += number;
    made.shape([&](const bending::Vector& point) { sum += point[0] + point[1] + point[2]; });
    ASSERT_TRUE(std::isfinite(sum)) << i << " " << std::bit_cast<double>(word);
  };
  const auto go_on = [&](Engine& made, std::size_t i, std::uint64_t word) {
    bending::Base at = base;
    for (const double by : {0.0, 2e-4, infinite, -4e-3}) {
      at.depth = base.depth - 1e-3 + by, at.roll += 0.1;
      look(made, made.step(at, 0.1), i, word);
      if (::testing::Test::HasFatalFailure()) return;
    }
  };
  plant(needle, needle.save(), [](auto& saved) -> auto& { return saved.bending; }, every, go_on);
  plant(needle, needle.save(), [](auto& saved) -> auto& { return saved.axial; }, every, go_on);
}

TEST(PlantedStates, OfANeedleThatBendsAreRefusedOrHarmless) {
  bending::FlexibleSettings settings = guided();
  settings.small_slopes = false;
  settings.lengths.pressure_friction = 0.1;
  const Limits limits{.max_speed = infinite, .hold_time = 0.2};
  plant_in_bent(bending::SpatialInsertion(Insertion(paper::model(), limits), settings), 41);
  settings.beam.layers[0].yielding_modulus = 1e5;
  settings.beam.layers[0].yield_force = 5.0;
  plant_in_bent(bending::PlanarInsertion(Insertion(paper::model(), limits), settings), 89);
  const Layer layer{0.0, laws_of(20.0, 0.1, 0.2)};
  plant_in_bent(BentInSolid<1>(CondensedInsertion(tissue(2e-3), std::span(&layer, 1), limits), settings), 89);
}

/// The part that is named where a state was changed.
template <class Saved, class State>
const char* named(const auto& engine, Saved saved, const std::function<void(State&)>& change) {
  State state = saved.state();
  change(state);
  saved = state_bytes(state, saved.model);
  return engine.restore_fault(saved);
}

TEST(PlantedStates, AreRefusedByTheNameOfTheFirstPart) {
  Insertion insertion(paper::model());
  CondensedInsertion solid = solid_tests::insertion(2e-3, laws_of(20.0, 0.1, 0.2));
  for (double depth = -1e-3; depth < 8e-3; depth += 1e-4) {
    insertion.step(depth, no_velocity, 0.1);
    solid.step(depth, no_velocity, 0.1);
  }
  using Axial = std::function<void(InsertionState&)>;
  for (const auto& [part, change] : std::vector<std::pair<const char*, Axial>>{
           {"depth", [](InsertionState& s) { s.depth = -infinite; }},
           {"waited", [](InsertionState& s) { s.waited = -1.0; }},
           {"pierced", [](InsertionState& s) { s.pierced = 2; }},
           {"cut", [](InsertionState& s) { s.cut.front = 1e30; }},
           {"started", [](InsertionState& s) { std::memset(&s.started, 2, 1); }},
           {"layers.contact", [](InsertionState& s) { s.layers[0].contact.memory[1] = -1e300; }},
           {"layers.friction",
            [](InsertionState& s) { s.layers[0].friction.of<TractionMemory>().traction = infinite; }},
           {"last", [](InsertionState& s) { s.last.status = Status{7}; }}})
    EXPECT_STREQ(named(insertion, insertion.save(), change), part);
  using Condensed = std::function<void(CondensedState&)>;
  for (const auto& [part, change] : std::vector<std::pair<const char*, Condensed>>{
           {"shaft.force", [](CondensedState& s) { s.shaft.force[5] = infinite - infinite; }},
           {"shaft.displacement", [](CondensedState& s) { s.by_travel.displacement[0] = 1e300; }},
           {"shaft.known", [](CondensedState& s) { s.shaft.known = 62; }},
           {"row", [](CondensedState& s) { s.row = 64; }},
           {"tip", [](CondensedState& s) { s.tip = s.cut + 1e-3; }},
           {"tip_force", [](CondensedState& s) { s.tip_force = -1.0; }},
           {"relaxing.contact", [](CondensedState& s) { s.relaxing.contact.elastic = 1e9; }}})
    EXPECT_STREQ(named(solid, solid.save(), change), part);
}

}  // namespace
