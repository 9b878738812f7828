# SPDX-License-Identifier: Apache-2.0
"""Tissue, tip and guide from wrenches at the base alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from .. import core
from ..errors import InputError
from .base_wrenches import BaseWrench
from .parameter_search import Progress, SteeringEstimate, search
from .path_prediction import PathPredictor
from .path_simulation import simulated_path
from .steering_model import SteeringModel
from .steering_parameters import ALIGNED, WRENCH_MODELS, held_at
from .tip_paths import MAX_COMPARED

COMPONENTS = ("fx", "fy", "tx", "ty")
# what the mechanics get wrong: a share of the largest force and moment, which varies along this length
MODEL_ERROR = 0.05
MODEL_LENGTH = 0.01  # [m]
_BIAS = 10.0  # of the sensor, in standard deviations of its noise


@dataclass(frozen=True)
class WrenchFit:
    """A needle identified from base wrenches.

    Attributes
    ----------
    model : SteeringModel
        What simulates it and plans; its tip is predicted without any tip having been measured.
    parameters : tuple of SteeringEstimate
        With intervals.
    trade_offs : tuple of (str, str, float)
        Pairs of parameters whose errors have a correlation beyond 0.9.
    rms : dict of str to ndarray, shape (4,)
        Insertion -> root mean square residual of fx, fy [N], tx, ty [N m].
    """

    model: SteeringModel
    parameters: tuple[SteeringEstimate, ...]
    trade_offs: tuple[tuple[str, str, float], ...]
    rms: dict[str, np.ndarray]

    def predict(self, insertion: BaseWrench) -> np.ndarray:
        """fx, fy [N], tx, ty [N m] at the base for the motion of an insertion, (n, 4)."""
        return _simulated(self.model.values, insertion, self.model.needle)


def identify_wrenches(
    insertions: Sequence[BaseWrench],
    needle: core.Needle,
    *,
    model: str = "linear",
    held: str = "guide",
    progress: Progress | None = None,
) -> WrenchFit:
    """Identify tissue, tip and guide from base wrenches. ``nf.steering.identify`` calls it for ``BaseWrench``.

    Parameters
    ----------
    insertions : sequence of BaseWrench
        Of one tissue; more than 60 rows are thinned evenly.
    needle : Needle
        Its bending stiffness turns wrenches into deflections: an error of it is one of the predicted tip.
    model : str
        ``"linear"`` or ``"yielding"``.
    held : str
        By a ``"guide"`` at a fixed distance, or at its ``"hub"``, which comes down with it.
    progress : callable, optional
        Called with the number of evaluations and the cost.

    Returns
    -------
    WrenchFit

    Raises
    ------
    InputError
        If the model is unknown, or an insertion has less than three rows.
    """
    if model not in WRENCH_MODELS:
        raise InputError("model", repr(model), "unknown", next_step=f"Give one of {', '.join(WRENCH_MODELS)}.")
    if not insertions or any(len(each) < 3 for each in insertions):
        limit = "needed with at least three rows each"
        raise InputError("insertions", len(insertions), limit, next_step="Give nf.steering.base_wrench(…).")
    thinned = [each.rows(np.unique(np.linspace(0, len(each) - 1, MAX_COMPARED).astype(int))) for each in insertions]
    factors = [[np.linalg.cholesky(block) for block in _covariances(each)] for each in thinned]

    def misfit(values: dict[str, float]) -> np.ndarray:
        parts = []
        for each, blocks in zip(thinned, factors):
            residuals = each.lateral - _simulated(values, each, needle)
            parts += [np.linalg.solve(block, column) for block, column in zip(blocks, residuals.T)]
        return np.concatenate(parts)

    found = search(held_at(WRENCH_MODELS[model], held), misfit, progress)
    values = found.values | ALIGNED
    predictor = PathPredictor(partial(simulated_path, needle=needle), values)
    fit = WrenchFit(SteeringModel(model, values, needle, predictor), found.estimates, found.trade_offs, {})
    for each in insertions:
        fit.rms[each.name] = np.sqrt(np.mean((fit.predict(each) - each.lateral) ** 2, axis=0))
    return fit


def _simulated(values: dict[str, float], insertion: BaseWrench, needle: core.Needle) -> np.ndarray:
    """Lateral forces and moments (n, 4) about a sensor that is further behind the base by the lever."""
    wrench = simulated_path(values | ALIGNED, insertion.path, needle=needle).wrench
    force, moment, lever = wrench[:, :2], wrench[:, 3:5], values["lever"]
    return np.column_stack([force, moment + lever * np.column_stack([-force[:, 1], force[:, 0]])])


def _covariances(insertion: BaseWrench) -> list[np.ndarray]:
    """Of the errors of each component: noise and bias of the sensor, and what the mechanics get wrong."""
    apart = insertion.depth[:, None] - insertion.depth
    similar = np.exp(-0.5 * (apart / MODEL_LENGTH) ** 2)
    largest = np.abs(insertion.lateral).reshape(-1, 2, 2).max(axis=(0, 2))  # of the forces and of the moments
    return [
        noise**2 * (np.eye(len(insertion)) + _BIAS**2) + (MODEL_ERROR * size) ** 2 * similar
        for noise, size in zip(insertion.noise, np.repeat(largest, 2))
    ]
