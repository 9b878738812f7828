# SPDX-License-Identifier: Apache-2.0
"""The schema of preset files, generated from the parameter tables of the core. Unknown keys are refused."""

from typing import Any, Union

import msgspec

from .. import core
from .units_in_keys import keys

FAMILIES = ("stiffness", "puncture", "friction", "cutting")
OPTIONAL = float | None


def laws_of(family: str) -> list[type]:
    """The law classes of one family, in the order of the core's list."""
    return [law for law in vars(core.laws).values() if getattr(law, "family", None) == family]


def _section(name: str, table: list[dict], extra: tuple = (), **options) -> type:
    fields = [(key, OPTIONAL, None) for row in table for key in keys(row["name"], row["unit"])]
    return msgspec.defstruct(name, [*fields, *extra], kw_only=True, forbid_unknown_fields=True, **options)


def _family(family: str) -> Any:
    sections = [_section(law.__name__, law.table(), tag_field="law", tag=law.name) for law in laws_of(family)]
    return Union[tuple(sections)]  # noqa: UP007 - built at run time


TipSection = _section("TipSection", core.tips.Cone.table(), tag_field="shape", tag=core.tips.Cone.name)
NeedleSection = _section("NeedleSection", core.Needle.table(), (("tip", TipSection | None, None),))
TissueSection = _section("TissueSection", core.Tissue.table())


class FoundationSection(msgspec.Struct, forbid_unknown_fields=True):
    """Friction per length from a friction coefficient, in place of a measured one."""

    friction_coefficient: float
    reading: str = "A"
    embedment_factor: float = 1.0


PresetFile = msgspec.defstruct(
    "PresetFile",
    [
        ("name", str),
        ("summary", str),
        ("reference", str),
        *((family, _family(family)) for family in FAMILIES),
        ("doubts", tuple[str, ...], ()),
        ("needle", NeedleSection | None, None),
        ("tissue", TissueSection | None, None),
        ("foundation", FoundationSection | None, None),
    ],
    kw_only=True,
    forbid_unknown_fields=True,
)
