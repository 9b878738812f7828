// SPDX-License-Identifier: Apache-2.0
// The contract of step() for a needle that bends, and for a condensed solid.
#include <memory>

#include "bending.hpp"
#include "needleforce/base_guard.hpp"
#include "needleforce/bending/tip_estimator.hpp"
#include "needleforce/solid/bent_in_solid.hpp"
#include "real_time.hpp"
#include "solid.hpp"

namespace {

using namespace real_time;

static_assert(all_trivially_copyable<bending::SpatialInsertion, bending::FlexibleState<2>,
                                     bending::SpatialInsertion::Saved, bending::BentSample>);
static_assert(all_plain<bending::PlanarInsertion::Saved, bending::SpatialInsertion::Saved>);
static_assert(noexcept(std::declval<const bending::SpatialInsertion&>().save()));
static_assert(noexcept(std::declval<bending::SpatialInsertion&>().restore(
    std::declval<const bending::SpatialInsertion::Saved&>())));
static_assert(all_trivially_copyable<solid::CondensedInsertion, solid::CondensedState, solid::CondensedTissue,
                                     solid::CondensedInsertion::Saved>);
static_assert(noexcept(std::declval<solid::CondensedInsertion&>().step(0.0, 0.0, 0.0)));

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
    seen.add(std::isfinite(sum), bad, sample.status, sample.force);
  }
  armed = false;
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

TEST(RealTime, GuardOfANeedleThatBendsAllocatesNothingAndKeepsItsLimits) {
  static FlightRecorder<256, BaseCycle> recorder;
  const GuardSettings settings{.max_force = 0.25,
                               .max_slew = 500.0,
                               .stale_after = 2e-3,
                               .fall_time = 10e-3,
                               .longest_cycle = 2e-3,
                               .max_speed = 0.5,
                               .delay = 2.0,
                               .position_error = 1e-6,
                               .max_lateral_force = 0.1,
                               .max_moment = 1e-3,
                               .max_angular_speed = 2.0,
                               .angle_error = 1e-5};
  Guard guard(bending::SpatialInsertion(with_bevel(), bevelled(FoundationForm::linear)), settings);
  RandomInput input(2e-5), aside(1e-6);
  double force = 0.0, lateral = 0.0, moment = 0.0;
  bool finite = true;
  armed = true;
  for (int i = 0; i < 50000; ++i) {
    const bending::Base base{.depth = input.depth(), .lateral = {0.1 * aside.depth(), 0.0}, .roll = 1e-3 * i};
    const double dt = input.dt();
    const BaseOutput output = i % 17 == 0 ? guard.miss(dt) : guard.step(base, dt);
    recorder.write(base, dt, output);
    const BaseForce& f = output.force;
    force = std::fmax(force, std::abs(f.depth));
    lateral = std::fmax(lateral, std::hypot(f.lateral[0], f.lateral[1]));
    moment = std::fmax(moment, std::hypot(f.tilt[0], f.tilt[1], f.roll));
    finite = finite && std::isfinite(f.depth + f.lateral[0] + f.lateral[1] + f.tilt[0] + f.tilt[1] + f.roll +
                                     output.energy + output.reserve);
  }
  armed = false;
  EXPECT_TRUE(finite);
  EXPECT_TRUE(force > 0.0 && force <= 0.25);
  EXPECT_TRUE(lateral > 0.0 && lateral <= 0.1 * (1.0 + 1e-12));
  EXPECT_TRUE(moment > 0.0 && moment <= 1e-3 * (1.0 + 1e-12));
  EXPECT_EQ(allocations, 0);
  allocations = 0;
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
    const bool bad = !std::isfinite(depth + velocity + dt) || !(dt > 0.0);
    seen.add(std::isfinite(sum + insertion.displacement(3)), bad, sample.status, sample.force);
  }
  armed = false;
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

}  // namespace
