# SPDX-License-Identifier: Apache-2.0
"""Quantities that follow from the identified ones only together with the needle and the tissue's modulus."""

import math

from ..core import Tissue
from .estimates import Estimate
from .implied import implied_friction_coefficients, implied_poisson_ratio

INCOMPRESSIBLE = 0.5


def derived(parameters: dict[str, Estimate], needle, tissue: Estimate | None) -> dict[str, Estimate]:
    """``reduced_modulus`` with a tip; with the tissue's modulus too, the Poisson ratio and friction coefficients it
    implies."""
    if needle is None or needle.tip is None:
        return {}
    found = {"reduced_modulus": _reduced_modulus(parameters["stiffness_coefficient"], needle)}
    if tissue is not None:
        found |= _poisson(found["reduced_modulus"], needle, tissue)
        found |= _friction(parameters["friction_per_length"], found, needle, tissue)
    return found


def _reduced_modulus(coefficient: Estimate, needle) -> Estimate:
    factor = 0.5 * math.pi / math.tan(needle.tip.half_angle)
    sd = coefficient.between_repeats_sd
    return Estimate(
        "reduced_modulus",
        factor * coefficient.value,
        "Pa",
        factor * coefficient.low,
        factor * coefficient.high,
        None if sd is None else factor * sd,
        True,
        f"stiffness coefficient and a tip of half angle {math.degrees(needle.tip.half_angle):.3g} degrees",
    )


def _poisson(modulus: Estimate, needle, tissue: Estimate) -> dict[str, Estimate]:
    bounds = [
        implied_poisson_ratio(value, tissue.value, needle) for value in (modulus.value, modulus.low, modulus.high)
    ]
    source = f"implied by reduced modulus and E = {tissue.value / 1e3:.4g} kPa; no measurement of it"
    return {
        "implied_poisson_ratio": Estimate(
            "implied_poisson_ratio", bounds[0], "1", bounds[1], bounds[2], None, False, source
        )
    }


def _friction(per_length: Estimate, found: dict, needle, tissue: Estimate) -> dict[str, Estimate]:
    implied = found["implied_poisson_ratio"].value
    ratio = implied if 0.0 <= implied <= 0.5 else INCOMPRESSIBLE
    body = Tissue(young_modulus=tissue.value, poisson_ratio=ratio)
    bounds = [
        implied_friction_coefficients(value, needle, body)
        for value in (per_length.value, per_length.low, per_length.high)
    ]
    source = f"implied by friction per length with E = {tissue.value / 1e3:.4g} kPa, nu = {ratio:.3g}"
    return {
        f"friction_coefficient_{reading}": Estimate(
            f"friction_coefficient_{reading}",
            bounds[0][reading],
            "1",
            bounds[1][reading],
            bounds[2][reading],
            None,
            False,
            f"{source}, reading {reading}",
        )
        for reading in bounds[0]
    }
