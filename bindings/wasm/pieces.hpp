// SPDX-License-Identifier: Apache-2.0
// What the pieces of a model and those of a needle that bends share.
#pragma once

#include <cstddef>

#include "../c/needleforce.h"

#define EXPORT(name) __attribute__((export_name(#name))) name

namespace pieces {

extern nf_insertion* insertion;  // made by make()
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
