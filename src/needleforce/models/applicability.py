# SPDX-License-Identifier: Apache-2.0
"""Which laws hold for a given needle and tissue, and why not."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ..mechanics.contact import contact
from ..mechanics.validity import FRICTION_LIMIT, SMALL_SLOPE_ANGLE, THIN_SHARE
from .laws import FAMILIES, laws_of

VALID, SCALING, FITTED, NOT = "valid", "scaling law only", "as fitted", "not applicable"
UNJUDGED = "not judged"
VERDICTS = (VALID, SCALING, FITTED, NOT, UNJUDGED)


@dataclass(frozen=True)
class Applicability:
    """A law, what is said of it for one needle and tissue, and the reason in words.

    ``verdict`` is ``valid``; ``scaling law only``: proportions hold, values need a fit; ``as fitted``: no mechanics
    ties the law to needle or tissue, so it holds for those its numbers were fitted to; ``not applicable``; or ``not
    judged`` for want of a tissue.
    """

    law: type
    verdict: str
    reason: str


@dataclass(frozen=True)
class Case:
    """The case the laws are held against: needle and tissue or None; lengths [m] or None."""

    needle: Any = None
    tissue: Any = None
    indentation: float | None = None
    depth: float | None = None
    thickness: float | None = None

    @property
    def tip(self):
        """The needle's tip, or None."""
        return self.needle.tip if self.needle is not None else None

    @property
    def half_angle(self) -> float | None:
        """Of a tip that is a cone or has one that stands for it [rad], else None."""
        return self.tip.equivalent_cone().half_angle if hasattr(self.tip, "equivalent_cone") else None


def applicable_laws(needle=None, tissue=None, **lengths: float | None) -> tuple[Applicability, ...]:
    """Every law with what is said of it for a needle and a tissue, in the order of the core's list.

    ``lengths`` [m]: ``indentation`` at the puncture, ``depth`` the tip goes to, ``thickness`` of the specimen; what is
    not given is not judged. Raises InputError for a length that is not above 0.
    """
    for name, length in lengths.items():
        if length is not None and not 0.0 < length < math.inf:
            raise InputError(name, f"{length} m", "must be above 0 m")
    case = Case(needle, tissue, **lengths)
    return tuple(_judged(law, case) for family in FAMILIES for law in laws_of(family))


def _judged(law: type, case: Case) -> Applicability:
    for rule in RULES.get(law.name, ()):
        found = rule(case)
        if found:
            return Applicability(law, *found)
    return Applicability(law, VALID if law.name in BY_MECHANICS else FITTED, law.validity)


def _needs_cone(case: Case):
    if case.needle is None:
        return NOT, "It needs a needle with a tip, and none is given."
    if case.tip is None:
        return NOT, "It needs the tip's half angle, and the needle has no tip."
    if case.half_angle is None:
        return NOT, f"It needs a cone, and the tip is a {case.tip.name}."
    return None


def _needs_tip(case: Case):
    return None if case.tip is not None else (NOT, "It needs a needle with a tip, and none is given.")


def _needs_tissue(case: Case):
    return (
        None
        if case.tissue is not None
        else (UNJUDGED, "It is not judged, as no tissue is given to take a modulus from.")
    )


def _wider_than_needle(case: Case):
    """The bare cone's contact grows past the shank at h_s = (pi/2) R cot(alpha), Sneddon 1965."""
    saturation = contact(case.tip, contact_radius=case.needle.radius, reduced_modulus=1.0).depth
    if case.indentation is None or case.indentation <= saturation:
        return None
    width = 2e3 / math.pi * case.indentation * math.tan(case.half_angle)
    return NOT, (
        f"At {1e3 * case.indentation:.3g} mm its contact radius is {width:.3g} mm, wider than the needle "
        f"({1e3 * case.needle.radius:.3g} mm) from {1e3 * saturation:.3g} mm on: take cone_cylinder."
    )


def _slope(case: Case):
    if case.half_angle >= SMALL_SLOPE_ANGLE:
        return None
    strain = 0.2 / math.tan(case.half_angle)
    return SCALING, (
        f"The half angle of {math.degrees(case.half_angle):.3g} degrees is below 60: representative strain "
        f"{strain:.2f}, beyond linear theory."
    )


def _steepest(case: Case):
    """Of any tip, at the edge of the contact: with the indentation, else at the shank."""
    reached = case.needle.radius
    if case.indentation is not None:
        reached = contact(case.tip, depth=case.indentation, reduced_modulus=1.0, shank_radius=reached).contact_radius
    slope = case.tip.slope(min(reached, case.tip.end * (1 - 1e-9)))
    if slope <= 1.0 / math.tan(SMALL_SLOPE_ANGLE):
        return None
    return SCALING, (
        f"The tip's slope at the edge of the contact is {slope:.3g}, steeper than a cone of 60 degrees: representative "
        f"strain {0.2 * slope:.2f}, beyond linear theory."
    )


def _thin(case: Case):
    if case.indentation is None or case.thickness is None or case.indentation <= THIN_SHARE * case.thickness:
        return None
    return SCALING, (
        f"At {1e3 * case.indentation:.3g} mm the indentation exceeds a tenth of the specimen's "
        f"{1e3 * case.thickness:.3g} mm, and the law is for a half-space."
    )


def _bends(case: Case):
    if case.depth is None or case.depth <= FRICTION_LIMIT:
        return None
    return NOT, (
        f"At {1e3 * case.depth:.3g} mm the needle is beyond the {1e3 * FRICTION_LIMIT:.3g} mm to which the source "
        "paper sees friction in proportion to the embedded length."
    )


def _needs_needle(case: Case):
    return None if case.needle is not None else (NOT, "It needs the needle's radius, and no needle is given.")


# law -> its rules, the first that has something to say wins
RULES: dict[str, tuple[Callable, ...]] = {
    "cone": (_needs_cone, _needs_tissue, _wider_than_needle, _slope, _thin),
    "cone_cylinder": (_needs_cone, _needs_tissue, _slope, _thin),
    "tip_contact": (_needs_tip, _needs_tissue, _steepest, _thin),
    "coulomb": (_bends,),
    "relaxing_surface": (_needs_needle, _needs_tissue, _bends),
}
# the laws that rest on mechanics of needle and tissue, or on nothing at all
BY_MECHANICS = {"cone", "cone_cylinder", "tip_contact", "no_cutting", "no_relaxation"}
