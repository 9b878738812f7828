# SPDX-License-Identifier: Apache-2.0
"""The needle's Young modulus from cantilever readings: a load along the needle, the deflection of its tip."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from .statistics.regression import least_squares

SMALL_DEFLECTION = 0.3  # F a^2 / (E I), the end slope's double: beyond it the linear formula overstates the deflection


@dataclass(frozen=True, eq=False)
class Bending:
    """E [Pa] with its 95 % interval, hub slack [m], and which readings (n,) were small enough to be used."""

    young_modulus: float
    low: float
    high: float
    slack: float
    used: np.ndarray


def cantilever_deflection(force, position, needle):
    """Tip deflection [m] under ``force`` [N] at ``position`` [m] from the clamp: F a^2 (3 L - a) / (6 E I), small
    slopes."""
    return force * _compliance(position, needle) / needle.young_modulus


def cantilever_modulus(force, position, deflection, needle):
    """Young modulus [Pa] that one reading implies; ``needle.young_modulus`` is not used."""
    return force * _compliance(position, needle) / deflection


def cantilever_sensitivities(position: float, needle) -> dict[str, float]:
    """d ln E / d ln x of one reading, for x = force, deflection, outer_diameter, position, length; solid needle."""
    length = needle.length
    return {
        "force": 1.0,
        "deflection": -1.0,
        "outer_diameter": -4.0,
        "position": 2.0 - position / (3.0 * length - position),
        "length": 3.0 * length / (3.0 * length - position),
    }


def needle_modulus(force, position, deflection, needle) -> Bending:
    """Regresses deflection on the compliance of each reading (n,), with an intercept for slack in the hub.

    Errors are taken in proportion to the deflection. Readings with F a^2 / (E I) > 0.3 leave the small-deflection
    range and are not used; E is found again until the choice stands. Raises InputError with fewer than
    three readings left, or readings that no needle gives. Gere & Timoshenko, Mechanics of Materials.
    """
    force, position, deflection = (np.asarray(column, float) for column in (force, position, deflection))
    _possible(position, deflection, needle)
    load = force * _compliance(position, needle)
    used = position <= np.sort(position)[min(2, len(position) - 1)]
    for _ in range(10):
        softness, half, slack = _softness(load[used], deflection[used])
        small = np.abs(force) * position**2 * softness / needle.second_moment <= SMALL_DEFLECTION
        if (small == used).all():
            break
        used = _enough(small, used)
    low, high = 1.0 / (softness + half), 1.0 / (softness - half) if softness > half else np.inf
    return Bending(1.0 / softness, low, high, slack, used)


def _softness(load: np.ndarray, deflection: np.ndarray) -> tuple[float, float, float]:
    """1/E [1/Pa], half its 95 % interval, and the slack [m]."""
    if len(load) < 3:
        raise InputError("bending readings", len(load), "fewer than 3", next_step="Give more readings.")
    # divided by the load, errors in proportion to the deflection weigh alike
    design, ratio = np.column_stack([np.ones_like(load), 1.0 / load]), deflection / load
    values, covariance, t = least_squares(design, ratio)
    if not values[0] > 0.0:
        raise InputError("tip_deflection", "not growing with the load", "the needle would have no stiffness")
    return float(values[0]), t * float(np.sqrt(covariance[0, 0])), float(values[1])


def _compliance(position, needle):
    """a^2 (3 L - a) / (6 I): deflection times E over force [1/m]."""
    return position**2 * (3.0 * needle.length - position) / (6.0 * needle.second_moment)


def _possible(position: np.ndarray, deflection: np.ndarray, needle) -> None:
    for row, (a, tip) in enumerate(zip(position, deflection), 1):
        if not 0.0 < a <= needle.length:
            limit = f"must be above 0 and at most the needle's length {needle.length:g} m"
            raise InputError("position", f"{a:g} m", limit, f"reading {row}")
        if tip == 0.0:
            raise InputError("tip_deflection", "0 m", "a loaded needle bends", f"reading {row}")


def _enough(small: np.ndarray, used: np.ndarray) -> np.ndarray:
    if small.sum() >= 3:
        return small
    if small.sum() == 0 or used.sum() < 3:
        raise InputError(
            "small deflections",
            f"{small.sum()} readings",
            f"fewer than 3 with F a^2/(E I) below {SMALL_DEFLECTION}",
            next_step="Load the needle nearer to the clamp, or with less force.",
        )
    return used
