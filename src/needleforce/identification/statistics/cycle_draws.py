# SPDX-License-Identifier: Apache-2.0
"""Independent draws of what one cycle tells, from its exact posterior or from the Gaussian of its intervals."""

import math
from collections.abc import Callable

import numpy as np

from ..one_layer.cycle_fit import CycleFit
from ..one_layer.loading_curves import CURVES
from ..strokes import Strokes
from .noise import Z_95
from .posterior import Posterior, can_be_exact, posterior_of
from .running_sums import Linear

EXACT = "exact posterior: a grid over contact and puncture, the linear coefficients Gaussian in each cell"
GAUSSIAN = "Gaussian with the fit's covariance, puncture even over its interval"
ROUNDS = 100  # of draws, before what the priors allow is said to be too little


def draw_cycle(fit: CycleFit, strokes: Strokes, count: int, random: np.random.Generator) -> tuple[dict, str]:
    """Draws (count,) of each quantity of the cycle by name, SI, and the method that gave them.

    Exact where all was fitted at once with noise that running sums can carry; else Gaussian. No draw has a coefficient
    below 0. What the cycle does not tell is NaN.
    """
    bounded = {*CURVES[fit.law].units, "friction_per_length"}
    if can_be_exact(fit):
        posterior = posterior_of(fit, strokes)
        found = _allowed(lambda: _exact(fit, strokes, posterior, count, random), bounded)
        if found is not None:
            return found, EXACT
    bounded |= {"cutting_force"} if fit.by_stages else set()
    found = _allowed(lambda: _gaussian(fit, count, random), bounded)
    return _gaussian(fit, count, random) if found is None else found, GAUSSIAN


def _allowed(draw: Callable[[], dict], bounded: set[str]) -> dict | None:
    """As many draws as ``draw`` gives, none below 0 where bounded; None where such are rarer than one in ROUNDS."""
    kept: list[dict] = []
    for _ in range(ROUNDS):
        found = draw()
        good = np.all([~(found[name] < 0.0) for name in bounded & found.keys()], axis=0)
        if not kept and good.all():
            return found
        kept.append({name: values[good] for name, values in found.items()})
        if sum(len(each["contact_depth"]) for each in kept) >= len(good):
            return {name: np.concatenate([each[name] for each in kept])[: len(good)] for name in found}
    return None


def _exact(fit: CycleFit, strokes: Strokes, posterior: Posterior, count: int, random: np.random.Generator) -> dict:
    """Draws of the posterior before the bounds: a cell, a place within it, then the coefficients there."""
    cell = np.searchsorted(np.cumsum(posterior.weights.ravel()), random.random(count), side="right")
    cell = np.minimum(cell, posterior.weights.size - 1)
    along, across = posterior.steps * (random.random((count, 2)) - 0.5).T
    places = posterior.places(cell, along, across)
    c, f, k = random.standard_normal((3, count))
    at = Linear(*(np.take(each, cell) for each in posterior.linear))
    c, f, k = c * at.stiffness_sd, f * at.friction_sd, f * at.cutting_by_friction + k * at.cutting_sd
    means = (posterior.interpolated(each, cell, along, across) for each in posterior.linear[2:5])
    c, f, k = (scatter + mean for scatter, mean in zip((c, f, k), means))
    unit = posterior.depth_unit
    found = {"stiffness_coefficient": c / unit**2, "contact_depth": places[0]}
    found |= {"friction_per_length": f / unit, "cutting_force": k}
    found |= {"saturation_depth": places[1]} if fit.saturation_sought else {}
    before, after = (strokes.depth_in[places[2] - side] for side in (1, 0))
    puncture = before + random.random(count) * (after - before)
    if fit.left_out:
        puncture = fit.values["puncture_depth"] + _smear(fit) * random.standard_normal(count)
    return _with_puncture(fit, found, puncture)


def _smear(fit: CycleFit) -> float:
    """Standard error of the puncture's depth behind a filter [m], as the indentation's interval has it."""
    half = {name: 0.5 * (fit.high[name] - fit.low[name]) for name in ("puncture_indentation", "contact_depth")}
    return math.sqrt(max(half["puncture_indentation"] ** 2 - half["contact_depth"] ** 2, 0.0)) / Z_95


def _gaussian(fit: CycleFit, count: int, random: np.random.Generator) -> dict:
    """Draws of the Gaussian before the bounds; NaN for a number that the covariance does not know."""
    order = fit.covariance_order
    told = np.flatnonzero(np.isfinite(fit.covariance.diagonal()))
    values = np.full((len(order), count), np.nan)
    values[told] = _correlated(fit.covariance[np.ix_(told, told)], count, random)
    found = {name: fit.values[name] + scatter for name, scatter in zip(order, values)}
    ends = (limit["puncture_depth"] for limit in (fit.low, fit.high))
    return _with_puncture(fit, found, random.uniform(*ends, count))


def _correlated(covariance: np.ndarray, count: int, random: np.random.Generator) -> np.ndarray:
    """Draws (p, count) of a Gaussian about 0, scaled first as its units differ by orders of magnitude."""
    scale = np.sqrt(covariance.diagonal())
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return scale[:, None] * (root @ random.standard_normal((len(scale), count)))


def _with_puncture(fit: CycleFit, found: dict, puncture: np.ndarray) -> dict:
    """The draws with the puncture's depth, its indentation and the law's force there, what is not told held."""
    indentation = puncture - found["contact_depth"]
    told = {name: values for name, values in found.items() if not np.isnan(values).any()}
    values = {name: told.get(name, fit.values[name]) for name in CURVES[fit.law].units}
    force = CURVES[fit.law].force(indentation, values)
    return found | {"puncture_depth": puncture, "puncture_indentation": indentation, "puncture_force": force}
