# SPDX-License-Identifier: Apache-2.0
"""Tissue, tip and guide from tip paths: least squares with priors, whatever the mechanics leave unexplained aside."""

import math
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import core
from ..errors import InputError
from .frame_check import check_frame
from .path_errors import PathErrors
from .path_prediction import PathPredictor, readings_of, residuals_of
from .path_simulation import simulated_path
from .result import SteeringResult
from .steering_model import SteeringModel
from .steering_parameters import MODELS, Progress, held_at, search, within_reach
from .tip_paths import TipPath

if TYPE_CHECKING:
    from ..display.page import Figure


class SteeringFit(SteeringResult):
    """A needle identified from tip paths; ``rms`` is the lateral error of each insertion's prediction from its entry
    [m], while it is in the fit."""

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

    def by_insertion(self) -> dict[str, dict[str, Any]]:
        """Insertion -> lateral error in the fit and left out of it [m]."""
        left_out = self.left_out
        return {
            name: {"rms_m": value, "left_out_rms_m": left_out.get(name, math.nan)} for name, value in self.rms.items()
        }

    def _tip_figures(self) -> "Sequence[Figure]":
        from .figures import tips

        return [tips([(path, self.predict(path)) for path in self.model.predictor.insertions])]

    @property
    def left_out(self) -> dict[str, float]:
        """Insertion -> root mean square lateral error of its prediction when it is left out of the fit [m]; linear in
        the parameters. Empty for one insertion."""
        return {name: error for name, (error, _) in self.model.predictor.left_out.items()}


def identify_paths(
    insertions: Sequence[TipPath],
    needle: core.Needle,
    *,
    model: str = "yielding",
    held: str = "guide",
    progress: Progress | None = None,
) -> SteeringFit:
    """Identify tissue, tip and guide from tip paths. ``nf.steering.identify`` calls it for ``TipPath``.

    Parameters
    ----------
    insertions : sequence of TipPath
        As ``nf.steering.read`` returns them, of one tissue.
    needle : Needle
        Its bending stiffness scales all forces and stiffnesses: tip paths alone give their ratios to it.
    model : str
        ``"linear"`` foundation, or ``"yielding"``: tissue that the shaft pushes aside beyond a force per length.
    held : str
        By a ``"guide"`` at a fixed distance, or at its ``"hub"``, which comes down with it.
    progress : callable, optional
        Called with the number of evaluations and the cost.

    Returns
    -------
    SteeringFit

    Raises
    ------
    InputError
        If the model is unknown, there is no insertion, the tip is not tracked for three rows, or it was recorded in
        another frame than the base.
    """
    if model not in MODELS:
        raise InputError("model", repr(model), "unknown", next_step=f"Give one of {', '.join(MODELS)}.")
    if not insertions or any(len(path) < 3 for path in insertions):
        limit = "needed with a tip in at least three rows each"
        raise InputError("insertions", len(insertions), limit, next_step="Give nf.steering.read(file).")
    check_frame(insertions)
    errors = PathErrors([readings_of(path) for path in insertions])

    def misfit(values: dict[str, float]) -> np.ndarray:
        parts = [residuals_of(simulated_path(values, path, needle=needle), path) for path in insertions]
        return errors.whitened(parts).ravel()

    deepest = max(float(path.depth.max()) for path in insertions)
    parameters = within_reach(held_at(MODELS[model], held), needle.length, deepest)
    found = search(parameters, misfit, progress)
    simulate = partial(simulated_path, needle=needle)
    predictor = PathPredictor(simulate, found.values, tuple(insertions), parameters, found.covariance)
    return SteeringFit(
        model=SteeringModel(model, found.values, needle, predictor),
        parameters=found.estimates,
        trade_offs=found.trade_offs,
        rms={path.name: predictor.rms(path) for path in insertions},
    )
