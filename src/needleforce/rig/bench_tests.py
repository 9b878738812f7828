# SPDX-License-Identifier: Apache-2.0
"""The source paper's two bench tests: bending of the needle with large deflections, and tension of the tissue."""

import math
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import core
from ..checks import above_zero
from ..errors import InputError
from ..files import atomic_write
from .specimen import PAPER

NEEDLE_MODULUS, NEEDLE_SPREAD = PAPER["needle_young_modulus"]
TISSUE_MODULUS = PAPER["tissue_young_modulus"][0]
_DIAMETER_M, _LENGTH_M = 0.7e-3, 80e-3  # source paper sec. 1
_POSITIONS_M = (6e-3, 9e-3, 12e-3, 16e-3, 20e-3)  # assumed; F a^2/EI = 0.02 to 0.24: small
_DIAL_NOISE_M = 0.02e-3  # standard deviation of the dial gauge
_STRETCH = np.linspace(1.0, 1.2, 41)
_STRESS_NOISE_PA = 0.1e3


@dataclass(frozen=True, eq=False)
class BendingTest:
    """A force [N] at each position [m] from the clamp, and the deflection of the tip [m]: (n,) each."""

    position: np.ndarray
    force: np.ndarray
    tip_deflection: np.ndarray

    def write(self, folder: str | os.PathLike) -> Path:
        """Write ``needle_bending.csv``."""
        position, deflection = self.position * 1e3, self.tip_deflection * 1e3
        columns = {"position_mm": position, "force_N": self.force, "tip_deflection_mm": deflection}
        return write_table(Path(folder) / "needle_bending.csv", columns)


@dataclass(frozen=True, eq=False)
class TensionTest:
    """Nominal stress [Pa] at each stretch [1] of a uniaxial test: (n,) each."""

    stretch: np.ndarray
    stress: np.ndarray

    def write(self, folder: str | os.PathLike) -> Path:
        """Write ``tissue_tension.csv``."""
        columns = {"stretch": self.stretch, "stress_kPa": self.stress * 1e-3}
        return write_table(Path(folder) / "tissue_tension.csv", columns)


def bend_needle(random: np.random.Generator) -> tuple[BendingTest, np.ndarray]:
    """Five bending tests with 0.1 N, each with a modulus drawn from the paper's scatter, and the moduli (5,) [Pa].

    The deflection is that of the exact rod. Where F a^2/EI is above 0.3 the small-deflection formula gives too large a
    modulus: by 94 % at the tip.
    """
    drawn = NEEDLE_MODULUS + NEEDLE_SPREAD * random.standard_normal(len(_POSITIONS_M))
    second_moment = core.Needle(_DIAMETER_M, 0.0, _LENGTH_M, NEEDLE_MODULUS, 0.3).second_moment
    exact = [tip_deflection(0.1, a, _LENGTH_M, float(e) * second_moment) for a, e in zip(_POSITIONS_M, drawn)]
    read = np.round(np.array(exact) + random.normal(0.0, _DIAL_NOISE_M, len(exact)), 5)  # steps of 0.01 mm
    return BendingTest(np.array(_POSITIONS_M), np.full(len(exact), 0.1), read), drawn


def pull_tissue(random: np.random.Generator) -> TensionTest:
    """Tension of a neo-Hookean strip, P = E/3 (stretch - stretch^-2), up to 20 % strain, with noise on the stress."""
    stress = TISSUE_MODULUS / 3.0 * (_STRETCH - _STRETCH**-2) + random.normal(0.0, _STRESS_NOISE_PA, len(_STRETCH))
    return TensionTest(_STRETCH.copy(), stress)


def tip_deflection(force: float, position: float, length: float, stiffness: float) -> float:
    """Deflection [m] of the tip of a clamped rod, L long [m], of the stiffness EI [N m^2], under a force F [N] at a
    position a from the clamp [m] that remains perpendicular to the undeformed rod.

    Between clamp and force EI theta'' = -F cos(theta); beyond the force the rod is straight. Solved with elliptic
    integrals (Bisshopp and Drucker 1945, from memory). For small deflections: F a^2 (3 L - a) / (6 EI). Raises
    InputError if a value is not above 0, or the force is not on the rod.
    """
    _check(force, position, length, stiffness)
    from scipy.special import ellipe, ellipeinc

    load = position * math.sqrt(force / stiffness)
    modulus = _modulus(load)
    start = math.asin(1.0 / (math.sqrt(2.0) * modulus))
    slope_angle = math.asin(min(1.0, 2.0 * modulus**2 - 1.0))  # at the force
    sag = 1.0 - 2.0 * (ellipe(modulus**2) - ellipeinc(start, modulus**2)) / load
    return float(position * sag + (length - position) * math.sin(slope_angle))


def _modulus(load: float) -> float:
    """The modulus k of the elliptic integrals with K(k) - F(phi, k) = ``load``, sin(phi) = 1 / (k sqrt 2)."""
    from scipy.optimize import brentq
    from scipy.special import ellipk, ellipkinc

    def residual(k: float) -> float:
        return ellipk(k * k) - ellipkinc(math.asin(min(1.0, 1.0 / (math.sqrt(2.0) * k))), k * k) - load

    return brentq(residual, math.sqrt(0.5), 1.0 - 1e-15, xtol=1e-15, rtol=1e-14)


def _check(force: float, position: float, length: float, stiffness: float) -> None:
    for quantity, value in (("force", force), ("position", position), ("stiffness", stiffness)):
        above_zero(f"bending.{quantity}", value)
    if not position <= length < math.inf:
        raise InputError("bending.position", position, f"must be at most the length of the needle, {length} m")


def write_table(path: Path, columns: dict[str, np.ndarray], digits: int = 7) -> Path:
    """Write columns (n,) with their headers as CSV, rounded to significant digits; equal values give equal bytes."""
    rows = [",".join(f"{value:.{digits}g}" for value in row) for row in zip(*columns.values(), strict=True)]
    with atomic_write(path) as file:
        file.write("\n".join([",".join(columns), *rows, ""]))
    return path
