# SPDX-License-Identifier: Apache-2.0
"""Quantities that follow from the identified ones only together with the needle and the tissue's modulus."""

import math

from ..core import Tissue
from ..mechanics.buckling import equivalent_half_angle
from .estimates import Estimate
from .implied import implied_friction_coefficients, implied_poisson_ratio

INCOMPRESSIBLE = 0.5


def derived(parameters: dict[str, Estimate], needle, tissue: Estimate | None) -> dict[str, Estimate]:
    """``reduced_modulus`` with a tip, of a law that has one; with the tissue's modulus too, the Poisson ratio and
    friction coefficients it implies."""
    if needle is None or needle.tip is None or "stiffness_coefficient" not in parameters:
        return {}
    found = {"reduced_modulus": _reduced_modulus(parameters["stiffness_coefficient"], needle)}
    if tissue is not None:
        found |= _poisson(found["reduced_modulus"], needle, tissue)
        found |= _friction(parameters["friction_per_length"], found, needle, tissue)
    return found


def _reduced_modulus(coefficient: Estimate, needle) -> Estimate:
    factor = 0.5 * math.pi / math.tan(equivalent_half_angle(needle.tip))
    sd = coefficient.between_repeats_sd
    return Estimate(
        "reduced_modulus",
        factor * coefficient.value,
        "Pa",
        factor * coefficient.low,
        factor * coefficient.high,
        None if sd is None else factor * sd,
        True,
        f"stiffness coefficient and a tip of half angle {math.degrees(equivalent_half_angle(needle.tip)):.3g} degrees",
    )


def _poisson(modulus: Estimate, needle, tissue: Estimate) -> dict[str, Estimate]:
    ratio = implied_poisson_ratio(modulus.value, tissue.value, needle)
    corners = [
        implied_poisson_ratio(reduced, young, needle)
        for reduced in (modulus.low, modulus.high)
        for young in (tissue.low, tissue.high)
    ]
    source = f"implied by reduced modulus and {_stated(tissue)}; no measurement of it"
    low, high = _span(corners, lowest=0.0)
    return {"implied_poisson_ratio": Estimate("implied_poisson_ratio", ratio, "1", low, high, None, False, source)}


def _friction(per_length: Estimate, found: dict, needle, tissue: Estimate) -> dict[str, Estimate]:
    implied = found["implied_poisson_ratio"].value
    ratio = implied if 0.0 <= implied <= INCOMPRESSIBLE else INCOMPRESSIBLE
    source = f"implied by friction per length with {_stated(tissue)} and nu = {ratio:.3g}"

    def coefficients(force: float, young: float) -> dict[str, float]:
        body = Tissue(young_modulus=young, poisson_ratio=ratio)
        return implied_friction_coefficients(force, needle, body)

    middle = coefficients(per_length.value, tissue.value)
    ends = [coefficients(f, e) for f in (per_length.low, per_length.high) for e in (tissue.low, tissue.high)]
    made = [_coefficient(reading, middle, ends, source) for reading in middle]
    return {estimate.name: estimate for estimate in made}


def _coefficient(reading: str, middle: dict, ends: list[dict], source: str) -> Estimate:
    low, high = _span([end[reading] for end in ends])
    name = f"friction_coefficient_{reading}"
    return Estimate(name, middle[reading], "1", low, high, None, False, f"{source}, reading {reading}")


def _span(corners: list[float], lowest: float = math.nan) -> tuple[float, float]:
    """Least and greatest of the corners of two intervals; ``lowest`` stands for a corner that has no value."""
    known = [lowest if math.isnan(corner) else corner for corner in corners]
    return min(known), max(known)


def _stated(tissue: Estimate) -> str:
    return f"E = {tissue.value / 1e3:.4g} kPa"
