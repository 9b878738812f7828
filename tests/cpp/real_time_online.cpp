// SPDX-License-Identifier: Apache-2.0
// The contract of step() and ahead() for what learns while the needle moves.
#include "needleforce/online/online_identifier.hpp"
#include "real_time.hpp"

namespace {

using namespace real_time;
using online::ForceAhead;
using online::OnlineIdentifier;

static_assert(all_trivially_copyable<OnlineIdentifier, ForceAhead, online::OnlinePrior, online::LayerLearnt>);
static_assert(noexcept(std::declval<OnlineIdentifier&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<const OnlineIdentifier&>().ahead(0.0)));
static_assert(noexcept(std::declval<const OnlineIdentifier&>().layer(0)));
static_assert(noexcept(std::declval<OnlineIdentifier&>().reset()));

TEST(RealTime, ReadingsLearntFromAllocateNothing) {
  OnlineIdentifier learner;
  RandomInput input(2e-5), forces(0.05);
  bool finite = true, ordered = true;
  std::size_t most = 0;
  allocations = 0;
  armed = true;
  for (int i = 0; i < 200000; ++i) {
    const double z = -2e-3 + 4e-6 * (i % 5000), h = std::max(z, 0.0);
    const bool invalid =
        i >= 100000 && i % 3 == 0;  // what no sensor should give, within insertions and whole
    if (invalid)
      learner.step(forces.depth(), input.depth(), input.dt());
    else
      learner.step(h < 5e-3 ? 4e4 * h * h : 0.2 + 40.0 * h, z, 1e-3);
    if (i % 100) continue;
    const ForceAhead ahead = learner.ahead(2e-3);
    for (const auto& each : ahead.at) {
      finite = finite && std::isfinite(each.depth + each.force + each.low + each.high);
      ordered = ordered && each.low <= each.high;
    }
    const auto layer = learner.layer(0);
    finite = finite && std::isfinite(layer.modulus.value + layer.modulus.sd + learner.innovation());
    most = std::max(most, learner.pierced());
  }
  armed = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(finite);
  EXPECT_TRUE(ordered);
  EXPECT_GT(most, 0u);
}

}  // namespace
