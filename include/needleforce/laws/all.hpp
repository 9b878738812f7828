// SPDX-License-Identifier: Apache-2.0
// The one list of laws. Add a law's header and its name here; everything else is generated from its table.
#pragma once

#include <variant>

#include "cone.hpp"
#include "cone_cylinder.hpp"
#include "constant_cutting.hpp"
#include "coulomb.hpp"
#include "dragged_tissue.hpp"
#include "exponential.hpp"
#include "fracture.hpp"
#include "karnopp.hpp"
#include "lugre.hpp"
#include "no_cutting.hpp"
#include "no_relaxation.hpp"
#include "nonlinear_foundation.hpp"
#include "polynomial.hpp"
#include "power_law.hpp"
#include "prony.hpp"
#include "puncture_depth.hpp"
#include "puncture_energy.hpp"
#include "puncture_force.hpp"
#include "relaxing_surface.hpp"
#include "stick_slip.hpp"
#include "stribeck_cutting.hpp"
#include "tip_contact.hpp"
#include "yielding_coulomb.hpp"
#include "yielding_tissue.hpp"

namespace needleforce {

template <class Real>
using BasicStiffness =
    std::variant<laws::BasicCone<Real>, laws::BasicConeCylinder<Real>, laws::BasicPowerLaw<Real>,
                 laws::BasicPolynomial<Real>, laws::BasicExponential<Real>, laws::TipContactOf<Real>>;
template <class Real>
using BasicPuncture = std::variant<laws::BasicPunctureDepth<Real>, laws::BasicPunctureForce<Real>,
                                   laws::BasicPunctureEnergy<Real>>;
template <class Real>
using BasicFriction =
    std::variant<laws::BasicCoulomb<Real>, laws::BasicRelaxingSurface<Real>, laws::BasicKarnopp<Real>,
                 laws::BasicLuGre<Real>, laws::BasicDraggedTissue<true, Real>,
                 laws::BasicDraggedTissue<false, Real>,
                 laws::BasicNonlinearFoundation<foundations::Cubic, Real>,
                 laws::BasicNonlinearFoundation<foundations::Hyperbolic, Real>,
                 laws::BasicNonlinearFoundation<foundations::Tanh, Real>, laws::BasicYieldingTissue<Real>,
                 laws::BasicYieldingCoulomb<Real>>;
template <class Real>
using BasicCutting =
    std::variant<laws::BasicConstantCutting<Real>, laws::BasicFracture<Real>, laws::BasicStickSlip<Real>,
                 laws::BasicStribeckCutting<Real>, laws::BasicNoCutting<Real>>;
template <class Real>
using BasicRelaxation =
    std::variant<laws::BasicNoRelaxation<Real>, laws::BasicPronySeries<laws::Dashpots::move, Real>,
                 laws::BasicPronySeries<laws::Dashpots::restore, Real>,
                 laws::BasicPronySeries<laws::Dashpots::lock, Real>>;

using Stiffness = BasicStiffness<double>;
using Puncture = BasicPuncture<double>;
using Friction = BasicFriction<double>;
using Cutting = BasicCutting<double>;
using Relaxation = BasicRelaxation<double>;

namespace detail {

// one struct a family, so that the compiler names the law and what is missing
template <class L>
struct OffersStiffness {
  static_assert(
      StiffnessLaw<L>,
      "a law on the list Stiffness does not have the functions that StiffnessLaw in law.hpp requires");
};
template <class L>
struct OffersPuncture {
  static_assert(
      PunctureLaw<L>,
      "a law on the list Puncture does not have the functions that PunctureLaw in law.hpp requires");
};
template <class L>
struct OffersFriction {
  static_assert(
      FrictionLaw<L>,
      "a law on the list Friction does not have the functions that FrictionLaw in law.hpp requires");
};
template <class L>
struct OffersCutting {
  static_assert(CuttingLaw<L>,
                "a law on the list Cutting does not have the functions that CuttingLaw in law.hpp requires");
};

template <class L>
struct OffersRelaxation {
  static_assert(
      RelaxationLaw<L>,
      "a law on the list Relaxation does not have the functions that RelaxationLaw in law.hpp requires");
};

template <template <class> class Offers, class... L>
consteval bool all_of(const std::variant<L...>*) {
  return (sizeof(Offers<L>) && ...);
}

static_assert(all_of<OffersStiffness>(static_cast<Stiffness*>(nullptr)));
static_assert(all_of<OffersPuncture>(static_cast<Puncture*>(nullptr)));
static_assert(all_of<OffersFriction>(static_cast<Friction*>(nullptr)));
static_assert(all_of<OffersCutting>(static_cast<Cutting*>(nullptr)));
static_assert(all_of<OffersRelaxation>(static_cast<Relaxation*>(nullptr)));

}  // namespace detail

}  // namespace needleforce
