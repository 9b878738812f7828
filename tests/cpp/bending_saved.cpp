// SPDX-License-Identifier: Apache-2.0
// The saved memory of a needle that bends: it continues to the bit, and other bytes are refused.
#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "bending.hpp"

namespace {

using namespace bending_tests;

/// Two layers, the upper one yields; a bent section; a bevel.
FlexibleSettings layered() {
  FlexibleSettings result = guided();
  result.small_slopes = false;
  result.beam.layer_count = 2;
  result.beam.layers[0].yielding_modulus = 1e5;
  result.beam.layers[0].yield_force = 5.0;
  result.beam.layers[1] = {.top = 0.02, .modulus = 40e3, .tip_force = 0.1, .form = FoundationForm::tanh};
  result.beam.layers[1].scale = 1e-4;
  result.beam.sections.count = 2;
  result.beam.sections.list[0] = {.end = 0.01, .stiffness = 0.01, .curvature = 0.5};
  result.beam.sections.list[1].stiffness = 0.02;
  result.lengths.pressure_friction = 0.1;
  return result;
}
constexpr Bevel bevel{.half_angle = 0.26, .friction_coefficient = 0.1, .face_share = 0.5};

template <std::size_t dimension>
FlexibleInsertion<dimension> fresh(const FlexibleSettings& settings = layered(), Model model = paper::model(),
                                   const Bevel& face = bevel) {
  return FlexibleInsertion<dimension>(Insertion(model, any_speed, face), settings);
}
template <std::size_t dimension>
FlexibleInsertion<dimension> at_30mm() {
  auto needle = fresh<dimension>();
  move(needle, {.depth = -1e-3}, {.depth = 0.03, .lateral = {1e-3, 0.0}, .roll = 2.0}, 31, 0.1);
  return needle;
}
bool same(const BentSample& a, const BentSample& b) {
  return std::memcmp(&a.tip, &b.tip, sizeof a.tip) == 0 &&
         std::memcmp(&a.wrench, &b.wrench, sizeof a.wrench) == 0 && a.force == b.force &&
         a.lateral == b.lateral && a.status == b.status;
}
const Base from{.depth = 0.03, .lateral = {1e-3, 0.0}, .roll = 2.0};
const Base to{.depth = 0.045, .lateral = {-1e-3, 0.0}, .roll = 4.0};

template <std::size_t dimension>
void expect_the_same_bits() {
  auto needle = at_30mm<dimension>(), other = fresh<dimension>();
  const auto saved = needle.save();
  const auto left_out = move(needle, from, to, 20, 0.1);
  ASSERT_TRUE(other.restore(saved));
  EXPECT_TRUE(same(move(other, from, to, 20, 0.1), left_out));
  EXPECT_TRUE(
      same(move(other, to, {.depth = -2e-3}, 100, 0.1), move(needle, to, {.depth = -2e-3}, 100, 0.1)));
  ASSERT_TRUE(needle.restore(saved));
  EXPECT_TRUE(same(move(needle, from, to, 20, 0.1), left_out));
}

TEST(BendingSaved, ContinuesToTheBit) {
  expect_the_same_bits<1>();
  expect_the_same_bits<2>();
}

TEST(BendingSaved, IsRestoredOnlyByItsOwnModelAndSettings) {
  auto needle = at_30mm<2>();
  const auto saved = needle.save();
  const std::vector<std::function<void(FlexibleSettings&)>> changes{
      [](FlexibleSettings& s) { s.beam.layers[0].modulus *= 1.0 + 1e-15; },
      [](FlexibleSettings& s) { s.beam.layers[1].form = FoundationForm::hyperbolic; },
      [](FlexibleSettings& s) { s.beam.layers[1].top = 0.021; },
      [](FlexibleSettings& s) { s.beam.layer_count = 1; },
      [](FlexibleSettings& s) { s.beam.sections.list[0].curvature = 0.0; },
      [](FlexibleSettings& s) { s.beam.sections.list[1].stiffness = 0.03; },
      [](FlexibleSettings& s) { s.beam.sections.list[0].end = 0.011; },
      [](FlexibleSettings& s) { s.beam.support.guide_distance = 0.02; },
      [](FlexibleSettings& s) { s.lengths.bevel_length = 1e-3; },
      [](FlexibleSettings& s) { s.lengths.path_spacing = 2e-4; },
      [](FlexibleSettings& s) { s.beam.elements = 41; },
      [](FlexibleSettings& s) { s.beam.tolerance = 1e-8; },
      [](FlexibleSettings& s) { s.small_slopes = true; }};
  for (std::size_t i = 0; i < changes.size(); ++i) {
    FlexibleSettings other = layered();
    changes[i](other);
    EXPECT_FALSE(fresh<2>(other).restore(saved)) << i;
  }
  Model model = paper::model();
  model.cutting = laws::ConstantCutting{0.08, 20e-6};
  EXPECT_FALSE(fresh<2>(layered(), model).restore(saved));
  EXPECT_FALSE(
      fresh<2>(layered(), paper::model(), Bevel{.half_angle = 0.3, .face_share = 0.5}).restore(saved));
  EXPECT_TRUE(fresh<2>().restore(saved));
  auto version = saved;
  version.bending.version ^= 1;
  version.bending.checksum = version.bending.sum();
  EXPECT_FALSE(needle.restore(version));
}

struct Altered : ::testing::Test {
  SpatialInsertion needle = at_30mm<2>();
  const SpatialInsertion::Saved whole = needle.save();
  std::mt19937_64 generator{1};
  static constexpr std::size_t bits = 8 * sizeof(SpatialInsertion::Saved);

