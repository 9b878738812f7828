# SPDX-License-Identifier: Apache-2.0
"""The tissue along the shaft as a Winkler foundation, and what it says of friction: paper eqs. (7)-(11)."""

import math

from .. import core
from ..errors import InputError

READINGS = ("A", "B", "C", "lame", "literal_mm")


def foundation_modulus(
    needle, tissue, *, width: float | None = None, formula: str = "vesic", embedment_factor: float = 1.0
):
    """Foundation modulus K [Pa]: force per length over deflection of a beam of ``width`` [m] on ``tissue``.

    ``formula`` "vesic" (Vesic 1961, the paper's eq. (9); width pi D by default, as the paper takes it) or "biot" (Biot
    1937; ``width`` is the full width, D by default; its constants are unconfirmed). The subgrade reaction is K / width
    [Pa/m].
    """
    if formula == "vesic":
        return core.vesic_modulus(needle, tissue, width or math.pi * needle.outer_diameter, embedment_factor)
    if formula == "biot":
        return embedment_factor * core.biot_modulus(needle, tissue, 0.5 * (width or needle.outer_diameter))
    raise InputError("formula", repr(formula), "not known", next_step="Give 'vesic' or 'biot'.")


def friction_per_length(
    needle, tissue, coefficient: float, *, reading: str = "A", embedment_factor: float = 1.0
) -> float:
    """Friction per embedded length f' [N/m] for a friction coefficient, under one reading of eqs. (7)-(11).

    The printed equations lack a 1/b: "A" divides by the paper's own b = pi D, "B" by the projected width D, "C" takes
    b = D everywhere, "lame" is the exact linear hole opened by its radius, "literal_mm" the printed formula in N, mm,
    MPa, which changes with the units and is offered for comparison only.
    """
    return coefficient * core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)


def friction_coefficient(
    per_length: float, needle, tissue, *, reading: str = "A", embedment_factor: float = 1.0
) -> float:
    """The friction coefficient [1] that a measured friction per length [N/m] implies under one reading."""
    return per_length / core.friction_per_length(_reading(reading), needle, tissue, embedment_factor)


def _reading(name: str):
    if name not in READINGS:
        raise InputError("friction reading", repr(name), "not known", next_step=f"Give one of {', '.join(READINGS)}.")
    return getattr(core.FrictionReading, name)
