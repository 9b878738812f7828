# SPDX-License-Identifier: Apache-2.0
"""Which laws are applicable to a given needle and tissue, and the reason if one is not."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from .. import core
from ..errors import InputError
from ..mechanics.contact import contact
from ..mechanics.validity import FRICTION_LIMIT, SMALL_SLOPE_ANGLE, THIN_SHARE
from .laws import FAMILIES, laws_of


class Verdict(StrEnum):
    """Applicability of a law to a needle and a tissue."""

    VALID = "valid"
    SCALING = "scaling law only"
    FITTED = "as fitted"
    NOT_APPLICABLE = "not applicable"
    NOT_JUDGED = "not judged"


@dataclass(frozen=True)
class Applicability:
    """A law, its verdict for one needle and tissue, and the reason as a sentence.

    The verdict ``scaling law only`` means that proportions hold and values need a fit; ``as fitted`` that no mechanics
    relates the law to needle or tissue, so that it holds for those to which its parameters were fitted; ``not judged``
    that no tissue is given.
    """

    law: type
    verdict: Verdict
    reason: str


Judgement = tuple[Verdict, str]


@dataclass(frozen=True)
class Case:
    """Needle, tissue and lengths [m] for which the laws are judged; each may be None."""

    needle: Any = None
    tissue: Any = None
    indentation: float | None = None
    depth: float | None = None
    thickness: float | None = None

    @property
    def tip(self) -> Any:
        """The needle's tip, or None."""
        return self.needle.tip if self.needle is not None else None

    @property
    def half_angle(self) -> float | None:
        """Half angle of the tip or of its equivalent cone [rad], or None."""
        return self.tip.equivalent_cone().half_angle if hasattr(self.tip, "equivalent_cone") else None


def applicable_laws(
    needle: core.Needle | None = None, tissue: core.Tissue | None = None, **lengths: float | None
) -> tuple[Applicability, ...]:
    """The applicability of every law to a needle and a tissue, in the order of the core's list.

    ``lengths`` [m] are the ``indentation`` at the puncture, the largest ``depth`` of the tip, and the ``thickness`` of
    the specimen; limits that depend on a length that is not given are not checked. Raises InputError for a length that
    is not above 0.
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
    return Applicability(law, Verdict.VALID if law.name in BY_MECHANICS else Verdict.FITTED, law.validity)


def _needs_cone(case: Case) -> Judgement | None:
    if case.needle is None:
        return Verdict.NOT_APPLICABLE, "It needs a needle with a tip, and none is given."
    if case.tip is None:
        return Verdict.NOT_APPLICABLE, "It needs the tip's half angle, and the needle has no tip."
    if case.half_angle is None:
        return Verdict.NOT_APPLICABLE, f"It needs a cone, and the tip is a {case.tip.name}."
    return None


def _needs_tip(case: Case) -> Judgement | None:
    missing = Verdict.NOT_APPLICABLE, "It needs a needle with a tip, and none is given."
    return None if case.tip is not None else missing


def _needs_tissue(case: Case) -> Judgement | None:
    missing = Verdict.NOT_JUDGED, "It is not judged: it needs a modulus, and no tissue is given."
    return None if case.tissue is not None else missing


def _wider_than_needle(case: Case) -> Judgement | None:
    """The bare cone's contact exceeds the shank beyond h_s = (pi/2) R cot(alpha), Sneddon 1965."""
    saturation = contact(case.tip, contact_radius=case.needle.radius, reduced_modulus=1.0).depth
    if case.indentation is None or case.indentation <= saturation:
        return None
    width = 2e3 / math.pi * case.indentation * math.tan(case.half_angle)
    return Verdict.NOT_APPLICABLE, (
        f"At {1e3 * case.indentation:.3g} mm its contact radius is {width:.3g} mm; beyond {1e3 * saturation:.3g} mm it "
        f"is wider than the needle ({1e3 * case.needle.radius:.3g} mm): use cone_cylinder."
    )


def _slope(case: Case) -> Judgement | None:
    if case.half_angle >= SMALL_SLOPE_ANGLE:
        return None
    strain = 0.2 / math.tan(case.half_angle)
    return Verdict.SCALING, (
        f"The half angle of {math.degrees(case.half_angle):.3g} degrees is below 60: representative strain "
        f"{strain:.2f}, beyond linear theory."
    )


def _steepest(case: Case) -> Judgement | None:
    """Slope of any tip at the edge of the contact at the indentation, or at the shank if no indentation is given."""
    reached = case.needle.radius
    if case.indentation is not None:
        reached = contact(case.tip, depth=case.indentation, reduced_modulus=1.0, shank_radius=reached).contact_radius
    slope = case.tip.slope(min(reached, case.tip.end * (1 - 1e-9)))
    if slope <= 1.0 / math.tan(SMALL_SLOPE_ANGLE):
        return None
    return Verdict.SCALING, (
        f"The tip's slope at the edge of the contact is {slope:.3g}, steeper than a cone of 60 degrees: representative "
        f"strain {0.2 * slope:.2f}, beyond linear theory."
    )


def _thin(case: Case) -> Judgement | None:
    if case.indentation is None or case.thickness is None or case.indentation <= THIN_SHARE * case.thickness:
        return None
    return Verdict.SCALING, (
        f"At {1e3 * case.indentation:.3g} mm the indentation exceeds a tenth of the specimen's "
        f"{1e3 * case.thickness:.3g} mm, and the law is for a half-space."
    )


def _bends(case: Case) -> Judgement | None:
    if case.depth is None or case.depth <= FRICTION_LIMIT:
        return None
    return Verdict.NOT_APPLICABLE, (
        f"At {1e3 * case.depth:.3g} mm the needle is beyond the {1e3 * FRICTION_LIMIT:.3g} mm down to which the source "
        "paper reports friction proportional to the embedded length."
    )


def _needs_needle(case: Case) -> Judgement | None:
    missing = Verdict.NOT_APPLICABLE, "It needs the needle's radius, and no needle is given."
    return None if case.needle is not None else missing


# law -> its rules; the first rule that returns a verdict applies
RULES: dict[str, tuple[Callable, ...]] = {
    "cone": (_needs_cone, _needs_tissue, _wider_than_needle, _slope, _thin),
    "cone_cylinder": (_needs_cone, _needs_tissue, _slope, _thin),
    "tip_contact": (_needs_tip, _needs_tissue, _steepest, _thin),
    "coulomb": (_bends,),
    "relaxing_surface": (_needs_needle, _needs_tissue, _bends),
}
# the laws derived from mechanics of needle and tissue, and those without a force
BY_MECHANICS = {"cone", "cone_cylinder", "tip_contact", "no_cutting", "no_relaxation"}
