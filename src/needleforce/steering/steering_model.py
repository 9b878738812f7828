# SPDX-License-Identifier: Apache-2.0
"""An identified steered needle: what simulates it, and what predicts its tip."""

import math
from dataclasses import dataclass, field
from typing import Any

from .. import core
from ..models.flexible_insertion import FlexibleInsertion
from .path_prediction import PathPredictor
from .path_simulation import SimulatedPath, guide_of, lateral_layers, simulated_path
from .tip_paths import TipPath


@dataclass(frozen=True)
class SteeringModel:
    """An identified steered needle.

    Attributes
    ----------
    form : str
        ``"linear"`` or ``"yielding"``.
    values : dict of str to float
        Value of each identified parameter, in SI.
    needle : Needle
        The needle with which it was identified.
    predictor : PathPredictor, optional
        What predicts other insertions, with what the mechanics leave unexplained.
    """

    form: str
    values: dict[str, float]
    needle: core.Needle
    predictor: PathPredictor | None = field(default=None, repr=False, compare=False)

    @property
    def roll(self) -> float:
        """Direction of the tip's lateral force at the roll of the insertions [rad], from x towards y."""
        return math.atan2(self.values["tip_force_y"], self.values["tip_force_x"])

    def insertion(self, **options: Any) -> FlexibleInsertion:
        """A needle in space with the identified tissue and guide; ``roll`` is the roll at which it was inserted.

        Parameters
        ----------
        **options : object
            Of ``FlexibleInsertion``, such as ``elements``.

        Returns
        -------
        FlexibleInsertion
        """
        force = math.hypot(self.values["tip_force_x"], self.values["tip_force_y"])
        layers = lateral_layers(self.values, force)
        return FlexibleInsertion(None, self.needle, lateral=layers, **(guide_of(self.values, self.needle) | options))

    def simulated(self, path: TipPath) -> SimulatedPath:
        """Tip and slope for the motion of the base of an insertion, before its pose."""
        return simulated_path(self.values, self.needle, path)
