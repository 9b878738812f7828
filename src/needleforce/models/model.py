# SPDX-License-Identifier: Apache-2.0
"""A model with values: one law for each part of the force in each layer, next to the needle and tissue they come
from."""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .. import core
from ..errors import InputError
from ..mechanics.validity import crossed_limits
from ..references import citations
from .laws import FAMILIES
from .named_models import laws_with_values, named_model


@dataclass(frozen=True)
class Layer:
    """One law for each part of the force, from the depth ``top`` [m] below the undeformed surface on.

    The puncture is counted from the layer's top; a puncture depth or force of 0 is an interface that does not resist.
    """

    top: float
    stiffness: Any
    puncture: Any
    friction: Any
    cutting: Any
    relaxation: Any = field(default_factory=core.laws.NoRelaxation)

    def __post_init__(self):
        for family, law in zip(FAMILIES, self.parts):
            if getattr(law, "family", None) != family:
                raise InputError(family, repr(law), f"not a law of {family}", next_step="Give one of nf.laws.")
        if isinstance(self.top, bool) or not isinstance(self.top, (int, float)):
            raise InputError("layer.top", repr(self.top), "not a number", next_step="Give the depth in m.")

    @property
    def parts(self) -> tuple:
        """The five laws."""
        return (self.stiffness, self.puncture, self.friction, self.cutting, self.relaxation)

    @property
    def laws(self):
        """The five laws as the core takes them."""
        return core.Laws(*self.parts)


@dataclass(frozen=True)
class Model:
    """Laws for stiffness, puncture, friction, cutting and relaxation; where they come from; and what is doubtful.

    ``needle`` and ``tissue`` are None where the laws were given without them, as after identification from a log
    alone. ``deeper`` are further layers, from the second down. Raises InputError for laws that contradict each other
    or count a mechanism twice, and for layers that overlap or are out of order.
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
    relaxation: Any = field(default_factory=core.laws.NoRelaxation)
    deeper: tuple[Layer, ...] = ()
    unverified: tuple[str, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "deeper", tuple(self.deeper))
        for number, layer in enumerate(self.layers, 1):
            if not isinstance(layer, Layer):
                raise InputError(f"layer {number}", repr(layer), "not a Layer", next_step="Give nf.Layer(top=…, …).")
        core.check_layers(self.stack)

    @classmethod
    def named(cls, name: str, *, needle=None, tissue=None, deeper: tuple[Layer, ...] = (), **values) -> "Model":
        """A model by its name, as ``maurin``, with values: ``stiffness={"rate": 500.0, "scale": 0.05}`` and so on for
        puncture, friction, cutting, relaxation, in SI.

        Parameters not given are taken from ``needle`` and ``tissue`` as in preset files, else from the law's defaults.
        ``deeper`` are further layers. Raises InputError for an unknown name, part or parameter, and for a value that
        is missing or outside its range.
        """
        laws = laws_with_values(name, values, needle, tissue)
        summary = named_model(name).summary
        return cls(**laws, name=name, summary=summary, needle=needle, tissue=tissue, deeper=deeper)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """Every layer from the surface down, the first at depth 0."""
        first = Layer(0.0, self.stiffness, self.puncture, self.friction, self.cutting, self.relaxation)
        return (first, *self.deeper)

    @property
    def stack(self) -> list:
        """The layers as the core takes them: (top [m], laws)."""
        return [(layer.top, layer.laws) for layer in self.layers]

    @property
    def laws(self):
        """The first layer's laws as the core takes them."""
        return self.layers[0].laws

    @property
    def puncture_depth(self) -> float:
        """Depth of the tip at the first puncture [m], whatever the criterion; where the contact relaxes, the least."""
        return self.laws.puncture_depth

    @property
    def warnings(self) -> tuple[str, ...]:
        """The limits of validity this model crosses, and what in it is unverified, in plain words."""
        return crossed_limits(self)

    @property
    def citations(self) -> tuple[str, ...]:
        """Full references of every law and parameter used, after the model's own reference."""
        return citations(self)

    def replace(self, **changes) -> "Model":
        """A copy with the given laws or values changed."""
        return dataclasses.replace(self, **changes)

    def force(self, depth, velocity=None, out=None) -> np.ndarray:
        """Force [N] while sliding at each depth (n,) [m]: the paper's complete model of a first insertion, without
        memory.

        ``velocity`` (n,) [m/s] gives the direction, >= 0 inwards, and the rate terms; None is slow insertion
        throughout. ``out`` (n,) float64 is written and returned where given. For holds, reversals, second insertions,
        relaxation and layers run an ``Insertion``. Raises InputError for unequal lengths and for models whose force
        needs memory; a depth or velocity that is NaN gives NaN.
        """
        if self.deeper:
            raise InputError("layers", len(self.layers), "more than one", next_step="Run an Insertion.")
        depth = np.ascontiguousarray(depth, dtype=float)
        velocity = None if velocity is None else np.ascontiguousarray(velocity, dtype=float)
        out = np.empty_like(depth) if out is None else out
        self.laws.sliding_force(depth, velocity, out)
        return out


class Insertion(core.Insertion):
    """The simulated insertion: ``step(depth, velocity, dt) -> Sample``, ``reset()``, ``snapshot()``, ``restore()``,
    ``run(...)``.

    ``max_speed`` [m/s]: a depth that moved faster is refused. ``hold_time`` [s], at most 1: how long a refused step
    keeps the last force before it falls to 0. A step never raises; its ``status`` says what was wrong. ``bevel``, as
    ``needleforce.core.Bevel(half_angle, friction_coefficient, face_share)``, gives each sample a ``lateral`` force [N].
    ``save()`` gives the memory as bytes, which ``restore()`` takes as it takes a snapshot.
    """

    def __init__(
        self, model: Model, *, max_speed: float = 1.0, hold_time: float = 0.0, bevel: core.Bevel | None = None
    ):
        if not isinstance(model, Model):
            raise InputError(
                "model", type(model).__name__, "not a Model", next_step="Give nf.preset(…) or nf.Model(…)."
            )
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time)
        super().__init__(model.stack, limits, bevel or core.Bevel())
        self.model = model

    def snapshot(self) -> "Insertion":
        """A copy, state included: step it on its own, or ``restore`` it later."""
        copy = Insertion(self.model)
        copy.restore(self)
        return copy
