// SPDX-License-Identifier: Apache-2.0
// The contract of step() for what looks for events.
#include "needleforce/events/event_detector.hpp"
#include "real_time.hpp"

namespace {

using namespace real_time;
using events::Detection;
using events::EventDetector;
using events::EventKind;
using events::StreamStatus;

static_assert(all_trivially_copyable<EventDetector, Detection, events::EventSettings>);
static_assert(noexcept(std::declval<EventDetector&>().step(0.0, 0.0, 0.0)));
static_assert(noexcept(std::declval<EventDetector&>().reset()));
static_assert(sizeof(EventDetector) <= 8192);

TEST(RealTime, MillionReadingsWatchedAllocateNothing) {
  EventDetector watch;
  RandomInput input(2e-5), forces(0.05);
  bool finite = true, probable = true, faults_say_so = true;
  long found = 0;
  allocations = 0;
  armed = true;
  for (int i = 0; i < 1000000; ++i) {
    const double force = forces.depth(), depth = input.depth(), dt = input.dt();
    const Detection event = watch.step(force, depth, dt);
    const bool bad = !std::isfinite(force + depth + dt) || !(dt > 0.0);
    faults_say_so = faults_say_so && (!bad || watch.status() != StreamStatus::ok);
    finite = finite && std::isfinite(event.time + event.depth + event.size + event.delay + watch.noise() +
                                     watch.resistance());
    probable = probable && event.probability >= 0.0 && event.probability <= 1.0;
    found += event.kind != EventKind::none;
  }
  armed = false;
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(finite);
  EXPECT_TRUE(probable);
  EXPECT_TRUE(faults_say_so);
  EXPECT_GT(found, 0);
}

}  // namespace
