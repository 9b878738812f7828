# SPDX-License-Identifier: Apache-2.0
"""Stability of a needle from its section and length: Euler's column."""

import math
from typing import Any

from .. import core
from ..errors import InputError

# smallest root x = L sqrt(P / (E I)) of the characteristic equation for each pair of end conditions
_ROOTS = {"clamped_free": 0.5 * math.pi, "clamped_pinned": 4.493409457909064}


def buckling_force(needle: core.Needle, ends: str = "clamped_free") -> float:
    """Axial force at which a straight needle without lateral support buckles.

    Parameters
    ----------
    needle : Needle
        Its length [m] and bending stiffness E I [N m^2] are used.
    ends : str
        End conditions: ``"clamped_free"`` before the tip touches, ``"clamped_pinned"`` with the tip held by the tissue.

    Returns
    -------
    float
        Buckling force [N].

    Raises
    ------
    InputError
        If ``ends`` is not one of the two.

    Notes
    -----
    Euler's column: P = x^2 E I / L^2 with x = pi / 2 (clamped, free) or the first root of tan x = x (clamped, pinned);
    Gere & Timoshenko, Mechanics of Materials ("beam theory" in the bibliography).
    """
    if ends not in _ROOTS:
        raise InputError("ends", repr(ends), "unknown", next_step=f"Give one of {', '.join(_ROOTS)}.")
    return (_ROOTS[ends] / needle.length) ** 2 * needle.bending_stiffness


def tube_of_equal_stiffness(needle: core.Needle, young_modulus: float) -> float:
    """Inner diameter of a tube with the needle's outer diameter and bending stiffness, made of a stiffer material.

    Parameters
    ----------
    needle : Needle
        The needle whose outer diameter and E I are kept.
    young_modulus : float
        Young's modulus of the tube [Pa].

    Returns
    -------
    float
        Inner diameter [m].

    Raises
    ------
    InputError
        If even a solid rod of this material is more compliant than the needle.
    """
    fourth_power = needle.outer_diameter**4 - 64.0 * needle.bending_stiffness / (math.pi * young_modulus)
    if fourth_power < 0.0:
        solid = 64.0 * needle.bending_stiffness / (math.pi * needle.outer_diameter**4)
        limit = f"must be at least {solid:.4g} Pa, the modulus of a solid rod of the same bending stiffness"
        raise InputError("young_modulus", f"{young_modulus:.4g} Pa", limit, next_step="Give a stiffer material.")
    return fourth_power**0.25


def equivalent_half_angle(tip: Any) -> float:
    """Half angle [rad] of a cone, or of the cone equivalent to a bevel; InputError for a tip without such a cone."""
    if hasattr(tip, "equivalent_cone"):
        return tip.equivalent_cone().half_angle
    raise InputError(
        "tip.shape",
        tip.name,
        "neither a cone nor a tip with an equivalent cone",
        next_step="Give the law's half_angle, or use the law tip_contact, which accepts every tip.",
    )
