# SPDX-License-Identifier: Apache-2.0
"""The laws of the core, by the part of the force they give."""

from .. import core

FAMILIES = ("stiffness", "puncture", "friction", "cutting", "relaxation")


def laws_of(family: str) -> list[type]:
    """The law classes of one family, in the order of the core's list."""
    return [law for law in vars(core.laws).values() if getattr(law, "family", None) == family]


def law_called(family: str, name: str) -> type:
    """The law class of a family by the law's name, as ``cone_cylinder``."""
    return next(law for law in laws_of(family) if law.name == name)
