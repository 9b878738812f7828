# SPDX-License-Identifier: Apache-2.0
"""Limits of validity: those that a model or a fit crosses, in plain words, and which laws are valid for a needle and
a tissue."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from .. import core
from ..checks import above_zero
from ..mechanics.buckling import buckling_force, equivalent_half_angle
from ..mechanics.contact import contact
from .laws import FAMILIES, laws_of

SMALL_SLOPE_ANGLE = math.radians(60.0)
FRICTION_LIMIT = 12e-3  # [m] source paper sec. 2.2: deeper, the needle does not stay straight
MAX_SPACINGS = 2.0  # by which cutting displaces a solid: beyond, the tip moves in jerks (docs/evidence/solids.md)
THIN_SHARE = 0.1  # of a specimen's thickness; at a larger indentation its bottom matters and it is not a half-space
FRICTION_BY_LENGTH = ("coulomb", "relaxing_surface", "karnopp", "lugre")
# the laws derived from mechanics of needle and tissue, and those without a force
BY_MECHANICS = {"cone", "cone_cylinder", "tip_contact", "no_cutting", "no_relaxation"}


def crossed_limits(model: Any) -> tuple[str, ...]:
    """A sentence for each limit that the model's parameters cross."""
    contacts = [check(layer, model) for check in (_slope, _saturation) for layer in model.layers]
    unverified = f"Unverified: {'; '.join(model.unverified)}." if model.unverified else ""
    found = dict.fromkeys((*contacts, _buckling(model), _reach(model), unverified))
    return tuple(sentence for sentence in found if sentence)


def crossed_by_depth(model: Any, deepest: float) -> tuple[str, ...]:
    """A sentence for each limit that ``model`` crosses when the tip reaches ``deepest`` [m]."""
    by_length = any(layer.friction.name in FRICTION_BY_LENGTH for layer in model.layers)
    if not by_length or not deepest > FRICTION_LIMIT:
        return ()
    return (
        f"The tip goes {1e3 * deepest:.3g} mm deep; the source paper reports friction proportional to the embedded "
        f"length down to {1e3 * FRICTION_LIMIT:.3g} mm.",
    )


def contact_warnings(engine: core.CondensedInsertion) -> tuple[str, ...]:
    """A sentence where the contact law presses the surface deeper than the tip is, if the solid bears its force, and
    one where cutting displaces the tissue by more than two spacings."""
    depth, force = engine.puncture
    pressed = force * engine.surface_compliance
    contact = (
        f"The contact law is stiffer than the solid: its force at the puncture, {force:.3g} N, would press the surface "
        f"{1e3 * pressed:.3g} mm down where the tip is {1e3 * depth:.3g} mm deep. Forces are the law's; displacements "
        "before the puncture are too large by as much."
    )
    spacings = engine.displaced_by_cutting / engine.spacing
    soft = (
        f"Cutting displaces the tissue around the tip by {1e3 * engine.displaced_by_cutting:.3g} mm, {spacings:.2g} "
        f"spacings of the path: forces depend on steps and spacing by up to {6 * spacings:.0f} %. Condense with a "
        f"spacing of {500 * engine.displaced_by_cutting:.3g} mm or more."
    )
    return tuple(text for text, holds in ((contact, pressed > depth), (soft, spacings > MAX_SPACINGS)) if holds)


def coupling_warnings(model: Any) -> tuple[str, ...]:
    """A sentence for a tip that is pushed aside where its cutting does not pay for that."""
    found = [] if model else ["there is no model"]
    for number, layer in enumerate(model.layers if model else (), 1):
        if getattr(layer.cutting, "recovered", 0.0) > 0.0:
            found.append(f"{layer.cutting.name} in layer {number} gives work back to a tip that withdraws (recovered)")
        elif layer.cutting.name == "no_cutting":
            found.append(f"layer {number} has no cutting force")
    return (
        f"The tip is pushed aside where its cutting does not pay for that: {'; '.join(found)}. Bending does not "
        "shorten this needle, its force does not feel a base that moves aside, and a hand that moves the needle round "
        "can gain energy. Give every layer a cutting law, without recovered, or limit the hand by control.BaseGuard.",
    )


MAX_TIP_FORCE = 10.0  # over the cutting force, in the core


