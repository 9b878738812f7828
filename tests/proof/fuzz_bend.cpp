// SPDX-License-Identifier: Apache-2.0
// A fuzzer on needles that bend: any settings and any motion of the base. Nothing that is not finite comes
// out, bad input is reported, forces stay within what the settings allow, and the same input gives the same
// bits, also from saved bytes on and through the C face.
#include "bent_trial.hpp"

namespace {

using namespace needleforce;

template <std::size_t dimension>
void run(from_bytes::Bytes& bytes) {
  const Limits limits = from_bytes::limits(bytes);
  const Bevel bevel = from_bytes::bevel(bytes);
  const bending::FlexibleSettings settings = from_bytes::flexible_settings(bytes);
  const std::vector<Layer> layers = from_bytes::axial_layers(bytes);
  const bool valid = !first_fault(layers).reason && needleforce::valid(limits) && !first_invalid(bevel);
  proof::BentTrial<dimension> trial(Insertion(layers, limits, bevel), valid, layers, limits, bevel, settings);
  proof::run<dimension>(trial, bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  from_bytes::Bytes bytes(data, size);
  bytes.below(3) == 0 ? run<1>(bytes) : run<2>(bytes);
  return 0;
}
