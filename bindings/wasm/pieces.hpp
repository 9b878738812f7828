// SPDX-License-Identifier: Apache-2.0
// What the pieces of a model, of a solid and of a needle that bends share.
#pragma once

#include <cstddef>

#include "../c/needleforce_solid.h"

#define EXPORT(name) __attribute__((export_name(#name))) name

namespace pieces {

extern nf_layer layers[];  // as far as they were given, like the settings
extern std::size_t count;
extern nf_settings settings;
extern nf_insertion* insertion;  // made by make()
extern nf_solid* solid;          // made by make_solid()
extern nf_sample sample;         // of the last step
extern nf_fault fault;

/// From here on give() fills these parameters, of which the last stays without a name.
void open(nf_parameter* list, std::size_t most);
template <std::size_t most>
void open(nf_parameter (&list)[most]) {
  open(list, most);
}

}  // namespace pieces

/// Bytes that stay, aligned as a double.
extern "C" void* room(std::size_t bytes);
