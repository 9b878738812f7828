// SPDX-License-Identifier: Apache-2.0
// The contract of step(): nothing allocates, nothing throws, nothing that is not finite comes out.
#include "real_time.hpp"

#include <cstdlib>
#include <memory>
#include <new>
#include <random>
#include <span>

#include "../../bindings/c/needleforce_guard.h"
#include "../proof/c_layers.hpp"
#include "every_model.hpp"
#include "needleforce/batch/insertion_batch.hpp"
#include "needleforce/flight_recorder.hpp"

namespace {
void* allocate(std::size_t size) {
  if (real_time::armed) ++real_time::allocations;
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

namespace {

using namespace real_time;

static_assert(
    all_trivially_copyable<Insertion, InsertionState, Insertion::Saved, Sample, Model, Layer, Limits, Bevel>);
static_assert(all_plain<nf_parameter, nf_tip, nf_law, nf_layer, nf_settings, nf_fault, nf_sample, nf_output,
                        Insertion::Saved>);
static_assert(noexcept(std::declval<Insertion&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<Insertion&>().reset()));
static_assert(noexcept(std::declval<const Insertion&>().snapshot()));
static_assert(noexcept(std::declval<const Insertion&>().save()));
static_assert(noexcept(std::declval<Insertion&>().restore(std::declval<const Insertion::Saved&>())));
static_assert(std::is_nothrow_copy_assignable_v<Insertion>);
static_assert(std::is_nothrow_constructible_v<Insertion, const Model&>);
static_assert(std::is_nothrow_constructible_v<Insertion, std::span<const Layer>>);

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

/// A member of a batch, between others.
class Member {
 public:
  explicit Member(std::span<const Layer> layers) : batch_(layers, members) {}
  Sample step(double depth, double velocity, double dt) noexcept {
    depths_.fill(depth), velocities_.fill(velocity);
    batch_.step({depths_.data(), velocities_.data(), &dt, true}, {rows_.data(), members});
    const auto number = [&](BatchRow row) { return rows_[static_cast<std::size_t>(row) * members + 2]; };
    return {.force = number(BatchRow::force),
            .force_by_depth = number(BatchRow::force_by_depth),
            .force_by_velocity = number(BatchRow::force_by_velocity),
            .status = static_cast<Status>(number(BatchRow::status))};
  }

 private:
  static constexpr std::size_t members = 5;
  InsertionBatch batch_;
  std::array<double, members> depths_{}, velocities_{};
  std::array<double, members * batch_rows> rows_{};
};

/// Steps with the allocator armed.
template <class Engine>
Seen run(Engine insertion, RandomInput input, int n) {
  Seen seen;
  armed = true;
  for (int i = 0; i < n; ++i) {
    const double depth = input.depth(), velocity = input.velocity(), dt = input.dt();
    const Sample sample = insertion.step(depth, velocity, dt);
    const bool finite = std::isfinite(sample.force) && std::isfinite(sample.force_by_depth) &&
                        std::isfinite(sample.force_by_velocity);
    const bool bad = !std::isfinite(depth) || !std::isfinite(velocity) || !std::isfinite(dt) || !(dt > 0.0);
    seen.add(finite, bad, sample.status, sample.force);
  }
  armed = false;
  return seen;
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

TEST(RealTime, MembersOfABatchAllocateNothingAndStayFinite) {
  expect_sound(run(Member(paper::one(paper::model())), RandomInput(), 200000), "batch");
  expect_sound(run(Member(full_stack()), RandomInput(1e-4), 50000), "batch of four layers");
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
    for (const auto& row : std::span(GuardSettings::table).first(GuardSettings::settings_of_a_depth)) {
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

TEST(RealTime, AllocationCounterDetectsAnAllocation) {
  allocations = 0;
  armed = true;
  delete new int(1);
  armed = false;
  EXPECT_EQ(allocations, 1);
  allocations = 0;
}

}  // namespace