  static void flip(SpatialInsertion::Saved& saved, std::size_t bit) {
    unsigned char byte = 0;
    char* at = reinterpret_cast<char*>(&saved) + bit / 8;
    std::memcpy(&byte, at, 1);
    byte ^= static_cast<unsigned char>(1u << bit % 8);
    std::memcpy(at, &byte, 1);
  }
  bool refused(std::initializer_list<std::size_t> flips) {
    auto altered = whole;
    for (const std::size_t bit : flips) flip(altered, bit);
    return !needle.restore(altered);
  }
};

TEST_F(Altered, OneBitOfEachWordAndPairsAreRefusedAndChangeNothing) {
  auto twin = needle;
  for (std::size_t word = 0; word < bits / 64; ++word) {
    const std::size_t bit = 64 * word + generator() % 64, other = (bit + 1 + generator() % (bits - 1)) % bits;
    ASSERT_TRUE(refused({bit})) << bit;
    ASSERT_TRUE(refused({bit, other})) << bit << " " << other;
  }
  EXPECT_TRUE(same(move(needle, from, to, 5, 0.1), move(twin, from, to, 5, 0.1)));
}

// each stretch of words has a sum of its own: a change over two of them is a smaller change in each
TEST_F(Altered, PairsAndBurstsOverTheEndsOfStretchesAreRefused) {
  using Bytes = decltype(SpatialInsertion::Saved::bending);
  static_assert(Bytes::stretches > 3 && Bytes::stretch <= Checksum::max_words - Checksum::block);
  const std::size_t words = 8 * (offsetof(SpatialInsertion::Saved, bending) + offsetof(Bytes, words));
  for (std::size_t i = 1; i <= Bytes::stretches; ++i) {
    const std::size_t end = words + 64 * std::min(i * Bytes::stretch, Bytes::count);
    for (std::size_t start = end - 64; start <= end; ++start) {
      auto altered = whole;
      const std::uint64_t pattern = generator() | 1u;
      for (std::size_t k = 0; k < 64; ++k)
        if (pattern >> k & 1u) flip(altered, start + k);
      ASSERT_FALSE(needle.restore(altered)) << start;
      ASSERT_TRUE(refused({start, start + 64}));
      ASSERT_TRUE(refused({start - 64 * Bytes::stretch / 2, start}));
    }
  }
}

/// A state of the right model with right sums.
SpatialInsertion::Saved forged(SpatialInsertion::Saved saved,
                               const std::function<void(FlexibleState<2>&)>& change) {
  FlexibleState<2> state = saved.bending.state();
  change(state);
  saved.bending = state_bytes(state, saved.bending.model);
  return saved;
}
SpatialInsertion::Saved forged_axial(SpatialInsertion::Saved saved,
                                     const std::function<void(InsertionState&)>& change) {
  InsertionState state = saved.axial.state();
  change(state);
  saved.axial = state_bytes(state, saved.axial.model);
  return saved;
}

TEST_F(Altered, StatesThatNoNeedleCanHaveAreRefused) {
  using State = FlexibleState<2>;
  const double infinite = std::numeric_limits<double>::infinity(), none = infinite - infinite;
  const auto two = [](bool& flag) { std::memset(&flag, 2, 1); };
  const std::vector<std::function<void(State&)>> changes{
      [](State& s) { s.path.clear(); },
      [](State& s) { s.path = TissuePath<2>(2e-4); },
      [](State& s) { s.embedded = false; },
      [](State& s) { s.beam = {}; },
      [](State& s) { s.sample.phase = static_cast<Phase>(5); },
      [](State& s) { s.last.status = static_cast<Status>(-1); },
      [](State& s) { s.last.axial.status = static_cast<Status>(4); },
      [=](State& s) { s.base.depth = infinite; },
      [=](State& s) { s.base.depth = none; },
      [=](State& s) { s.base.depth = 0.4; },  // deeper than the path has room
      [=](State& s) { s.waited = none; },
      [](State& s) { s.moved_across = -1e300; },
      [=](State& s) { two(s.started); },
      [=](State& s) { two(s.buckled); },
      [=](State& s) { two(s.last.buckled); },
      [=](State& s) { two(s.last.axial.exit); }};
  for (std::size_t i = 0; i < changes.size(); ++i)
    EXPECT_FALSE(needle.restore(forged(whole, changes[i]))) << i;
  const std::vector<std::function<void(InsertionState&)>> axial{
      [](InsertionState& s) { s.pierced = 2; },
      [](InsertionState& s) { s.phase = static_cast<Phase>(9); },
      [=](InsertionState& s) { s.depth = none; },
      [=](InsertionState& s) { s.waited = -1.0; },
      [=](InsertionState& s) { two(s.started); },
      [=](InsertionState& s) { two(s.layers[0].pierced); },
      [=](InsertionState& s) { two(s.layers[3].relaxing.relaxes); }};
  for (std::size_t i = 0; i < axial.size(); ++i)
    EXPECT_FALSE(needle.restore(forged_axial(whole, axial[i]))) << i;
  EXPECT_TRUE(needle.restore(forged(whole, [](State&) {})));
  EXPECT_TRUE(needle.restore(forged_axial(whole, [](InsertionState&) {})));
}

// also run under the sanitizers: whatever a word is, nothing outside memory is read
TEST_F(Altered, AnyWordWithRightSumsIsRefusedOrHarmless) {
  const std::uint64_t values[] = {~0ull,      0x7ff8000000000000ull, 0x7fefffffffffffffull,
                                  1ull << 40, 0x0202020202020202ull, 0};
  const auto try_out = [&](auto part, std::size_t i) {
    auto saved = whole;
    (saved.*part).words[i] = values[i % std::size(values)];
    (saved.*part).checksum = (saved.*part).sum();
    needle.restore(saved);
    move(needle, from, {.depth = 0.0301, .lateral = {1e-3, 0.0}, .roll = 2.0}, 1, 0.1);
    needle.shape([](const Vector&) {});
  };
  const std::size_t nodes = sizeof(TissuePath<2>) / 8 - 16;  // of which a few are enough
  for (std::size_t i = 0; i < whole.bending.words.size(); i += i < nodes ? 97 : 1)
    try_out(&SpatialInsertion::Saved::bending, i);
  for (std::size_t i = 0; i < whole.axial.words.size(); ++i) try_out(&SpatialInsertion::Saved::axial, i);
}

TEST(BendingReset, IsAFreshNeedleAlsoWhereTheTipPresses) {
  Model model = paper::model();
  model.puncture = laws::PunctureDepth{5e-3};
  FlexibleSettings settings = guided();
  SpatialInsertion used = fresh<2>(settings, model), unused = fresh<2>(settings, model);
  move(used, {.depth = -1e-3, .lateral = {1e-3, 0.0}}, {.depth = 0.01, .lateral = {1e-3, 0.0}}, 11);
  used.reset();
  const Base pressing{.depth = 3e-3};
  EXPECT_TRUE(same(used.step(pressing, 0.1), unused.step(pressing, 0.1)));
}

TEST(BendingReset, ShapeHasNoPointsBeforeTheFirstStep) {
  const SpatialInsertion needle = fresh<2>();
  std::size_t points = 0;
  needle.shape([&](const Vector&) { ++points; });
  EXPECT_EQ(points, 0u);
  EXPECT_EQ(needle.shape_points(), points);
}

}  // namespace
