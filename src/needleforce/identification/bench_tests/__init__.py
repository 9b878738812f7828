# SPDX-License-Identifier: Apache-2.0
"""The two bench tests, bending of the needle and tension or compression of the tissue, from files to moduli."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from ...core import Needle
from ...display.quantities import percent
from ...errors import InputError
from ..estimates import Estimate
from .bending import BendingFit, needle_modulus, three_point_modulus
from .elastica import (
    cantilever_deflection,
    cantilever_modulus,
    cantilever_sensitivities,
    elastica_deflection,
    three_point_load,
)
from .law_fit import LawFit, StressCurve
from .laws import LAWS, MODES, initial_modulus, nominal_stress, stable_range, strain_energy
from .ogden import fit_ogden
from .reading import UNIAXIAL, ZERO_FITTED, read_bending, read_stress
from .stress_fit import fit_stress
from .stress_result import MAX_MISFIT, StressFit, modulus_by_mode

__all__ = [
    "LAWS",
    "MAX_MISFIT",
    "MODES",
    "BendingFit",
    "LawFit",
    "StressCurve",
    "StressFit",
    "cantilever_deflection",
    "cantilever_modulus",
    "cantilever_sensitivities",
    "elastica_deflection",
    "fit_ogden",
    "fit_stress",
    "initial_modulus",
    "modulus_by_mode",
    "needle_estimate",
    "needle_modulus",
    "nominal_stress",
    "read_bending",
    "read_stress",
    "stable_range",
    "strain_energy",
    "three_point_load",
    "three_point_modulus",
    "tissue_estimate",
]


def tissue_estimate(path: str | Path, law: str | None = None, mode: str | None = None) -> Estimate:
    """``tissue_young_modulus`` [Pa] from the table of a tension or compression test, see ``read_stress`` and
    ``fit_stress``; its source states law, mode and misfit."""
    try:
        curve, assumptions = read_stress(path, mode=mode)
        found = fit_stress(curve, law=law, fit_zero=ZERO_FITTED in assumptions)
    except InputError as error:
        raise (error if Path(path).name in error.place else error.at(Path(path).name)) from None
    misfit = f"misfit {percent(found.misfit)} of the peak" + ", above 5 %" * (found.misfit > MAX_MISFIT)
    assumed = f"{UNIAXIAL} mode assumed; " if mode is None else ""
    return replace(found.young_modulus, source=f"{found.young_modulus.source}; {assumed}{misfit}")


def needle_estimate(path: str | Path, needle: Needle) -> Estimate:
    """``needle_young_modulus`` [Pa] from a table with the columns position, force and tip_deflection, units in the
    headers."""
    try:
        readings, _ = read_bending(path)
        found = needle_modulus(readings["force"], readings["position"], readings["tip_deflection"], needle)
    except InputError as error:
        raise (error if Path(path).name in error.place else error.at(Path(path).name)) from None
    limits: tuple[Any, ...] = (found.low, found.high)
    clamp = ", elastic clamp" if found.clamp_compliance else ""
    source = f"cantilever, large deflections{clamp}, {len(found.used)} readings; misfit {percent(found.misfit)}"
    return Estimate("needle_young_modulus", found.young_modulus, "Pa", *limits, source=source)
