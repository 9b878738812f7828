# SPDX-License-Identifier: Apache-2.0
"""The schema of preset files, generated from the parameter tables of the core: each key contains its unit, and unknown
keys are refused."""

import math
from fractions import Fraction
from typing import Any, Literal, Union

import msgspec

from .. import core
from ..models.laws import FAMILIES, laws_of

# SI unit of a parameter table -> ending of a key -> factor to SI
ENDINGS = {
    "m": {"m": "1", "mm": "1/1000", "um": "1/1000000"},
    "Pa": {"Pa": "1", "kPa": "1000", "MPa": "1000000", "GPa": "1000000000"},
    "N": {"N": "1", "mN": "1/1000"},
    "N/m": {"N_per_m": "1", "N_per_mm": "1000"},
    "rad": {"rad": "1", "deg": "pi/180"},
    "J": {"J": "1", "mJ": "1/1000"},
    "1/m": {"per_m": "1", "per_mm": "1000"},
    "N/m^2": {"N_per_m2": "1", "N_per_mm2": "1000000"},
    "s": {"s": "1", "ms": "1/1000"},
    "m/s": {"m_per_s": "1", "mm_per_s": "1/1000"},
    "N s/m": {"N_s_per_m": "1", "N_s_per_mm": "1000"},
    "N s/m^2": {"N_s_per_m2": "1", "N_s_per_mm2": "1000000"},
    "J/m^2": {"J_per_m2": "1", "kJ_per_m2": "1000"},
    "kg": {"kg": "1", "g": "1/1000"},
}
OPTIONAL_FAMILIES = {"relaxation"}  # without it the tissue does not relax
OPTIONAL = float | None
COLUMN = tuple[float, ...] | None
EQUIVALENCES = tuple(core.tips.equivalences)
# entries of a section that are not numbers
PARTS = {"equivalence": Literal[EQUIVALENCES] | None}
TOP = [{"name": "top", "unit": "m"}]


def keys(name: str, unit: str) -> dict[str, str]:
    """Every key that a parameter may have, with its factor to SI."""
    if unit == "1":
        return {name: "1"}
    return {f"{name}_{ending}": factor for ending, factor in ENDINGS[unit].items()}


def to_si(value: Any, factor: str) -> Any:
    """A number, or each of a tuple, in SI, converted as a decimal: 3.237 mm is 3.237e-3 m to the last bit, which
    3.237 * 1e-3 is not."""
    if isinstance(value, tuple):
        return tuple(to_si(each, factor) for each in value)
    if factor == "pi/180":
        return math.radians(value)
    try:
        return float(Fraction(repr(value)) * Fraction(factor)) if math.isfinite(value) else value
    except OverflowError:  # beyond any limit of a parameter, as which it is refused
        return math.copysign(math.inf, value)


def si_key(name: str, unit: str) -> str:
    """The key in the SI unit, used for writing."""
    return next(iter(keys(name, unit)))


def tips() -> list[type]:
    """The tip classes, in the order of the core's list."""
    return [tip for tip in vars(core.tips).values() if isinstance(tip, type)]


def _numbers(table: list[dict], kind: Any = OPTIONAL) -> list[tuple]:
    return [(key, kind, None) for row in table for key in keys(row["name"], row["unit"])]


def _struct(name: str, fields: list[tuple], **options: Any) -> type:
    return msgspec.defstruct(name, fields, kw_only=True, forbid_unknown_fields=True, **options)


def _section(name: str, owner: Any, **options: Any) -> type:
    numbers = _numbers(owner.table(), COLUMN if hasattr(owner, "columns") else OPTIONAL)
    return _struct(name, [*numbers, *((part, PARTS[part], None) for part in owner.parts)], **options)


TipSection = Union[tuple(_section(tip.__name__, tip, tag_field="shape", tag=tip.name) for tip in tips())]  # noqa: UP007
PARTS["tip"] = TipSection | None


def _family(family: str) -> Any:
    sections = [_section(law.__name__, law, tag_field="law", tag=law.name) for law in laws_of(family)]
    return Union[tuple(sections)]  # noqa: UP007 - built at run time


NeedleSection = _section("NeedleSection", core.Needle)
TissueSection = _section("TissueSection", core.Tissue)


class FoundationSection(msgspec.Struct, forbid_unknown_fields=True):
    """Friction per length from a friction coefficient, instead of a measured value."""

    friction_coefficient: float
    reading: str = "A"
    embedment_factor: float = 1.0


_LAWS = [(family, _family(family)) for family in FAMILIES if family not in OPTIONAL_FAMILIES]
_OPTIONAL_LAWS = [(family, _family(family) | None, None) for family in FAMILIES if family in OPTIONAL_FAMILIES]
LayerSection = _struct("LayerSection", [*_numbers(TOP), *_LAWS, *_OPTIONAL_LAWS])
PresetFile = _struct(
    "PresetFile",
    [
        ("name", str),
        ("summary", str),
        ("reference", str),
        *_LAWS,
        *_OPTIONAL_LAWS,
        ("layers", tuple[LayerSection, ...], ()),
        ("doubts", tuple[str, ...], ()),
        ("unverified", tuple[str, ...], ()),
        ("needle", NeedleSection | None, None),
        ("tissue", TissueSection | None, None),
        ("foundation", FoundationSection | None, None),
    ],
)
