# SPDX-License-Identifier: Apache-2.0
"""A cantilever bent beyond small deflections: the exact curve of an inextensible rod."""

import math

from ..errors import InputError


def tip_deflection(force: float, position: float, length: float, stiffness: float) -> float:
    """Deflection [m] of a clamped rod's tip under a force [N] that stays across the undeformed rod.

    ``position`` [m] of the force from the clamp along the rod, up to ``length`` [m]; ``stiffness`` EI [N m^2]. Between
    clamp and force EI theta'' = -F cos(theta); beyond it the rod is straight. Solved with elliptic integrals
    (Bisshopp and Drucker 1945, from memory). For small deflections F a^2 (3 L - a) / (6 EI).
    """
    _check(force, position, length, stiffness)
    from scipy.special import ellipe, ellipeinc

    load = position * math.sqrt(force / stiffness)
    modulus = _modulus(load)
    start = math.asin(1.0 / (math.sqrt(2.0) * modulus))
    turned = math.asin(min(1.0, 2.0 * modulus**2 - 1.0))  # slope at the force
    sag = 1.0 - 2.0 * (ellipe(modulus**2) - ellipeinc(start, modulus**2)) / load
    return float(position * sag + (length - position) * math.sin(turned))


def _modulus(load: float) -> float:
    """The modulus k of the elliptic integrals with K(k) - F(phi, k) = ``load``, sin(phi) = 1 / (k sqrt 2)."""
    from scipy.optimize import brentq
    from scipy.special import ellipk, ellipkinc

    def missing(k: float) -> float:
        return ellipk(k * k) - ellipkinc(math.asin(min(1.0, 1.0 / (math.sqrt(2.0) * k))), k * k) - load

    return brentq(missing, math.sqrt(0.5), 1.0 - 1e-15, xtol=1e-15, rtol=1e-14)


def _check(force: float, position: float, length: float, stiffness: float) -> None:
    for quantity, value in (("force", force), ("position", position), ("stiffness", stiffness)):
        if not (math.isfinite(value) and value > 0.0):
            raise InputError(f"bending.{quantity}", value, "must be above 0")
    if not position <= length < math.inf:
        raise InputError("bending.position", position, f"must be on the needle, which is {length} m long")
