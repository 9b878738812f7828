# SPDX-License-Identifier: Apache-2.0
"""Tissue, tip and guide from tip paths: least squares with priors; each insertion has a pose of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import core
from ..errors import InputError
from .deflection_model import MODELS, Course, Parameter, SteeringModel, course_of, search_values
from .tip_paths import TipPath

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

POSITION_NOISE = 0.2e-3  # [m] of an electromagnetic sensor in a needle
SLOPE_NOISE = 4e-3
OFFSET_SPREAD = 1e-3  # [m] of the entry against the base, between insertions
TILT_SPREAD = 0.015  # [rad]
# of a prediction from the entry, where the model is wrong: in addition to the noise
MODEL_ERROR = 0.5e-3
SLOPE_ERROR = 8e-3
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
        Insertion -> root mean square of the lateral error with a free pose [m].
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
        course = self.model.course(path)
        pose = _pose(course, path, min(path.entry_rows, _ENTRY))
        return np.column_stack([_placed(course, pose), path.tip[:, 2]])


_ENTRY = 2  # rows at the entry that are used, at most
_STEP = 2e-3  # of the search, in units of the priors' spread


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
    numbers = np.array([p.inside(p.center) + p.spread * x for p, x in zip(parameters, solution.x)])
    values = search_values(parameters, numbers)
    covariance = np.linalg.inv(solution.jac.T @ solution.jac)
    return SteeringFit(
        model=SteeringModel(model, values, needle),
        parameters=tuple(_estimate(p, x, sd) for p, x, sd in zip(parameters, numbers, np.sqrt(np.diag(covariance)))),
        trade_offs=_trade_offs(parameters, covariance),
        rms={path.name: _rms(course_of(values, needle, path), path) for path in insertions},
    )


def _search(
    parameters: Sequence[Parameter],
    insertions: Sequence[TipPath],
    needle: core.Needle,
    progress: Callable[[int, float], None] | None,
) -> "OptimizeResult":
    """Least squares over the deviations from the priors, in units of their spread."""
    from scipy.optimize import least_squares

    center = np.array([p.inside(p.center) for p in parameters])
    spread = np.array([p.spread for p in parameters])
    low, high = ((np.array([p.inside(edge) for p, edge in rows]) - center) / spread for rows in _edges(parameters))
    calls = 0

    def residuals(deviations: np.ndarray) -> np.ndarray:
        nonlocal calls
        values = search_values(parameters, center + spread * deviations)
        parts = [_residuals(course_of(values, needle, path), path) for path in insertions]
        joined = np.concatenate([*parts, deviations])
        calls += 1
        if progress:
            progress(calls, 0.5 * float(joined @ joined))
        return joined

    def slopes(deviations: np.ndarray) -> np.ndarray:
        columns, here = [], residuals(deviations)
        for i in range(len(deviations)):
            step = _STEP if deviations[i] + _STEP <= high[i] else -_STEP
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


def _residuals(course: Course, path: TipPath) -> np.ndarray:
    """Of all rows with the pose that fits them, and of the prediction from the entry: the second keeps the pose from
    taking over what the mechanics should explain."""
    free = _pose(course, path, len(path))
    entry = _pose(course, path, min(path.entry_rows, _ENTRY))
    parts = [(free - _expected_pose(course, path)) / [[OFFSET_SPREAD], [TILT_SPREAD]]]
    for pose, position, slope in ((free, POSITION_NOISE, SLOPE_NOISE), (entry, MODEL_ERROR, SLOPE_ERROR)):
        parts.append((_placed(course, pose) - path.tip[:, :2]) / position)
        if path.slope is not None:
            parts.append((course.slope + pose[1] - path.slope) / slope)
    return np.concatenate([part.ravel() for part in parts])


def _pose(course: Course, path: TipPath, rows: int) -> np.ndarray:
    """Offset [m] and tilt [rad] of an insertion, (2, 2), most probable for its first rows."""
    n = rows
    one, zero = np.ones(n), np.zeros(n)
    sides = [(path.tip[:n, :2] - course.tip[:n]) / POSITION_NOISE]
    matrix = [np.column_stack([one, course.depth[:n]]) / POSITION_NOISE]
    if path.slope is not None:
        sides.append((path.slope[:n] - course.slope[:n]) / SLOPE_NOISE)
        matrix.append(np.column_stack([zero, one]) / SLOPE_NOISE)
    spread = np.array([OFFSET_SPREAD, TILT_SPREAD])
    sides.append(_expected_pose(course, path) / spread[:, None])
    matrix.append(np.diag(1.0 / spread))
    return np.linalg.lstsq(np.vstack(matrix), np.vstack(sides), rcond=None)[0]


def _expected_pose(course: Course, path: TipPath) -> np.ndarray:
    """Before the data: an entry at the first row, as the tip's frame need not be the base's, and no tilt."""
    return np.vstack([path.tip[0, :2] - course.tip[0], np.zeros(2)])


def _placed(course: Course, pose: np.ndarray) -> np.ndarray:
    return course.tip + pose[0] + np.outer(course.depth, pose[1])


def _rms(course: Course, path: TipPath) -> float:
    error = _placed(course, _pose(course, path, len(path))) - path.tip[:, :2]
    return float(np.sqrt(np.mean(np.sum(error**2, axis=1))))


def _estimate(parameter: Parameter, number: float, sd: float) -> SteeringEstimate:
    low, high = (parameter.outside(number + side * 1.96 * sd * parameter.spread) for side in (-1, 1))
    return SteeringEstimate(
        parameter.name,
        parameter.unit,
        parameter.meaning,
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
