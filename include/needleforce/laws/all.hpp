// SPDX-License-Identifier: Apache-2.0
// The one list of laws. Add a law's header and its name here; everything else is generated from its table.
#pragma once

#include <variant>

#include "cone.hpp"
#include "cone_cylinder.hpp"
#include "constant_cutting.hpp"
#include "coulomb.hpp"
#include "puncture_depth.hpp"
#include "puncture_force.hpp"

namespace needleforce {

using Stiffness = std::variant<laws::Cone, laws::ConeCylinder>;
using Puncture = std::variant<laws::PunctureDepth, laws::PunctureForce>;
using Friction = std::variant<laws::Coulomb>;
using Cutting = std::variant<laws::ConstantCutting>;

}  // namespace needleforce
