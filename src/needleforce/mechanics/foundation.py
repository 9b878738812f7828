# SPDX-License-Identifier: Apache-2.0
"""The tissue along the shaft as a Winkler foundation, and the friction that follows from it: source paper eqs.
(7)-(11)."""

import math

from .. import core
from ..errors import InputError

READINGS = ("A", "B", "C", "lame", "literal_mm")


def foundation_modulus(
    needle: core.Needle,
    tissue: core.Tissue,
    *,
    width: float | None = None,
    formula: str = "vesic",
    embedment_factor: float = 1.0,
) -> float:
    """Foundation modulus K: force per length over deflection of a beam on the tissue.

    Parameters
    ----------
    needle : Needle
        The beam; its outer diameter D and bending stiffness are used.
    tissue : Tissue
        Young's modulus [Pa] and Poisson ratio of the foundation.
    width : float, optional
        Full width of the beam [m]. Default: pi D for ``"vesic"``, as in the source paper; D for ``"biot"``.
    formula : str
        ``"vesic"`` (Vesic 1961, the source paper's eq. (9)) or ``"biot"`` (Biot 1937, constants unconfirmed).
    embedment_factor : float
        Factor on K; 2 is resistance on both sides of the beam.

    Returns
    -------
    float
        Foundation modulus [Pa]. The modulus of subgrade reaction is K / width [Pa/m].

    Raises
    ------
    InputError
        If the formula is unknown.
    """
    if formula == "vesic":
        return core.vesic_modulus(needle, tissue, width or math.pi * needle.outer_diameter, embedment_factor)
    if formula == "biot":
        return embedment_factor * core.biot_modulus(needle, tissue, 0.5 * (width or needle.outer_diameter))
    raise InputError("formula", repr(formula), "unknown", next_step="Give 'vesic' or 'biot'.")


def friction_per_length(
    needle: core.Needle,
    tissue: core.Tissue,
    coefficient: float,
    *,
    reading: str = "A",
    embedment_factor: float = 1.0,
) -> float:
    """Friction per embedded length f' for a friction coefficient.

    Parameters
    ----------
    needle : Needle
        Its outer diameter D [m] and bending stiffness are used.
    tissue : Tissue
        Young's modulus [Pa] and Poisson ratio.
    coefficient : float
        Friction coefficient [1].
    reading : str
        How eqs. (7)-(11), which are dimensionally inconsistent as printed, are interpreted: one of ``READINGS``.
    embedment_factor : float
        Factor on the foundation modulus.

    Returns
    -------
    float
        Friction per embedded length [N/m].

    Raises
    ------
    InputError
        If the reading is unknown.

    Notes
    -----
    Source paper eqs. (7)-(11), in which a factor 1/b is missing. ``"A"`` divides by the paper's own width b = pi D,
    ``"B"`` by the projected width D; ``"C"`` uses b = D everywhere; ``"lame"`` is the exact linear solution of a hole
    opened by its own radius; ``"literal_mm"`` evaluates the printed formula in N, mm and MPa: it depends on the units
    and is for comparison only.
    """
    return coefficient * core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)


def friction_coefficient(
    per_length: float,
    needle: core.Needle,
    tissue: core.Tissue,
    *,
    reading: str = "A",
    embedment_factor: float = 1.0,
) -> float:
    """Friction coefficient that a measured friction per length implies: the inverse of ``friction_per_length``.

    Parameters
    ----------
    per_length : float
        Friction per embedded length [N/m].
    needle, tissue, reading, embedment_factor
        As in ``friction_per_length``.

    Returns
    -------
    float
        Friction coefficient [1].

    Raises
    ------
    InputError
        If the reading is unknown.
    """
    return per_length / core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)


def _reading(name: str) -> core.FrictionReading:
    if name not in READINGS:
        raise InputError("friction reading", repr(name), "unknown", next_step=f"Give one of {', '.join(READINGS)}.")
    return getattr(core.FrictionReading, name)
