# SPDX-License-Identifier: Apache-2.0
"""The schema of preset files, generated from the parameter tables of the core. Unknown keys are refused."""

from typing import Any, Literal, Union

import msgspec

from .. import core
from ..models.laws import FAMILIES, laws_of
from .units_in_keys import keys

OPTIONAL_FAMILIES = {"relaxation"}  # without it the tissue does not relax
OPTIONAL = float | None
COLUMN = tuple[float, ...] | None
EQUIVALENCES = tuple(core.tips.equivalences)


def tips() -> list[type]:
    """The tip classes, in the order of the core's list."""
    return [tip for tip in vars(core.tips).values() if isinstance(tip, type)]


def _numbers(table: list[dict], kind=OPTIONAL) -> list[tuple]:
    return [(key, kind, None) for row in table for key in keys(row["name"], row["unit"])]


def _struct(name: str, fields: list[tuple], **options) -> type:
    return msgspec.defstruct(name, fields, kw_only=True, forbid_unknown_fields=True, **options)


def _section(name: str, owner, **options) -> type:
    numbers = _numbers(owner.table(), COLUMN if hasattr(owner, "columns") else OPTIONAL)
    return _struct(name, [*numbers, *((part, PARTS[part], None) for part in owner.parts)], **options)


# what is no number and stands beside the numbers of a section
PARTS = {"equivalence": Literal[EQUIVALENCES] | None}
TipSection = Union[tuple(_section(tip.__name__, tip, tag_field="shape", tag=tip.name) for tip in tips())]  # noqa: UP007
PARTS["tip"] = TipSection | None


def _family(family: str) -> Any:
    sections = [_section(law.__name__, law, tag_field="law", tag=law.name) for law in laws_of(family)]
    return Union[tuple(sections)]  # noqa: UP007 - built at run time


NeedleSection = _section("NeedleSection", core.Needle)
TissueSection = _section("TissueSection", core.Tissue)


class FoundationSection(msgspec.Struct, forbid_unknown_fields=True):
    """Friction per length from a friction coefficient, in place of a measured one."""

    friction_coefficient: float
    reading: str = "A"
    embedment_factor: float = 1.0


_LAWS = [(family, _family(family)) for family in FAMILIES if family not in OPTIONAL_FAMILIES]
_OPTIONAL_LAWS = [(family, _family(family) | None, None) for family in FAMILIES if family in OPTIONAL_FAMILIES]
TOP = [{"name": "top", "unit": "m"}]
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
