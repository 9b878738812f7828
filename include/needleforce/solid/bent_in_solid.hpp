// SPDX-License-Identifier: Apache-2.0
// A needle that bends in a condensed solid: along it the solid, across it a foundation for each layer.
#pragma once

#include <type_traits>

#include "../bending/flexible_insertion.hpp"
#include "condensed_insertion.hpp"

namespace needleforce::solid {

template <std::size_t dimension>
using BentInSolid = bending::FlexibleInsertion<dimension, CondensedInsertion>;

static_assert(std::is_trivially_copyable_v<BentInSolid<1>>);
static_assert(std::is_trivially_copyable_v<BentInSolid<2>>);

}  // namespace needleforce::solid
