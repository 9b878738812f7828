# SPDX-License-Identifier: Apache-2.0
"""The estimates of friction and cutting force from second insertions at the same sites."""

import dataclasses

from ...models.parameter_units import UNITS
from ..diagnostics import FitInputs
from ..estimates import Estimate, mean_estimate, pool
from ..one_layer.segmented_recording import SegmentedRecording
from .bias_terms import spreading_force
from .result import TwoPass
from .subtraction import Pair, cutting_oscillation, subtract

TWO_PASS = "second insertion at the same site"


def two_pass_estimates(
    singles: list[SegmentedRecording], seconds: list, own: dict, given: FitInputs, foundation: str
) -> tuple[TwoPass | None, dict, dict]:
    """The result over all pairs, the estimates that it replaces, and the reason for each recording that was refused."""
    if not seconds:
        return None, {}, {}
    pairs = [
        Pair(single, second, own[single]["contact_depth"].value, own[single]["puncture_indentation"].value)
        for single, second in zip(singles, seconds)
        if second is not None and single in own
    ]
    spreading = spreading_force(given.needle, given.bench.get("tissue_young_modulus"))
    two_pass, refused = subtract(pairs, spreading)
    by_single = {pairs[k].first: sentence for k, sentence in refused.items()}
    return two_pass, {} if two_pass is None else _replaced(two_pass) | _bend(two_pass, foundation), by_single


def _bend(two_pass: TwoPass, foundation: str) -> dict[str, Estimate]:
    """Friction under a nonlinear form of the foundation; empty for a linear one, and with too few bins."""
    forms = () if foundation == "linear" else two_pass.forms(foundation)
    source = f"{TWO_PASS}, {foundation} foundation, least squares with intercept"
    own = [
        {
            name: Estimate(
                name, value, UNITS[name], form.low[name], form.high[name],
                identifiable=name in form.identifiable, source=source,
            )
            for name, value in form.values.items()
        }
        for form in forms
    ]  # fmt: skip
    return pool(own)


def _replaced(two_pass: TwoPass) -> dict[str, Estimate]:
    sites, bound = two_pass.sites, ", an upper bound" if two_pass.upper_bound else ""
    slopes, forces = [site.friction_slope for site in sites], [site.cutting for site in sites]
    by_slope = f"{TWO_PASS}, least squares with intercept"
    friction = mean_estimate(
        "friction_per_length", slopes, UNITS["friction_per_length"], by_slope, sites[0].friction_slope_half
    )
    cutting = mean_estimate(
        "cutting_force", forces, UNITS["cutting_force"], f"first minus {TWO_PASS}{bound}", sites[0].cutting_half
    )
    cutting = dataclasses.replace(cutting, identifiable=not two_pass.upper_bound)
    extremes = {} if two_pass.upper_bound else {each.name: each for each in cutting_oscillation(two_pass) or ()}
    return {"friction_per_length": friction, "cutting_force": cutting} | extremes
