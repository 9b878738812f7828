# SPDX-License-Identifier: Apache-2.0
"""What is true of an experiment: what was set, and what the sites and tests really had."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .bench_tests import NEEDLE_MODULUS, TISSUE_MODULUS
from .site import Site
from .specimen import Specimen

_OF_A_SITE = {
    "puncture_force": ("puncture_force", "N"),
    "puncture_indentation": ("puncture_depth", "m"),
    "friction_per_length": ("friction_per_length", "N/m"),
    "cutting_force": ("cutting_force", "N"),
}


@dataclass(frozen=True)
class Truth:
    """A true quantity [SI]: ``nominal`` as set; the mean ``drawn`` by sites or tests, and the ``sd`` between them."""

    nominal: float
    drawn: float
    sd: float
    unit: str


def truth(nominal: Specimen, sites: Sequence[Site], needle_moduli: np.ndarray) -> dict[str, Truth]:
    """The six quantities of the paper, by name."""
    table = {
        "needle_young_modulus": _summary(NEEDLE_MODULUS, needle_moduli, "Pa"),
        "tissue_young_modulus": Truth(TISSUE_MODULUS, TISSUE_MODULUS, 0.0, "Pa"),
    }
    for quantity, (name, unit) in _OF_A_SITE.items():
        table[quantity] = _summary(getattr(nominal, name), [getattr(site.specimen, name) for site in sites], unit)
    return table


def _summary(nominal: float, drawn: Sequence[float], unit: str) -> Truth:
    sd = float(np.std(drawn, ddof=1)) if len(drawn) > 1 else 0.0
    return Truth(float(nominal), float(np.mean(drawn)), sd, unit)
