# SPDX-License-Identifier: Apache-2.0
"""The laws of the core by the part of the force they describe, and a law from its parameters; missing parameters are
derived from needle, tissue, foundation or another law."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

from .. import core
from ..errors import InputError
from ..mechanics.buckling import equivalent_half_angle
from ..mechanics.foundation import friction_per_length

FAMILIES = ("stiffness", "puncture", "friction", "cutting", "relaxation")
# parameters of friction may be derived from the stiffness and the cutting law; no other law depends on another
ORDER = ("stiffness", "puncture", "cutting", "friction", "relaxation")


def laws_of(family: str) -> list[type]:
    """The law classes of one family, in the order of the core's list."""
    return [law for law in vars(core.laws).values() if getattr(law, "family", None) == family]


def law_called(family: str, name: str) -> type:
    """The law class of a family by the law's name, as ``cone_cylinder``."""
    return next(law for law in laws_of(family) if law.name == name)


@dataclass(frozen=True)
class Surroundings:
    """What the missing parameters of a law are derived from; each may be None.

    ``tissue`` is called when a law needs it, and may raise InputError. ``foundation`` has ``friction_coefficient``,
    ``reading`` and ``embedment_factor``. ``laws`` are those of the same layer that are already made.
    """

    needle: Any = None
    tissue: Callable[[], Any] | None = None
    foundation: Any = None
    laws: dict[str, Any] = field(default_factory=dict)


def make_laws(chosen: dict[str, tuple[type, dict]], around: Surroundings, place: str = "") -> dict[str, Any]:
    """The laws of one layer from {family: (law class, its parameters in SI)}.

    Raises InputError, with the family as its place, for a parameter that is missing, unknown or outside its range; of
    several that are missing with all of them.
    """
    absent = [
        f"{family}.{row['name']} [{row['unit']}]"
        for family, (law, values) in chosen.items()
        for row in law.table()
        if row["default"] is None and row["name"] not in {*values, *DERIVED}
    ]
    if len(absent) > 1:
        step = f"Give each in its part, such as {absent[0].split('.')[0]}={{...}}; needleforce laws has their meaning."
        raise InputError("values", "missing", f"needed are {', '.join(absent)}", place.removesuffix(", "), step)
    made = {}
    for family in ORDER:
        if family in chosen:
            law, values = chosen[family]
            made[family] = make_law(law, values, replace(around, laws=made), f"{place}{family}")
    return made


def make_law(law: type, values: dict[str, float], around: Surroundings, place: str) -> Any:
    """One law: ``values`` as given, then those derived from ``around``, then the law's defaults."""
    missing = [name for name in [*(row["name"] for row in law.table()), *law.parts] if name not in values]
    try:
        derived = {name: DERIVED[name](around) for name in missing if name in DERIVED}
        known = {name: value for name, value in derived.items() if value is not None}
        return law(**values, **known)
    except InputError as error:
        raise error.at(place) from None


def _reduced_modulus(around: Surroundings) -> float | None:
    if around.needle is None or around.tissue is None:
        return None
    return core.reduced_modulus(around.needle, around.tissue())


def _tip(around: Surroundings) -> Any:
    return around.needle.tip if around.needle is not None else None


def _half_angle(around: Surroundings) -> float | None:
    tip = _tip(around)
    return None if tip is None else equivalent_half_angle(tip)


def _radius(around: Surroundings) -> float | None:
    return around.needle.radius if around.needle is not None else None


def _plane_strain_modulus(around: Surroundings) -> float | None:
    if around.tissue is None:
        return None
    tissue = around.tissue()
    return tissue.young_modulus / (1.0 - tissue.poisson_ratio**2)


def _per_length(around: Surroundings) -> float | None:
    source = around.foundation
    if source is None or around.needle is None or around.tissue is None:
        return None
    more = {"reading": source.reading, "embedment_factor": source.embedment_factor}
    return friction_per_length(around.needle, around.tissue(), source.friction_coefficient, **more)


def _surface_stiffness(around: Surroundings) -> float | None:
    """2 E_r R of a flat punch; the stiffness law's modulus has priority over that of needle and tissue."""
    modulus = getattr(around.laws.get("stiffness"), "reduced_modulus", None) or _reduced_modulus(around)
    radius = _radius(around)
    return None if modulus is None or radius is None else 2.0 * modulus * radius


def _tip_force(around: Surroundings) -> float | None:
    cutting = around.laws.get("cutting")
    return cutting.force if isinstance(cutting, core.laws.ConstantCutting) else None


# parameter -> how it is derived if it is not given; the length of a crack cannot be derived: it is D for a slit and
# larger for a wider crack
DERIVED = {
    "reduced_modulus": _reduced_modulus,
    "half_angle": _half_angle,
    "radius": _radius,
    "tip": _tip,
    "plane_strain_modulus": _plane_strain_modulus,
    "per_length": _per_length,
    "surface_stiffness": _surface_stiffness,
    "tip_force": _tip_force,
}
