# SPDX-License-Identifier: Apache-2.0
"""What a needle's section and length say of its stability. Euler's column; Timoshenko & Gere 1961."""

import math

from ..errors import InputError

# smallest x with the ends' characteristic equation, x = L sqrt(P / (E I))
_ROOTS = {"clamped_free": 0.5 * math.pi, "clamped_pinned": 4.493409457909064}


def buckling_force(needle, ends: str = "clamped_free") -> float:
    """Axial force [N] at which a straight needle without lateral support buckles.

    ``ends``: "clamped_free" (before the tip touches), "clamped_pinned" (the tip held by the tissue, tan x = x).
    """
    if ends not in _ROOTS:
        raise InputError("ends", repr(ends), "not known", next_step=f"Give one of {', '.join(_ROOTS)}.")
    return (_ROOTS[ends] / needle.length) ** 2 * needle.bending_stiffness


def tube_of_equal_stiffness(needle, young_modulus: float) -> float:
    """Inner diameter [m] of a tube of the same outer diameter and E I, made of a stiffer material [Pa]."""
    fourth = needle.outer_diameter**4 - 64.0 * needle.bending_stiffness / (math.pi * young_modulus)
    if fourth < 0.0:
        raise InputError("young_modulus", young_modulus, "too soft for the needle's stiffness even as a solid rod")
    return fourth**0.25


def equivalent_half_angle(tip) -> float:
    """Half angle [rad] of the cone that a tip is, or that stands for it; InputError for a tip that is no cone."""
    if hasattr(tip, "equivalent_cone"):
        return tip.equivalent_cone().half_angle
    raise InputError(
        "tip.shape",
        tip.name,
        "not a cone and without an equivalent one",
        next_step="Give the law's half_angle itself, or use the law tip_contact, which takes every tip.",
    )