def tip_force_warnings(model: Any, lateral: Sequence[core.LateralLayer]) -> tuple[str, ...]:
    """A sentence for each ``tip_force`` of which less acts, for its cutting pays for no more."""
    ends = [layer.top for layer in lateral[1:]] + [math.inf]
    axial_ends = [layer.top for layer in model.layers[1:]] + [math.inf]
    return tuple(
        f"A tip_force of {side.tip_force:.3g} N from {1e3 * max(side.top, layer.top):.3g} mm on is more than ten times "
        f"the cutting force there, {layer.cutting.slow_force:.3g} N, which pays for it: "
        f"{MAX_TIP_FORCE * layer.cutting.slow_force:.3g} N act. Give no more, or a larger cutting force."
        for side, end in zip(lateral, ends)
        for layer, axial_end in zip(model.layers, axial_ends)
        if max(side.top, layer.top) < min(end, axial_end)
        and abs(side.tip_force) > MAX_TIP_FORCE * layer.cutting.slow_force
    )


def _slope(layer: Any, model: Any) -> str:
    tip = getattr(layer.stiffness, "tip", None)
    if tip is not None and not hasattr(tip, "equivalent_cone"):
        return _slope_of_profile(layer, tip)
    angle = equivalent_half_angle(tip) if tip is not None else getattr(layer.stiffness, "half_angle", math.pi / 2)
    # without a tip the angle is arbitrary: only its product with the modulus is identified
    has_tip = tip is not None or (model.needle is not None and model.needle.tip is not None)
    if angle >= SMALL_SLOPE_ANGLE or not has_tip:
        return ""
    strain = 0.2 / math.tan(angle)
    return (
        f"The tip's half angle of {math.degrees(angle):.3g} degrees is below 60: representative strain {strain:.2f}, "
        "so linear contact theory is a scaling law here, not a prediction."
    )


def _slope_of_profile(layer: Any, tip: Any) -> str:
    # dF/dh = 2 E_r a; the slope of a tip is largest at the edge of its contact
    contact = 0.5 * layer.stiffness.slope(layer.laws.puncture_depth) / layer.stiffness.reduced_modulus
    slope = tip.slope(min(contact, tip.end * (1 - 1e-9)))
    if slope <= 1 / math.tan(SMALL_SLOPE_ANGLE):
        return ""
    return (
        f"At puncture the tip's slope at the edge of the contact is {slope:.3g}, which is that of a half angle of "
        f"{math.degrees(math.atan2(1, slope)):.3g} degrees, below 60: representative strain {0.2 * slope:.2f}, so "
        "linear contact theory is a scaling law here, not a prediction."
    )


def _saturation(layer: Any, model: Any) -> str:
    radius = model.needle.radius if model.needle is not None else math.inf
    max_radius = min(layer.stiffness.radius, layer.stiffness.tip.end) if layer.stiffness.name == "tip_contact" else 0.0
    if max_radius > radius * (1 + 1e-9):
        return (
            f"The contact stops growing at {1e3 * max_radius:.3g} mm, wider than the needle "
            f"({1e3 * radius:.3g} mm): give the law the needle's radius."
        )
    if layer.stiffness.name != "cone":
        return ""
    contact = 2.0 * layer.laws.puncture_depth * math.tan(layer.stiffness.half_angle) / math.pi
    if contact <= radius:
        return ""
    return (
        f"At puncture the bare cone's contact radius is {1e3 * contact:.3g} mm, wider than the "
        f"needle ({1e3 * radius:.3g} mm): use the law cone_cylinder."
    )


def _buckling(model: Any) -> str:
    if model.needle is None:
        return ""
    critical = buckling_force(model.needle)
    peak = model.stiffness.force(model.puncture_depth)
    if peak <= critical:
        return ""
    return (
        f"The model's force at puncture, {peak:.3g} N, exceeds the buckling load of a clamped needle with a "
        f"free tip, {critical:.3g} N: the needle must be guided."
    )


def _reach(model: Any) -> str:
    for number, layer in enumerate(model.layers, 1):
        reach, puncture = layer.stiffness.reach, layer.laws.puncture_depth
        if puncture > reach:
            return (
                f"Layer {number} punctures at {1e3 * puncture:.3g} mm, beyond the {1e3 * reach:.3g} mm to which the "
                f"law {layer.stiffness.name} holds: its force is continued as a straight line."
            )
    return ""


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
        if length is not None:
            above_zero(name, length, "m")
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


def _half_angle_of_slope(case: Case) -> Judgement | None:
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
    "cone": (_needs_cone, _wider_than_needle, _half_angle_of_slope, _thin, _needs_tissue),
    "cone_cylinder": (_needs_cone, _half_angle_of_slope, _thin, _needs_tissue),
    "tip_contact": (_needs_tip, _steepest, _thin, _needs_tissue),
    "coulomb": (_bends,),
    "relaxing_surface": (_needs_needle, _bends, _needs_tissue),
}
