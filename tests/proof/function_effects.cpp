// SPDX-License-Identifier: Apache-2.0
// What is called in the loop, declared nonblocking: the compiler follows every call and fails on one that may
// allocate, lock, throw or call what it cannot see. Functions of the mathematics library it knows by name.
#include "../../bindings/c/needleforce.cpp"
#include "needleforce/flight_recorder.hpp"
#include "needleforce/guard.hpp"

namespace {

using needleforce::Insertion;
using needleforce::Sample;

[[maybe_unused]] Sample step(Insertion& insertion, double depth, double velocity, double dt) noexcept
    [[clang::nonblocking]] {
  return insertion.step(depth, velocity, dt);
}
[[maybe_unused]] void reset(Insertion& insertion) noexcept [[clang::nonblocking]] { insertion.reset(); }
[[maybe_unused]] Insertion snapshot(const Insertion& insertion) noexcept [[clang::nonblocking]] {
  return insertion.snapshot();
}
[[maybe_unused]] Insertion::Saved save(const Insertion& insertion) noexcept [[clang::nonblocking]] {
  return insertion.save();
}
[[maybe_unused]] bool restore(Insertion& insertion, const Insertion::Saved& saved) noexcept
    [[clang::nonblocking]] {
  return insertion.restore(saved);
}

[[maybe_unused]] void c_face(nf_insertion* insertion, nf_sample* sample, void* bytes, size_t size) noexcept
    [[clang::nonblocking]] {
  nf_step(insertion, 0.0, 0.0, 1e-3, sample);
  nf_reset(insertion);
  nf_snapshot(insertion, bytes, size);
  nf_restore(insertion, bytes, size);
}

[[maybe_unused]] void guarded(needleforce::Guard<Insertion>& guard,
                              needleforce::FlightRecorder<64>& recorder) noexcept [[clang::nonblocking]] {
  recorder.write(0.0, 0.0, 1e-3, guard.step(0.0, 0.0, 1e-3));
  guard.miss(1e-3);
  guard.reset();
}

}  // namespace
