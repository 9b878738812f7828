// SPDX-License-Identifier: Apache-2.0
// The array loops behind Laws.sliding_force, compiled apart from the classes.
#pragma once

#include <cstddef>

#include "needleforce/model.hpp"

namespace needleforce::python {

/// `sliding_force` as wide as the machine allows, on two threads where that is worthwhile.
void sliding_force_long(const Model& model, const double* depth, const double* velocity, double* force,
                        std::size_t n);

}  // namespace needleforce::python
