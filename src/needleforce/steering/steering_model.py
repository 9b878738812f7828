# SPDX-License-Identifier: Apache-2.0
"""A steered needle, identified or given: what simulates it, and what predicts its tip."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..models.flexible_insertion import FlexibleInsertion
from ..models.model import Model
from .base_motion import Replays, base_moves, replay_of, rows_of
from .path_prediction import PathPredictor
from .path_simulation import SimulatedPath, bevel_direction, guide_of, lateral_layers, simulated_path, tip_force_of
from .steering_parameters import Parameter
from .tip_paths import TipPath
from .tissue_prior import TissuePrior


@dataclass(frozen=True)
class SteeringModel:
    """An identified steered needle.

    Attributes
    ----------
    form : str
        ``"linear"`` or ``"yielding"``; ``"given"`` for a ``FlexibleInsertion`` that was not identified.
    values : dict of str to float
        Value of each identified parameter, in SI.
    needle : Needle
        The needle with which it was identified.
    predictor : PathPredictor
        What predicts other insertions, with what the mechanics leave unexplained.
    given : FlexibleInsertion or None
        The insertion whose parameters are given; None for an identified needle.
    """

    form: str
    values: dict[str, float]
    needle: core.Needle
    predictor: PathPredictor = field(repr=False, compare=False)
    given: FlexibleInsertion | None = field(default=None, repr=False, compare=False)

    @property
    def identified(self) -> bool:
        """False for a ``FlexibleInsertion`` whose parameters are given."""
        return self.given is None

    @property
    def roll(self) -> float:
        """Direction of the tip's lateral force at the roll of the insertions [rad], from x towards y."""
        return bevel_direction(self.values) if self.values else 0.0

    def insertion(self, axial: Model | None = None, **options: Any) -> FlexibleInsertion:
        """A needle in space with the identified tissue and guide, or the given insertion; ``roll`` is the roll at which
        it was inserted.

        Parameters
        ----------
        axial : Model, optional
            Laws of the axial force.
        **options : object
            Of ``FlexibleInsertion``, such as ``elements``.

        Returns
        -------
        FlexibleInsertion
        """
        if self.given is not None:
            return self.given
        layers = lateral_layers(self.values, tip_force_of(self.values))
        return FlexibleInsertion(axial, self.needle, lateral=layers, **(guide_of(self.values, self.needle) | options))

    def simulated(self, path: TipPath, axial: Model | None = None, replays: Replays | None = None) -> SimulatedPath:
        """Tip, slope and wrench for the motion of the base of an insertion, before its pose; with the axial force of
        a model, if one is given. ``replays``, an empty dictionary at first, makes similar motions faster."""
        if axial is None:
            return self.predictor.simulate(self.values, path, replays=replays)
        return simulated_path(self.values, path, needle=self.needle, axial=axial, replays=replays)


def identified_model(
    form: str,
    needle: core.Needle,
    values: dict[str, float],
    *,
    parameters: Sequence[Parameter],
    covariance: np.ndarray,
    insertions: tuple[TipPath, ...] = (),
    prior: TissuePrior | None = None,
) -> SteeringModel:
    """A needle with the values that were identified, and what predicts its tip from the insertions of the fit."""
    simulate = partial(simulated_path, needle=needle)
    predictor = PathPredictor(
        simulate, values, insertions=insertions, parameters=parameters, covariance=covariance, prior=prior
    )
    return SteeringModel(form, values, needle, predictor)


def steering_model(model: SteeringModel | FlexibleInsertion, axial: Model | None = None) -> SteeringModel:
    """The model itself, or one around an insertion whose parameters are given; its unexplained errors are those of
    gels, and its state is lost. Raises InputError if the model is neither, or laws of the axial force are given for an
    insertion that has its own."""
    if isinstance(model, SteeringModel):
        return model
    if not isinstance(model, FlexibleInsertion):
        step = "Give found.model of nf.steering.identify, or nf.FlexibleInsertion(…)."
        raise InputError("model", type(model).__name__, "not a steering model", next_step=step)
    if axial is not None:
        step = "Give nf.FlexibleInsertion(model, …) instead."
        raise InputError("axial", axial.name, "a given insertion has its own", next_step=step)
    return SteeringModel("given", {}, model.needle, PathPredictor(partial(_given_path, flex=model), {}), model)


def _given_path(
    values: dict[str, float], path: TipPath, *, flex: FlexibleInsertion, replays: Replays | None = None
) -> SimulatedPath:
    depth = np.maximum.accumulate(np.maximum(path.depth, 0.0))
    return SimulatedPath(depth=depth, **rows_of(replay_of(replays, "given", lambda: flex), base_moves(depth, path)))
