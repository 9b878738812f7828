// SPDX-License-Identifier: Apache-2.0
// The contract of step(): nothing allocates, nothing throws, nothing that is not finite comes out.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>
#include <random>

#include "../../bindings/c/needleforce_guard.h"
#include "../proof/c_layers.hpp"
#include "bending.hpp"
#include "every_model.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "needleforce/flight_recorder.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "solid.hpp"

namespace {
std::atomic<bool> armed{false};
std::atomic<long> allocations{0};

void* allocate(std::size_t size) {
  if (armed) ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}
}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size) { return allocate(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

using namespace needleforce;

namespace {

template <class... T>
constexpr bool all_trivially_copyable = (std::is_trivially_copyable_v<T> && ...);
template <class... T>
constexpr bool all_plain = ((std::is_standard_layout_v<T> && std::is_trivial_v<T>) && ...);

static_assert(
    all_trivially_copyable<Insertion, InsertionState, Insertion::Saved, Sample, Model, Layer, Limits, Bevel>);
static_assert(all_plain<nf_parameter, nf_tip, nf_law, nf_layer, nf_settings, nf_fault, nf_sample, nf_output,
                        Insertion::Saved>);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<Insertion&>().reset()));
static_assert(noexcept(std::declval<const Insertion&>().snapshot()));
static_assert(noexcept(std::declval<const Insertion&>().save()));
static_assert(noexcept(std::declval<Insertion&>().restore(std::declval<const Insertion::Saved&>())));
static_assert(all_trivially_copyable<bending::SpatialInsertion, bending::FlexibleState<2>,
                                     bending::SpatialInsertion::Saved, bending::BentSample>);
static_assert(all_plain<bending::PlanarInsertion::Saved, bending::SpatialInsertion::Saved>);
static_assert(noexcept(std::declval<const bending::SpatialInsertion&>().save()));
static_assert(noexcept(std::declval<bending::SpatialInsertion&>().restore(
    std::declval<const bending::SpatialInsertion::Saved&>())));
static_assert(all_trivially_copyable<solid::CondensedInsertion, solid::CondensedState, solid::CondensedTissue,
                                     solid::CondensedInsertion::Saved>);
static_assert(noexcept(std::declval<solid::CondensedInsertion&>().step(0.0, 0.0, 0.0)));
static_assert(std::is_nothrow_copy_assignable_v<Insertion>);
static_assert(std::is_nothrow_constructible_v<Insertion, const Model&>);
static_assert(std::is_nothrow_constructible_v<Insertion, std::span<const Layer>>);

/// Mostly a plausible random walk, now and then a value that no sensor should give, or a leap.
class RandomInput {
 public:
  explicit RandomInput(double size = 1e-5) : size_(size) {}
  double depth() {
    if (generator_() % 200 == 0) depth_ = 20e-3 * unit_(generator_);
    return spoiled(depth_ += size_ * unit_(generator_));
  }
  double velocity() { return coin() ? no_velocity : spoiled(1e-2 * unit_(generator_)); }
  double dt() {
    constexpr double lengths[] = {1e-9, 1e-6, 1.0, 1e6};
    return spoiled(generator_() % 10 == 0 ? lengths[generator_() % std::size(lengths)] : 1e-3);
  }

 private:
  bool coin() { return generator_() % 2 == 0; }
  double spoiled(double value) {
    constexpr double bad[] = {std::numeric_limits<double>::quiet_NaN(),
                              std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity(),
                              std::numeric_limits<double>::denorm_min(),
                              std::numeric_limits<double>::max(),
                              1e300,
                              -1e300,
                              0.0,
                              -1.0,
                              1e-300};
    return generator_() % 50 == 0 ? bad[generator_() % std::size(bad)] : value;
  }
  std::mt19937_64 generator_{1};
  std::uniform_real_distribution<double> unit_{-1.0, 1.0};
  double size_, depth_ = 2e-3;
};

struct Seen {
  bool finite = true, faults_say_so = true;
  double largest = 0.0;
  long refused = 0, steps = 0;
};

/// The same engine through the C face.
class CInsertion {
 public:
  explicit CInsertion(std::span<const Layer> layers) : memory_(nf_size() / sizeof(double) + 1) {
    CLayers named(layers);
    insertion_ = nf_init(memory_.data(), nf_size(), named.data(), named.size(), nullptr, nullptr);
  }
  Sample step(double depth, double velocity, double dt) noexcept {
    nf_sample sample;
    nf_step(insertion_, depth, velocity, dt, &sample);
    return {.force = sample.force,
            .force_by_depth = sample.force_by_depth,
            .force_by_velocity = sample.force_by_velocity,
            .status = Status(sample.status)};
  }

 private:
  std::vector<double> memory_;
  nf_insertion* insertion_;
};

/// Steps with the allocator armed.
template <class Engine>
Seen run(Engine insertion, RandomInput input, int n) {
  Seen seen;
  armed = true;
  for (int i = 0; i < n; ++i) {
    const double depth = input.depth(), velocity = input.velocity(), dt = input.dt();
    const Sample sample = insertion.step(depth, velocity, dt);
    seen.finite = seen.finite && std::isfinite(sample.force) && std::isfinite(sample.force_by_depth) &&
                  std::isfinite(sample.force_by_velocity);
    const bool bad = !std::isfinite(depth) || !std::isfinite(velocity) || !std::isfinite(dt) || !(dt > 0.0);
    seen.faults_say_so = seen.faults_say_so && (!bad || sample.status != Status::ok);
    seen.refused += sample.status != Status::ok;
    seen.largest = std::fmax(seen.largest, std::abs(sample.force));
  }
  armed = false;
  seen.steps = n;
  return seen;
}

void expect_sound(const Seen& seen, const std::string& name) {
  EXPECT_EQ(allocations, 0) << name;
  EXPECT_TRUE(seen.finite) << name;
  EXPECT_TRUE(seen.faults_say_so) << name;
  EXPECT_GT(seen.largest, 0.05) << name;
  EXPECT_GT(seen.refused, 0) << name;
  EXPECT_LT(seen.refused, seen.steps) << name;
  allocations = 0;
}

/// Eight layers of a model, as close as their punctures allow; the deeper ones with a friction that has no
/// need of the tissue's surface.
std::vector<Layer> eight_of(const Model& model) {
  const double apart = std::max(5e-3, 1.01 * puncture_depth(model.puncture, prepare(model.stiffness)));
  std::vector<Layer> stack;
  for (int i = 0; i < 8; ++i) stack.push_back({apart * i, model});
  if (std::holds_alternative<laws::RelaxingSurface>(model.friction))
    for (int i = 1; i < 8; ++i) stack[i].laws.friction = usual<laws::Coulomb>();
  EXPECT_EQ(first_fault(stack).reason, nullptr) << name_of(model);
  return stack;
}

TEST(RealTime, MillionStepsAllocateNothingAndStayFinite) {
  expect_sound(run(Insertion(paper::model(), Limits{.hold_time = 5e-3}), RandomInput(), 1000000), "paper");
}

/// Four layers with bristles, relaxation and a crack that sticks and slips.
std::vector<Layer> full_stack() {
  const Model model{usual<laws::ConeCylinder>(), usual<laws::PunctureForce>(), usual<laws::LuGre>(),
                    usual<laws::StickSlip>(), usual<laws::Prony>()};
  return {{0.0, model}, {5e-3, model}, {1e-2, model}, {1.5e-2, model}};
}

TEST(RealTime, FourLayersWithMemoryAllocateNothingAndStayFinite) {
  expect_sound(run(Insertion(full_stack()), RandomInput(1e-4), 1000000), "four layers");
}

TEST(RealTime, CInterfaceAllocatesNothingAndStaysFinite) {
  const std::vector<Layer> stack = full_stack();
  expect_sound(run(CInsertion(stack), RandomInput(1e-4), 1000000), "C");
}

TEST(RealTime, EveryLawInEightLayersAllocatesNothingForAnyLimits) {
  const double infinite = std::numeric_limits<double>::infinity();
  const Limits lenient{.max_speed = infinite, .velocity_slack = infinite};
  for (const Model& model : every_model())
    for (const Limits& limits : {Limits{}, lenient})
      expect_sound(run(Insertion(eight_of(model), limits), RandomInput(1e-4), 10000), name_of(model));
}

/// A stroke to `depth`, then an hour at rest in n steps.
Sample after_an_hour(const Model& model, double depth, int n) {
  Insertion insertion(model);
  paper::move(insertion, -1e-3, depth);
  Sample sample;
  for (int i = 0; i < n; ++i) sample = insertion.step(depth, no_velocity, 3600.0 / n);
  return sample;
}

TEST(RealTime, HourOfHoldIsTheSameInOneStepAndInMany) {
  for (const Model& model : every_model()) {
    const bool exact =
        std::visit([]<class F, class C>(const F&, const C&) { return steps_exactly<F> && steps_exactly<C>; },
                   model.friction, model.cutting);
    for (const double depth : {1e-3, 8e-3}) {
      const Sample once = after_an_hour(model, depth, 1), often = after_an_hour(model, depth, 20000);
      EXPECT_EQ(once.status, Status::ok);
      EXPECT_TRUE(std::isfinite(once.force) && std::isfinite(often.force)) << name_of(model);
      EXPECT_EQ(once.phase, often.phase) << name_of(model);
      if (exact) {
        EXPECT_NEAR(once.force, often.force, 1e-9) << name_of(model) << " at " << depth;
      }
    }
  }
}

double reach_of(const Model& model) {
  return std::visit([](const auto& law) { return law.prepare().reach(); }, model.stiffness);
}

TEST(RealTime, OneStepFromAirIntoTissueIsAnInsertionAndOneOutAnExit) {
  for (const Model& model : every_model()) {
    Insertion insertion(eight_of(model), Limits{.max_speed = 1e9});
    EXPECT_EQ(insertion.step(-0.5, no_velocity, 1e-3).force, 0.0);
    for (const double depth : {0.5, -0.9, 0.9, -0.9}) {
      const Sample sample = insertion.step(depth, no_velocity, 1e-3);
      // a contact that relaxes gives way by its last force: a leap may take it beyond its formula
      EXPECT_TRUE(sample.status == Status::ok || reach_of(model) < depth) << name_of(model);
      EXPECT_TRUE(std::isfinite(sample.force)) << name_of(model);
      // what a spring or a surface of the step before still held has let go in the next
      if (depth < 0.0) {
        EXPECT_EQ(insertion.step(depth, no_velocity, 1.0).force, 0.0) << name_of(model);
      }
    }
  }
}

/// Steps of a guard and its recorder with the allocator armed; the largest force, or NaN if one was none.
template <class Engine>
double guarded(Guard<Engine> guard, RandomInput input, int n) {
  static FlightRecorder<256> recorder;
  double largest = 0.0;
  armed = true;
  for (int i = 0; i < n; ++i) {
    const double depth = input.depth(), velocity = input.velocity(), dt = input.dt();
    const Output output = i % 17 == 0 ? guard.miss(dt) : guard.step(depth, velocity, dt);
    recorder.write(depth, velocity, dt, output);
    const bool finite = std::isfinite(output.force) && std::isfinite(output.energy) &&
                        std::isfinite(output.reserve) && std::isfinite(output.sample.force);
    largest = finite ? std::fmax(largest, std::abs(output.force)) : nan("");
    if (!finite) break;
  }
  armed = false;
  return largest;
}

/// Settings all over their ranges, as far as they go together.
GuardSettings random_settings(std::mt19937_64& generator) {
  GuardSettings settings;
  do
    for (const auto& row : GuardSettings::table) {
      const double high = std::min(row.high, 1e3), place = static_cast<double>(generator() % 1001) * 1e-3;
      settings.*row.member = generator() % 3 == 0 ? row.initial : along(row.low, high, place);
      if (row.member == &GuardSettings::delay) settings.delay = std::floor(settings.delay);
    }
  while (!valid(settings));
  return settings;
}

TEST(RealTime, GuardAllocatesNothingAndKeepsItsClampForAnyInput) {
  const double infinite = std::numeric_limits<double>::infinity();
  const Limits lenient{.max_speed = infinite, .velocity_slack = infinite};
  const Insertion insertion(paper::model(), lenient);
  const GuardSettings energetic{.max_force = 0.25,
                                .max_slew = 500.0,
                                .stale_after = 2e-3,
                                .fall_time = 10e-3,
                                .longest_cycle = 2e-3,
                                .max_speed = 0.5,
                                .delay = 2.0,
                                .max_reserve = 0.01,
                                .position_error = 1e-6};
  const double largest = guarded(Guard(insertion, energetic), RandomInput(), 1000000);
  EXPECT_LE(largest, 0.25);
  EXPECT_GT(largest, 0.0);
  std::mt19937_64 generator(4);
  for (int i = 0; i < 200; ++i) {
    const GuardSettings settings = random_settings(generator);
    EXPECT_LE(guarded(Guard(insertion, settings), RandomInput(1e-4), 5000), settings.max_force);
  }
  EXPECT_EQ(allocations, 0);
  allocations = 0;
}

/// Steps of a needle that bends with the allocator armed, on a random walk of its base with spoiled values.
template <std::size_t dimension, class Axial>
Seen bent(bending::FlexibleInsertion<dimension, Axial> needle, int n) {
  RandomInput input(2e-5), aside(1e-6);
  Seen seen;
  armed = true;
  for (int i = 0; i < n; ++i) {
    bending::Base base{.depth = input.depth(), .roll = 1e-3 * i};
    for (std::size_t d = 0; d < dimension; ++d) base.lateral[d] = 0.1 * aside.depth();
    const double dt = input.dt();
    const bending::BentSample sample = needle.step(base, dt);
    if (i % 500 == 0) seen.finite = seen.finite && needle.restore(needle.save());
    double sum = sample.force + sample.tip[0] + sample.tip[1] + sample.tip[2];
    for (const double component : sample.wrench) sum += component;
    const bool bad = !std::isfinite(base.depth + base.lateral[0] + base.lateral[1] + dt) || !(dt > 0.0);
    seen.finite = seen.finite && std::isfinite(sum);
    seen.faults_say_so = seen.faults_say_so && (!bad || sample.status != Status::ok);
    seen.refused += sample.status != Status::ok;
    seen.largest = std::fmax(seen.largest, std::abs(sample.force));
  }
  armed = false;
  seen.steps = n;
  return seen;
}

/// A bevelled needle under the paper's force, in a foundation of a form; the last form yields, too.
bending::FlexibleSettings bevelled(FoundationForm form) {
  bending::FlexibleSettings settings = bending_tests::guided();
  settings.lengths.pressure_friction = 0.1;
  bending::LateralLayer& layer = settings.beam.layers[0];
  layer.form = form;
  layer.scale = 1e-4;
  layer.yielding_modulus = form == FoundationForm::tanh ? 1e5 : 0.0;
  layer.yield_force = 5.0;
  layer.tip_stiffness = 100.0;
  return settings;
}
Insertion with_bevel() {
  return Insertion(paper::model(), {},
                   Bevel{.half_angle = 0.26, .friction_coefficient = 0.1, .face_share = 0.5});
}

TEST(RealTime, MillionStepsOfANeedleThatBendsAllocateNothing) {
  expect_sound(bent(bending::SpatialInsertion(with_bevel(), bevelled(FoundationForm::linear)), 1000000),
               "in space");
}

TEST(RealTime, NeedleThatBendsAllocatesNothingOnAnyFoundation) {
  for (const FoundationForm form :
       {FoundationForm::linear, FoundationForm::cubic, FoundationForm::hyperbolic, FoundationForm::tanh}) {
    expect_sound(bent(bending::SpatialInsertion(with_bevel(), bevelled(form)), 10000), "in space");
    expect_sound(bent(bending::PlanarInsertion(with_bevel(), bevelled(form)), 20000), "in a plane");
  }
}

TEST(RealTime, NeedleThatBendsInASolidAllocatesNothing) {
  const auto settings = bevelled(FoundationForm::linear);
  const solid::CondensedInsertion axial = solid_tests::insertion(2e-3, solid_tests::laws_of(20.0, 0.1, 0.2));
  expect_sound(bent(solid::BentInSolid<2>(axial, settings), 20000), "in space");
  expect_sound(bent(solid::BentInSolid<1>(axial, settings), 20000), "in a plane");
}

TEST(RealTime, EstimatorAllocatesNothingAndStaysFiniteForAnyReading) {
  const bending::SpatialInsertion needle(with_bevel(), bevelled(FoundationForm::linear));
  const std::array varied{needle, needle};
  const auto estimator = std::make_unique<bending::TipEstimator>(needle, varied, bending::PathUncertainty{});
  RandomInput input(2e-5), aside(1e-6);
  bool finite = true;
  armed = true;
  for (int i = 0; i < 20000; ++i) {
    bending::Base base{.depth = input.depth(), .lateral = {0.1 * aside.depth(), 0.0}};
    const bending::TipEstimate estimate = estimator->step(base, input.dt());
    if (i % 7 == 0) estimator->tip({aside.depth(), aside.depth()}, input.dt());
    if (i % 11 == 0) estimator->wrench({aside.depth(), 0.0, 0.0, aside.depth(), 0.0, 0.0});
    estimator->shape(
        [&](const bending::Vector& point) noexcept { finite &= std::isfinite(point[0] + point[1]); });
    finite &=
        std::isfinite(estimate.tip[0] + estimate.tip[1] + estimate.covariance[0] + estimate.covariance[2]);
  }
  armed = false;
  EXPECT_TRUE(finite);
  EXPECT_EQ(allocations, 0);
  allocations = 0;
}

/// Steps in a condensed solid with the allocator armed, on a random walk with spoiled values.
Seen condensed(solid::CondensedInsertion insertion, double size, int n) {
  RandomInput input(size);
  Seen seen;
  armed = true;
  for (int i = 0; i < n; ++i) {
    const double depth = input.depth(), velocity = input.velocity(), dt = input.dt();
    const Sample sample = insertion.step(depth, velocity, dt);
    if (i % 500 == 0) seen.finite = seen.finite && insertion.restore(insertion.save());
    const double sum =
        sample.force + sample.friction + sample.cutting + sample.stiffness + sample.force_by_depth;
    seen.finite = seen.finite && std::isfinite(sum) && std::isfinite(insertion.displacement(3));
    const bool bad = !std::isfinite(depth + velocity + dt) || !(dt > 0.0);
    seen.faults_say_so = seen.faults_say_so && (!bad || sample.status != Status::ok);
    seen.refused += sample.status != Status::ok;
    seen.largest = std::fmax(seen.largest, std::abs(sample.force));
  }
  armed = false;
  seen.steps = n;
  return seen;
}

TEST(RealTime, CondensedSolidAllocatesNothingAndStaysFinite) {
  const Limits lenient{.max_speed = std::numeric_limits<double>::infinity(),
                       .velocity_slack = std::numeric_limits<double>::infinity()};
  for (const double scale : {1e-9, 1e-3, 0.1})
    expect_sound(
        condensed(solid_tests::insertion(scale, solid_tests::laws_of(20.0, 0.1, 0.1), lenient), 2e-5, 100000),
        "solid");
  expect_sound(condensed(solid_tests::insertion(1e-3, solid_tests::laws_of(20.0, 0.1, 0.1)), 1e-6, 300000),
               "slow");
}

TEST(RealTime, AllocationCounterDetectsAnAllocation) {
  allocations = 0;
  armed = true;
  delete new int(1);
  armed = false;
  EXPECT_EQ(allocations, 1);
}

}  // namespace
