# SPDX-License-Identifier: Apache-2.0
"""Parameters with priors from measurements of any kind: least squares, intervals, and what trades off."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .steering_parameters import Parameter, search_values

STEP = 2e-3  # of a derivative, in standard deviations of the prior
ROBUST_FROM = 2.0  # standard deviations

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
    """The outcome of a search.

    Attributes
    ----------
    values : dict of str to float
        Name -> value.
    estimates : tuple of SteeringEstimate
        The same with intervals.
    trade_offs : tuple of (str, str, float)
        Pairs whose errors have a correlation beyond 0.9.
    """

    values: dict[str, float]
    estimates: tuple[SteeringEstimate, ...]
    trade_offs: tuple[tuple[str, str, float], ...]


def search(
    parameters: Sequence[Parameter],
    misfit: Callable[[dict[str, float]], np.ndarray],
    progress: Progress | None = None,
) -> Found:
    """Minimise the misfit and the deviations from the priors.

    Parameters
    ----------
    parameters : sequence of Parameter
        What is sought.
    misfit : callable
        Values by name -> residuals in units of their standard deviations. Large ones count linearly.
    progress : callable, optional
        Called with the number of evaluations and the cost.

    Returns
    -------
    Found
    """
    from scipy.optimize import least_squares

    center, spread = np.array([p.inside(p.center) for p in parameters]), np.array([p.spread for p in parameters])
    low, high = (
        (np.array([p.inside(edge) for p, edge in edges]) - center) / spread
        for edges in ([(p, p.low) for p in parameters], [(p, p.high) for p in parameters])
    )
    calls = 0

    def residuals(deviations: np.ndarray) -> np.ndarray:
        nonlocal calls
        calls += 1
        joined = np.concatenate([misfit(search_values(parameters, center + spread * deviations)), deviations])
        if progress:
            progress(calls, 0.5 * float(joined @ joined))
        return joined

    def slopes(deviations: np.ndarray) -> np.ndarray:
        columns, here = [], residuals(deviations)
        for i in range(len(deviations)):
            step = STEP if deviations[i] + STEP <= high[i] else -STEP
            aside = deviations.copy()
            aside[i] += step
            columns.append((residuals(aside) - here) / step)
        return np.column_stack(columns)

    # the last rows before a lost sensor, and whatever else is no noise, count linearly
    robust = {"loss": "soft_l1", "f_scale": ROBUST_FROM}
    start = np.zeros(len(parameters))
    solution = least_squares(residuals, start, slopes, (low, high), xtol=1e-5, ftol=1e-5, max_nfev=100, **robust)
    return _found(parameters, center + spread * solution.x, solution.jac)


def _found(parameters: Sequence[Parameter], numbers: np.ndarray, jacobian: np.ndarray) -> Found:
    covariance = np.linalg.inv(jacobian.T @ jacobian)  # least_squares gives the Jacobian with the weights of the loss
    sd = np.sqrt(np.diag(covariance))
    estimates = tuple(_estimate(p, x, each) for p, x, each in zip(parameters, numbers, sd))
    return Found(search_values(parameters, numbers), estimates, _trade_offs(parameters, covariance / np.outer(sd, sd)))


def _estimate(parameter: Parameter, number: float, sd: float) -> SteeringEstimate:
    low, high = (parameter.outside(number + side * 1.96 * sd * parameter.spread) for side in (-1, 1))
    return SteeringEstimate(
        name=parameter.name,
        unit=parameter.unit,
        meaning=parameter.meaning,
        value=parameter.outside(number),
        low=max(low, parameter.low),
        high=min(high, parameter.high),
        identifiable=bool(sd < 0.5),
    )


def _trade_offs(parameters: Sequence[Parameter], correlation: np.ndarray) -> tuple[tuple[str, str, float], ...]:
    pairs = zip(*np.where(np.triu(np.abs(correlation) > 0.9, k=1)))
    return tuple((parameters[i].name, parameters[j].name, round(float(correlation[i, j]), 2)) for i, j in pairs)
