# SPDX-License-Identifier: Apache-2.0
"""A model with values: one law for each part of the force, beside the needle and tissue they come from."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import core
from .validity import crossed_limits


@dataclass(frozen=True)
class Model:
    """Laws for stiffness, puncture, friction and cutting; where they come from; and what is doubtful about them.

    ``needle`` and ``tissue`` are None where the laws were given without them, as after identification from a log alone.
    """

    stiffness: Any
    puncture: Any
    friction: Any
    cutting: Any
    name: str = "model"
    summary: str = ""
    reference: str = ""
    doubts: tuple[str, ...] = ()
    needle: Any = None
    tissue: Any = None

    @property
    def laws(self):
        """The four laws as the core takes them."""
        return core.Laws(self.stiffness, self.puncture, self.friction, self.cutting)

    @property
    def puncture_depth(self) -> float:
        """Depth of the tip at puncture [m], whatever the criterion."""
        return self.laws.puncture_depth

    @property
    def warnings(self) -> tuple[str, ...]:
        """The limits of validity this model crosses, in plain words."""
        return crossed_limits(self)

    def replace(self, **changes) -> "Model":
        """A copy with the given laws or values changed."""
        return dataclasses.replace(self, **changes)

    def force(self, depth, velocity=None, out=None) -> np.ndarray:
        """Force [N] while sliding at each depth (n,) [m]: the paper's complete model of a first insertion, without
        memory.

        ``velocity`` (n,) [m/s] gives the direction, >= 0 inwards; None is insertion throughout. ``out`` (n,) float64 is
        written and returned where given. For holds, reversals and second insertions run an ``Insertion``. Raises
        InputError for unequal lengths; a depth or velocity that is NaN gives NaN.
        """
        depth = np.ascontiguousarray(depth, dtype=float)
        velocity = None if velocity is None else np.ascontiguousarray(velocity, dtype=float)
        out = np.empty_like(depth) if out is None else out
        self.laws.sliding_force(depth, velocity, out)
        return out


class Insertion(core.Insertion):
    """The simulated insertion: ``step(depth, velocity, dt) -> Sample``, ``reset()``, ``snapshot()``, ``restore()``,
    ``run(...)``.

    ``max_speed`` [m/s]: a depth that moved faster is refused. ``hold_time`` [s]: how long a refused step keeps the
    last force before it falls to 0. A step never raises; its ``status`` says what was wrong.
    """

    def __init__(self, model: Model, *, max_speed: float = 1.0, hold_time: float = 0.0):
        super().__init__(model.laws, max_speed, hold_time)
        self.model = model

    def snapshot(self) -> "Insertion":
        """A copy, state included: step it on its own, or ``restore`` it later."""
        copy = Insertion(self.model)
        copy.restore(self)
        return copy
