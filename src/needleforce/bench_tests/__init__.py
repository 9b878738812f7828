# SPDX-License-Identifier: Apache-2.0
"""Bench tests from files to values: tension and compression of tissue, bending of a needle, penetration of films."""

from .bending import BendingFit, needle_modulus
from .elastica import (
    cantilever_deflection,
    cantilever_modulus,
    cantilever_sensitivities,
    elastica_deflection,
    three_point_load,
)
from .law_fit import LawFit, StressCurve, fit_ogden
from .laws import LAWS, MODES, initial_modulus, nominal_stress, stable_range, strain_energy
from .penetration import PenetrationTest, penetration_test
from .penetration_statistics import PenetrationTests, penetration_tests
from .reading import needle_estimate, read_bending, read_stress, tissue_estimate
from .stress_fit import fit_stress
from .stress_result import MAX_MISFIT, StressFit, modulus_by_mode
from .three_point import three_point_modulus

__all__ = [
    "LAWS",
    "MAX_MISFIT",
    "MODES",
    "BendingFit",
    "LawFit",
    "PenetrationTest",
    "PenetrationTests",
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
    "penetration_test",
    "penetration_tests",
    "read_bending",
    "read_stress",
    "stable_range",
    "strain_energy",
    "three_point_load",
    "three_point_modulus",
    "tissue_estimate",
]
