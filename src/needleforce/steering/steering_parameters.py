# SPDX-License-Identifier: Apache-2.0
"""The parameters of a steered insertion that are identified, their priors, and the search for them."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..checks import one_of
from .path_simulation import PATH_SPACING
from .tissue_prior import ROBUST_FROM, Spread


@dataclass(frozen=True)
class Parameter:
    """One identified quantity: its prior is a normal distribution of the value, or of its logarithm."""

    name: str
    unit: str
    center: float
    spread: float  # standard deviation; of the natural logarithm where `positive`
    positive: bool
    low: float
    high: float
    meaning: str
    step: float = 2e-3  # of a derivative, in standard deviations of the prior

    def inside(self, value: float) -> float:
        """The value as the search sees it."""
        return math.log(value) if self.positive else value

    def outside(self, number: float) -> float:
        """The value of a number of the search."""
        return math.exp(number) if self.positive else number


def _parameters(*rows: tuple) -> tuple[Parameter, ...]:
    return tuple(Parameter(*row) for row in rows)


# The priors are wide: gels to muscle, guides from the skin to a hand's breadth, sensors as they are glued in.
_TISSUE = _parameters(
    ("modulus", "Pa", 3e4, 1.5, True, 1e2, 1e7, "foundation modulus, elastic part"),
    ("tip_force_x", "N", 0.0, 0.3, False, -5.0, 5.0, "lateral force on the tip, along x"),
    ("tip_force_y", "N", 0.0, 0.3, False, -5.0, 5.0, "lateral force on the tip, along y"),
)
_YIELDING = _parameters(
    ("yielding_modulus", "Pa", 1e5, 1.5, True, 1e2, 1e7, "foundation modulus, yielding part"),
    ("yield_force", "N/m", 30.0, 1.5, True, 1e-1, 1e5, "lateral force per length at which the tissue yields"),
    ("tip_stiffness", "N/m", 100.0, 1.5, True, 1e-1, 1e5, "stiffness of the tissue ahead of a tip at rest"),
    ("tip_memory", "m", 2e-3, 1.0, True, 1e-4, 5e-2, "travel over which the tip leaves that tissue"),
)
_SKIN = _parameters(
    ("skin_modulus", "Pa", 1e6, 1.5, True, 1e3, 1e8, "as yielding_modulus, in the skin"),
    ("skin_yield_force", "N/m", 500.0, 1.5, True, 1.0, 1e7, "as yield_force, in the skin"),
)
_PIVOT = _parameters(
    ("pivot_stiffness", "N/m", 500.0, 2.0, True, 1e-2, 5e6, "lateral stiffness of the surface at the entry")
)
_SURFACE = 3e-3  # [m]
# a tip that rests between two nodes of its path moves about the last one, by up to 10 um more than on a node: a
# derivative goes to where it rests at the same part of a piece
_ON_A_NODE = PATH_SPACING / _SURFACE
_GUIDE = _parameters(
    ("guide_distance", "m", 0.03, 0.7, True, 2e-3, 0.3, "distance from the guide to the surface"),
    ("rotational_compliance", "rad/(N m)", 1.0, 3.0, True, 1e-4, 5e3, "rotational compliance of the guide"),
    ("surface", "m", 0.0, _SURFACE, False, -0.02, 0.02, "where the tissue begins, from where depth counts", _ON_A_NODE),
)
_TRACKER = _parameters(
    ("lead", "1", 0.5, 0.5, False, 0.0, 1.0, "share of the base's next motion that a reading has seen"),
    ("axis_x", "rad", 0.0, 0.05, False, -0.3, 0.3, "slope of the insertion axis in the tracker's frame, along x"),
    ("axis_y", "rad", 0.0, 0.05, False, -0.3, 0.3, "the same along y"),
    ("sensor_x", "rad", 0.0, 0.05, False, -0.3, 0.3, "slope of the sensor's axis against the needle, along x"),
    ("sensor_y", "rad", 0.0, 0.05, False, -0.3, 0.3, "the same along y"),
)
MODELS = {
    "linear": (*_TISSUE, *_GUIDE, *_PIVOT, *_TRACKER),
    "yielding": (*_TISSUE, *_YIELDING, *_SKIN, *_GUIDE, *_TRACKER),
}
"""Name of a model -> the parameters that are identified."""


def search_values(parameters: Sequence[Parameter], numbers: np.ndarray) -> dict[str, float]:
    """Name -> value for the numbers of a search."""
    return {parameter.name: parameter.outside(float(number)) for parameter, number in zip(parameters, numbers)}


def deviations_of(parameters: Sequence[Parameter], values: dict[str, float]) -> np.ndarray:
    """Values as deviations from the means of their priors, in standard deviations, (p,)."""
    return np.array([(p.inside(values[p.name]) - p.inside(p.center)) / p.spread for p in parameters])


_SENSOR = _parameters(
    ("lever", "m", 0.0, 5e-3, False, -0.1, 0.1, "of the sensor behind the base, beyond its stated position"),
)
_TIP = _parameters(("tip_force", "N", 0.2, 1.5, True, 1e-4, 5.0, "lateral force on the tip, in the plane of a shape"))
WRENCH_MODELS = {
    "linear": (*_TISSUE, *_GUIDE, *_PIVOT, *_SENSOR),
    "yielding": (*_TISSUE, *_YIELDING, *_SKIN, *_GUIDE, *_SENSOR),
}
"""Name of a model -> the parameters that are identified from base wrenches."""
SHAPE_MODELS = {"linear": (*_TISSUE[:1], *_TIP, *_GUIDE)}
"""Name of a model -> the parameters that are identified from shapes."""
ALIGNED = {parameter.name: 0.0 for parameter in _TRACKER}
"""A tracker whose frame is that of the base, for needles that were identified without one."""


def held_at(parameters: Sequence[Parameter], held: str) -> tuple[Parameter, ...]:
    """The parameters of a needle that is held by a ``"guide"``, or at its ``"hub"``, which has no distance. Raises
    InputError if it is held otherwise."""
    one_of("held", held, ("guide", "hub"))
    return tuple(p for p in parameters if held == "guide" or p.name != "guide_distance")


NEAREST_GUIDE = 4e-3  # [m] by which a needle is at least longer than its insertion is deep
_SURFACE_MARGIN = 5e-3  # [m] that the surface may lie before where depth counts from, without a needle out of reach


def within_reach(parameters: Sequence[Parameter], length: float, insertions: Sequence[Any]) -> tuple[Parameter, ...]:
    """The parameters of a needle of a length [m] that was pushed in to the depths of insertions: its guide is no
    farther away than it reaches."""
    room = length - max(float(np.max(each.depth)) for each in insertions)
    farthest = max(room - _SURFACE_MARGIN, 0.5 * room)
    return tuple(replace(p, high=min(p.high, farthest)) if p.name == "guide_distance" else p for p in parameters)


Progress = Callable[[int, float], None]
"""Called with the number of evaluations and the cost."""


@dataclass(frozen=True)
class SteeringEstimate:
    """One identified parameter.

    Attributes
    ----------
    name, unit, meaning : str
        What it is.
    value, low, high : float
        Estimate and 95 % interval; from the curvature of the objective, so that they assume that the model is right.
    identifiable : bool
        Whether the data narrow the prior to less than half of it.
    """

    name: str
    unit: str
    meaning: str
    value: float
    low: float
    high: float
    identifiable: bool


@dataclass(frozen=True)
class Found:
    """The outcome of a search."""

    values: dict[str, float]
    estimates: tuple[SteeringEstimate, ...]
    trade_offs: tuple[tuple[str, str, float], ...]  # pairs whose errors have a correlation beyond 0.9
    spread: Spread  # estimates with the covariance of their errors, in standard deviations of the wide priors


def search(
    parameters: Sequence[Parameter],
    misfit: Callable[[dict[str, float]], np.ndarray],
    progress: Progress | None = None,
    prior: Spread | None = None,
    start: np.ndarray | None = None,
) -> Found:
    """Minimise the misfit, values by name -> residuals in units of their standard deviations, of which large ones count
    linearly, and the deviations from the wide priors, or from one that other tissues show; from its mean on, or from a
    ``start`` in standard deviations of the wide priors."""
    from scipy.optimize import least_squares

    center, spread = np.array([p.inside(p.center) for p in parameters]), np.array([p.spread for p in parameters])
    low, high = (
        (np.array([p.inside(edge) for p, edge in edges]) - center) / spread
        for edges in ([(p, p.low) for p in parameters], [(p, p.high) for p in parameters])
    )
    calls, steps, prior = 0, np.array([p.step for p in parameters]), prior or Spread.wide(len(parameters))

    def residuals(deviations: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        values = search_values(parameters, center + spread * deviations)
        joined = np.concatenate([misfit(values), prior.deviations(deviations)])
        if progress:
            progress(calls, 0.5 * float(joined @ joined))
        return joined

    def slopes(deviations: np.ndarray) -> np.ndarray:
        columns, here = [], residuals(deviations)
        for i in range(len(deviations)):
            step = steps[i] if deviations[i] + steps[i] <= high[i] else -steps[i]
            aside = deviations.copy()
            aside[i] += step
            columns.append((residuals(aside) - here) / step)
        return np.column_stack(columns)

    # the last rows before a lost sensor, and whatever else is no noise, count linearly
    robust = {"loss": "soft_l1", "f_scale": ROBUST_FROM}
    start = np.clip(prior.mean if start is None else start, low + steps, high - steps)
    solution = least_squares(residuals, start, slopes, (low, high), xtol=1e-5, ftol=1e-5, max_nfev=100, **robust)
    return _found(parameters, center + spread * solution.x, solution.jac, prior)


def _found(parameters: Sequence[Parameter], numbers: np.ndarray, jacobian: np.ndarray, prior: Spread) -> Found:
    covariance = np.linalg.inv(jacobian.T @ jacobian)  # least_squares gives the Jacobian with the weights of the loss
    sd = np.sqrt(np.diag(covariance))
    narrowed = sd < 0.5 * np.sqrt(np.diag(prior.covariance))
    estimates = tuple(_estimate(p, x, each, bool(less)) for p, x, each, less in zip(parameters, numbers, sd, narrowed))
    trade_offs = _trade_offs(parameters, covariance / np.outer(sd, sd))
    values = search_values(parameters, numbers)
    return Found(values, estimates, trade_offs, Spread(deviations_of(parameters, values), covariance))


def _estimate(parameter: Parameter, number: float, sd: float, narrowed: bool) -> SteeringEstimate:
    low, high = (parameter.outside(number + side * 1.96 * sd * parameter.spread) for side in (-1, 1))
    return SteeringEstimate(
        name=parameter.name,
        unit=parameter.unit,
        meaning=parameter.meaning,
        value=parameter.outside(number),
        low=max(low, parameter.low),
        high=min(high, parameter.high),
        identifiable=narrowed,
    )


def _trade_offs(parameters: Sequence[Parameter], correlation: np.ndarray) -> tuple[tuple[str, str, float], ...]:
    pairs = zip(*np.where(np.triu(np.abs(correlation) > 0.9, k=1)))
    return tuple((parameters[i].name, parameters[j].name, round(float(correlation[i, j]), 2)) for i, j in pairs)
