# SPDX-License-Identifier: Apache-2.0
"""Tissue, tip and guide from tip paths: least squares with priors, whatever the mechanics leave unexplained aside."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from .. import core
from ..errors import InputError
from .path_errors import PathErrors
from .path_prediction import STEP, PathPredictor, readings_of, residuals_of
from .path_simulation import simulated_path
from .steering_model import SteeringModel
from .steering_parameters import MODELS, Parameter, search_values
from .tip_paths import TipPath

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

ROBUST_FROM = 2.0  # standard deviations


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
class SteeringFit:
    """An identified model of steered insertions.

    Attributes
    ----------
    model : SteeringModel
        What ``nf.FlexibleInsertion`` needs, and its motion for a base.
    parameters : tuple of SteeringEstimate
        With intervals.
    trade_offs : tuple of (str, str, float)
        Pairs of parameters whose errors have a correlation beyond 0.9.
    rms : dict of str to float
        Insertion -> root mean square of the lateral error of its prediction from the entry [m]; it is in the fit.
    """

    model: SteeringModel
    parameters: tuple[SteeringEstimate, ...]
    trade_offs: tuple[tuple[str, str, float], ...]
    rms: dict[str, float]

    def predict(self, path: TipPath) -> np.ndarray:
        """The tip for the base's motion of an insertion, whose pose is taken from its rows before the base moves.

        Parameters
        ----------
        path : TipPath
            Its base and depth are used, and of its tip the ``entry_rows`` alone.

        Returns
        -------
        ndarray, shape (n, 3)
            Position of the tip [m].
        """
        return self.model.predictor.tip(path)

    def uncertainty(self, path: TipPath) -> np.ndarray:
        """Standard deviation of ``predict`` in each lateral direction, (n,) [m]: of the parameters, the pose and what
        the mechanics leave unexplained."""
        return self.model.predictor.uncertainty(path)

    @property
    def left_out(self) -> dict[str, float]:
        """Insertion -> root mean square lateral error of its prediction when it is left out of the fit [m]; linear in
        the parameters. Empty for one insertion."""
        return {name: error for name, (error, _) in self.model.predictor.left_out.items()}


def identify(
    insertions: Sequence[TipPath],
    needle: core.Needle,
    *,
    model: str = "yielding",
    progress: Callable[[int, float], None] | None = None,
) -> SteeringFit:
    """Identify tissue, tip and guide from insertions, steered and unsteered together.

    Parameters
    ----------
    insertions : sequence of TipPath
        As ``nf.steering.read`` returns them, of one tissue.
    needle : Needle
        Its bending stiffness scales all forces and stiffnesses: tip paths alone give their ratios to it.
    model : str
        ``"linear"`` foundation, or ``"yielding"``: tissue that the shaft pushes aside beyond a force per length.
    progress : callable, optional
        Called with the number of evaluations and the cost.

    Returns
    -------
    SteeringFit

    Raises
    ------
    InputError
        If the model is unknown, there is no insertion, or the tip is not tracked for three rows.
    """
    if model not in MODELS:
        raise InputError("model", repr(model), "unknown", next_step=f"Give one of {', '.join(MODELS)}.")
    if not insertions or any(len(path) < 3 for path in insertions):
        limit = "needed with a tip in at least three rows each"
        raise InputError("insertions", len(insertions), limit, next_step="Give nf.steering.read(file).")
    parameters = MODELS[model]
    solution = _search(parameters, insertions, needle, progress)
    center, spread = _priors(parameters)
    numbers = center + spread * solution.x
    values = search_values(parameters, numbers)
    # least_squares gives the Jacobian with the weights of the loss
    covariance = np.linalg.inv(solution.jac.T @ solution.jac)
    predictor = PathPredictor(partial(simulated_path, needle=needle), values, tuple(insertions), parameters)
    return SteeringFit(
        model=SteeringModel(model, values, needle, predictor),
        parameters=tuple(_estimate(p, x, sd) for p, x, sd in zip(parameters, numbers, np.sqrt(np.diag(covariance)))),
        trade_offs=_trade_offs(parameters, covariance),
        rms={path.name: predictor.rms(path) for path in insertions},
    )


def _priors(parameters: Sequence[Parameter]) -> tuple[np.ndarray, np.ndarray]:
    return np.array([p.inside(p.center) for p in parameters]), np.array([p.spread for p in parameters])


def _search(
    parameters: Sequence[Parameter],
    insertions: Sequence[TipPath],
    needle: core.Needle,
    progress: Callable[[int, float], None] | None,
) -> "OptimizeResult":
    """Least squares over the deviations from the priors, in units of their spread."""
    from scipy.optimize import least_squares

    center, spread = _priors(parameters)
    low, high = ((np.array([p.inside(edge) for p, edge in rows]) - center) / spread for rows in _edges(parameters))
    errors = PathErrors([readings_of(path) for path in insertions])
    calls = 0

    def residuals(deviations: np.ndarray) -> np.ndarray:
        nonlocal calls
        values = search_values(parameters, center + spread * deviations)
        parts = [residuals_of(simulated_path(values, path, needle=needle), path) for path in insertions]
        joined = np.concatenate([errors.whitened(parts).ravel(), deviations])
        calls += 1
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

    start = np.zeros(len(parameters))
    # the last rows before a lost sensor, and whatever else is no noise, count linearly
    robust = {"loss": "soft_l1", "f_scale": ROBUST_FROM}
    return least_squares(residuals, start, slopes, (low, high), xtol=1e-5, ftol=1e-5, max_nfev=100, **robust)


def _edges(parameters: Sequence[Parameter]) -> tuple[list[tuple[Parameter, float]], list[tuple[Parameter, float]]]:
    return [(p, p.low) for p in parameters], [(p, p.high) for p in parameters]


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


def _trade_offs(parameters: Sequence[Parameter], covariance: np.ndarray) -> tuple[tuple[str, str, float], ...]:
    sd = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sd, sd)
    pairs = zip(*np.where(np.triu(np.abs(correlation) > 0.9, k=1)))
    return tuple((parameters[i].name, parameters[j].name, round(float(correlation[i, j]), 2)) for i, j in pairs)
