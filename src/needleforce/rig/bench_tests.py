# SPDX-License-Identifier: Apache-2.0
"""The paper's two bench tests: bending of the needle, tension of the tissue."""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from .. import core
from .elastica import tip_deflection
from .paper import PAPER
from .table import write_table

NEEDLE_MODULUS, NEEDLE_SPREAD = PAPER["needle_young_modulus"]
TISSUE_MODULUS = PAPER["tissue_young_modulus"][0]
_DIAMETER, _LENGTH = 0.7e-3, 80e-3  # [m] paper, sec. 1
_POSITIONS = (6e-3, 9e-3, 12e-3, 16e-3, 20e-3)  # [m]; the paper gives none. F a^2/EI = 0.02 to 0.24: small
_DIAL = 0.02e-3  # [m] standard deviation of the dial gauge
_STRETCH = np.linspace(1.0, 1.2, 41)
_STRESS_NOISE = 0.1e3  # [Pa]


@dataclass(frozen=True, eq=False)
class Bending:
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
class Tension:
    """Nominal stress [Pa] at each stretch [1] of a uniaxial test: (n,) each."""

    stretch: np.ndarray
    stress: np.ndarray

    def write(self, folder: str | os.PathLike) -> Path:
        """Write ``tissue_tension.csv``."""
        columns = {"stretch": self.stretch, "stress_kPa": self.stress * 1e-3}
        return write_table(Path(folder) / "tissue_tension.csv", columns)


def bend_needle(random: np.random.Generator) -> tuple[Bending, np.ndarray]:
    """Five tests with 0.1 N, each with a modulus of its own, as the paper's scatter has it; and those moduli (5,) [Pa].

    The needle bends as the exact rod does. Where F a^2/EI is above 0.3 the small-deflection formula reads too
    stiff a needle: by 94 % at the tip.
    """
    drawn = NEEDLE_MODULUS + NEEDLE_SPREAD * random.standard_normal(len(_POSITIONS))
    second_moment = core.Needle(_DIAMETER, 0.0, _LENGTH, NEEDLE_MODULUS, 0.3).second_moment
    exact = [tip_deflection(0.1, a, _LENGTH, float(e) * second_moment) for a, e in zip(_POSITIONS, drawn)]
    read = np.round(np.array(exact) + random.normal(0.0, _DIAL, len(exact)), 5)  # the dial has steps of 0.01 mm
    return Bending(np.array(_POSITIONS), np.full(len(exact), 0.1), read), drawn


def pull_tissue(random: np.random.Generator) -> Tension:
    """A neo-Hookean strip, P = E/3 (stretch - stretch^-2), up to 20 % of strain, with noise on the stress."""
    stress = TISSUE_MODULUS / 3.0 * (_STRETCH - _STRETCH**-2) + random.normal(0.0, _STRESS_NOISE, len(_STRETCH))
    return Tension(_STRETCH.copy(), stress)
