# SPDX-License-Identifier: Apache-2.0
"""Stability of a needle from its section and length: Euler's column."""

import math
from typing import Any

from .. import core
from ..checks import above_zero, one_of
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
    one_of("ends", ends, _ROOTS)
    return (_ROOTS[ends] / needle.length) ** 2 * needle.bending_stiffness


def equivalent_half_angle(tip: Any) -> float:
    """Half angle [rad] of a cone, or of the cone equivalent to a bevel; InputError for a tip without such a cone."""
    if hasattr(tip, "equivalent_cone"):
        return tip.equivalent_cone().half_angle
    step = "Give the law's half_angle, or use the law tip_contact, which accepts every tip."
    raise InputError("tip.shape", tip.name, "neither a cone nor a tip with an equivalent cone", next_step=step)


def foundation_buckling_force(stiffness: float, modulus: float, *, free_end: bool) -> float:
    """Axial force at which a long straight needle in tissue buckles, held laterally by the tissue alone.

    Parameters
    ----------
    stiffness : float
        Bending stiffness E I [N m^2].
    modulus : float
        Foundation modulus K [Pa].
    free_end : bool
        Whether the force acts at an end that is free to move; otherwise far from both ends.

    Returns
    -------
    float
        sqrt(K E I) at a free end, 2 sqrt(K E I) far from the ends [N].

    Notes
    -----
    Hetenyi, Beams on Elastic Foundation; the force keeps its direction, the foundation is linear.
    """
    return (1.0 if free_end else 2.0) * math.sqrt(modulus * stiffness)


def embedded_buckling_force(stiffness: float, modulus: float, free_length: float, embedded: float) -> float:
    """Axial force at which a needle buckles that is clamped above the tissue and embedded with its free tip.

    Parameters
    ----------
    stiffness : float
        Bending stiffness E I [N m^2], above 0.
    modulus : float
        Foundation modulus K of the tissue [Pa], above 0.
    free_length, embedded : float
        Length between clamp and surface, and length in the tissue [m], above 0.

    Returns
    -------
    float
        Smallest critical force [N]; the force acts on the tip and keeps its direction.

    Raises
    ------
    InputError
        If a value is not above 0.

    Notes
    -----
    E I y'''' + N y'' + K y = 0 with K = 0 above the surface, y = y' = 0 at the clamp, y'' = 0 and
    E I y''' + N y' = 0 at the tip: the smallest root of the determinant of the last two by the first two.
    """
    given = {"stiffness": stiffness, "modulus": modulus, "free_length": free_length, "embedded": embedded}
    for quantity, value in given.items():
        above_zero(quantity, value, next_step="Check its unit.")
    from scipy.optimize import brentq

    beta = (0.25 * modulus / stiffness) ** 0.25
    # beyond this length the tip no longer feels the clamp, and the solution would lose digits
    column = (beta * free_length, min(beta * embedded, 14.0))
    step = 0.02 / (1.0 + sum(column))
    low, start = step, _stability(step, *column)
    while True:
        high = low + step
        end = _stability(high, *column)
        if end * start <= 0.0:
            root = brentq(_stability, low, high, args=column, xtol=1e-14, rtol=1e-14)
            return root**2 * stiffness * beta**2
        low = high


def _stability(wavenumber: float, free: float, embedded: float) -> float:
    """Determinant of the conditions at the tip, over the two free constants at the clamp; lengths and the axial
    wavenumber sqrt(N / E I) in units of beta."""
    import numpy as np
    from scipy.linalg import expm

    axial = wavenumber**2
    slope = lambda load: np.array([[0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [-load, 0, -axial, 0]], float)  # noqa: E731
    at_tip = expm(embedded * slope(4.0)) @ expm(free * slope(0.0))
    moment, shear = at_tip[2, 2:], at_tip[3, 2:] + axial * at_tip[1, 2:]
    return float(moment[0] * shear[1] - moment[1] * shear[0])
