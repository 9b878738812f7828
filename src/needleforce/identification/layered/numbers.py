# SPDX-License-Identifier: Apache-2.0
"""The numbers of a layered fit by name."""

import numpy as np

from .search import Solved

OF_A_LAYER = {
    "stiffness_coefficient": "N/m^2",
    "saturation_depth": "m",
    "contact_stiffness": "N/m",
    "puncture_depth": "m",
    "puncture_indentation": "m",
    "friction_per_length": "N/m",
    "tissue_stiffness": "N/m",
    "rupture_length": "m",
    "resting_surface": "m",
}
SHARES = {"relaxation_share_1": "1", "relaxation_share_2": "1"}
SIGNED = {"contact_depth", "top", "puncture_depth", "resting_surface", "speed_exponent"}


def prefix(layer: int) -> str:
    """Nothing for the first layer, layer_2_ for the second."""
    return f"layer_{layer + 1}_" if layer else ""


def units(layers: int, speed: bool = False) -> dict[str, str]:
    """Every name with its SI unit, in the order of ``values``."""
    found = {}
    for layer in range(layers):
        found[f"{prefix(layer)}{'top' if layer else 'contact_depth'}"] = "m"
        found |= {prefix(layer) + name: unit for name, unit in OF_A_LAYER.items()}
    return found | SHARES | ({"speed_exponent": "1"} if speed else {})


def values(solved: Solved, x: np.ndarray, but: int | None = None) -> np.ndarray:
    """The named numbers (p,) of x at the mean punctures, those of the run ``but`` left out; deeper tops below the
    surface, other depths in the recording's zero."""
    unknowns = solved.problem.unknowns
    punctures = unknowns.punctures(x) if but is None else np.delete(unknowns.punctures(x), but, axis=0)
    rows = unknowns.rows(x[None], punctures.mean(axis=0)[None])[0]
    surface, found = rows[0, 2], []
    for c, saturation, top, puncture, grip, stiffness, rupture, resting in rows[:, :8]:
        place = top - surface if found else top
        slope = 2.0 * c * min(saturation, puncture - top)
        found += [place, c, saturation, slope, puncture, puncture - top, grip, stiffness, rupture, resting]
    exponent = [] if unknowns.speed in unknowns.held else [x[unknowns.speed]]
    return np.array([*found, rows[0, 8], rows[0, 10], *exponent])


def positive(names) -> np.ndarray:
    """True (p,) for the names of numbers that cannot be negative."""
    return np.array([not any(name.endswith(word) for word in SIGNED) for name in names])


def by_unknowns(solved: Solved) -> np.ndarray:
    """Derivatives (p, size) of the named numbers by x."""
    columns, step = [], 1e-5
    for k in range(solved.problem.unknowns.size):
        move = np.zeros(solved.problem.unknowns.size)
        move[k] = step
        up, down = (values(solved, solved.x + sign * move) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * step))
    return np.array(columns).T
