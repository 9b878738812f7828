# SPDX-License-Identifier: Apache-2.0
"""A model: one law for each part of the force in each layer, with the needle and tissue they are derived from."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..checks import instance_of
from ..display.result import Printed
from ..display.tables import PARAMETER_HEAD, named_rows
from ..errors import InputError
from ..references import citations
from .force_gradient import ForceGradient, force_gradient
from .laws import FAMILIES
from .named_models import laws_with_values, named_model
from .validity import crossed_limits


@dataclass(frozen=True)
class Layer:
    """One layer of tissue: a law for each part of the force.

    Parameters
    ----------
    top : float
        Depth below the undeformed surface at which the layer begins [m].
    stiffness, puncture, friction, cutting, relaxation : law
        One of ``nf.laws`` for each part of the force; the default relaxation is none. The puncture depth is measured
        from the layer's top; a puncture depth or force of 0 is an interface without resistance.

    Raises
    ------
    InputError
        If a law is not of its family, or ``top`` is not a number.
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

    def replace(self, **changes: Any) -> "Layer":
        """A copy with the given laws, or another top."""
        return dataclasses.replace(self, **changes)

    @property
    def laws(self) -> core.Laws:
        """The five laws as one value of the core."""
        return core.Laws(*self.parts)


@dataclass(frozen=True, repr=False)
class Model(Printed):
    """Laws with parameter values for every part of the force, with their reference and their doubtful values.

    Parameters
    ----------
    stiffness, puncture, friction, cutting, relaxation : law
        The laws of the first layer, one of ``nf.laws`` for each; the default relaxation is none.
    name, summary, reference : str
        Name, one sentence, and source of the parameter values.
    doubts, unverified : tuple of str
        What is doubtful, and which values were not verified.
    needle, tissue : Needle, Tissue, optional
        None if the laws were given without them, as after identification from a force–depth log only.
    deeper : tuple of Layer
        Further layers, from the second down.

    Raises
    ------
    InputError
        If laws contradict each other or include the same mechanism twice, or if layers overlap or are out of order.
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
    def named(
        cls,
        name: str,
        *,
        needle: core.Needle | None = None,
        tissue: core.Tissue | None = None,
        deeper: tuple[Layer, ...] = (),
        **values: dict[str, Any],
    ) -> "Model":
        """A model by its name, which selects the laws, with parameter values.

        Parameters
        ----------
        name : str
            Name of a model, such as ``"maurin"``.
        needle, tissue : Needle, Tissue, optional
            Parameters that are not given are derived from them as in preset files, otherwise the law's default is used.
        deeper : tuple of Layer
            Further layers.
        **values : dict
            Parameters in SI for each part of the force, such as ``stiffness={"rate": 500.0, "scale": 0.05}``; the parts
            are stiffness, puncture, friction, cutting and relaxation.

        Returns
        -------
        Model

        Raises
        ------
        InputError
            If a name, part or parameter is unknown, or a value is missing or outside its range.
        """
        laws = laws_with_values(name, values, needle, tissue)
        summary = named_model(name).summary
        return cls(**laws, name=name, summary=summary, needle=needle, tissue=tissue, deeper=deeper)

    @property
    def layers(self) -> tuple[Layer, ...]:
        """Every layer from the surface down, the first at depth 0."""
        laws = {family: getattr(self, family) for family in FAMILIES}
        return (Layer(top=0.0, **laws), *self.deeper)

    @property
    def stack(self) -> list[tuple[float, core.Laws]]:
        """The layers for the core: (top [m], laws)."""
        return [(layer.top, layer.laws) for layer in self.layers]

    @property
    def laws(self) -> core.Laws:
        """The first layer's laws as one value of the core."""
        return self.layers[0].laws

    @property
    def puncture_depth(self) -> float:
        """Depth of the tip at the first puncture [m] for any criterion; the smallest one if the contact relaxes."""
        return self.laws.puncture_depth

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence for each limit of validity that this model crosses and for its unverified values."""
        return crossed_limits(self)

    @property
    def citations(self) -> tuple[str, ...]:
        """Full references: the model's own, then those of every law and parameter used."""
        return citations(self)

    def replace(self, **changes: Any) -> "Model":
        """A copy with the given laws or other fields changed."""
        return dataclasses.replace(self, **changes)

    def force(self, depth: ArrayLike, velocity: ArrayLike | None = None, out: np.ndarray | None = None) -> np.ndarray:
        """Force while sliding in a first insertion, without memory: the source paper's complete model.

        For holds, reversals, second insertions, relaxation and layers run an ``Insertion``.

        Parameters
        ----------
        depth : array_like, shape (n,)
            Depth [m].
        velocity : array_like, shape (n,), optional
            Velocity [m/s]: its sign is the direction, at least 0 for insertion, and its value enters the rate terms.
            Default: slow insertion.
        out : ndarray of float64, shape (n,), optional
            Array that is written and returned.

        Returns
        -------
        ndarray, shape (n,)
            Force [N]; NaN where the depth or the velocity is NaN.

        Raises
        ------
        InputError
            If the lengths differ, or the force of the model depends on memory or on several layers.
        """
        if self.deeper:
            limit = "this function supports one layer only"
            raise InputError("layers", len(self.layers), limit, next_step="Run an Insertion.")
        depth = np.ascontiguousarray(depth, dtype=float)
        velocity = None if velocity is None else np.ascontiguousarray(velocity, dtype=float)
        out = np.empty_like(depth) if out is None else out
        self.laws.sliding_force(depth, velocity, out)
        return out

    def force_gradient(self, depth: ArrayLike, time: ArrayLike, by: Sequence[str] | str | None = None) -> ForceGradient:
        """The force along a motion, with memory, and its derivatives by the parameters of every law.

        They come from the steps of an ``Insertion`` and hold through contact, puncture, reversal and rest.

        Parameters
        ----------
        depth, time : array_like, shape (n,)
            Depth of the tip past the undeformed surface [m], and time [s].
        by : sequence of str, optional
            Names such as ``"friction.per_length"``, of several layers ``"layer 2 friction.per_length"``; the default is
            every parameter.

        Returns
        -------
        ForceGradient
            With ``force``, ``by``, ``gradient`` and ``events``.

        Raises
        ------
        InputError
            If the motion is not possible, or no law has the parameter: the message lists those that are there.
        """
        return force_gradient(self.stack, depth, time, by)

    def plot(self, axes: Any = None, *, depth: float | None = None, speed: float = 3e-3) -> Any:
        """Draw the force of an insertion and its withdrawal over depth, with its parts during insertion.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; the default is a new figure.
        depth : float, optional
            Deepest point [m]; the default is twice the depth of the deepest puncture.
        speed : float
            Of both strokes [m/s].

        Returns
        -------
        matplotlib.axes.Axes
        """
        from ..display.axes import DEPTH, FORCE, axes_for, finish

        deepest = self._plotted_depth() if depth is None else float(depth)
        inwards = np.linspace(-0.1 * deepest, deepest, 1000)
        places = np.concatenate([inwards, inwards[-2::-1]])
        step = float(inwards[1] - inwards[0]) / speed
        run = Insertion(self, max_speed=np.inf).run(places, None, np.full(len(places), step))
        axes, stroke = axes_for(axes), slice(0, len(inwards))
        axes.plot(1e3 * places, run["force"], color="black", lw=1.4, label="force")
        for part in ("stiffness", "friction", "cutting"):
            axes.plot(1e3 * inwards, run[part][stroke], lw=1.0, ls="--", label=part)
        return finish(axes, DEPTH, FORCE, self.name)

    def _plotted_depth(self) -> float:
        """Twice the depth of the deepest puncture [m]; 20 mm if there is none within 50 mm."""
        punctures = [layer.top + layer.laws.puncture_depth for layer in self.layers]
        deepest = 2.0 * max((each for each in punctures if np.isfinite(each)), default=0.0)
        return deepest if 0.0 < deepest <= 0.15 else 20e-3

    def _parts(self) -> list[tuple[str, Any]]:
        """Every law with its name; those of several layers with the number of the layer."""
        several = len(self.layers) > 1
        return [
            (f"layer {number} {family}" if several else family, getattr(layer, family))
            for number, layer in enumerate(self.layers, 1)
            for family in FAMILIES
        ]

    def __repr__(self) -> str:
        layers = f", {len(self.layers)} layers" if self.deeper else ""
        laws = ", ".join(getattr(self, family).name for family in FAMILIES)
        return f"<Model {self.name}{layers}: {laws}>"

    def _heading(self) -> str:
        return ": ".join(text for text in (f"Model {self.name}", self.summary) if text)

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        return PARAMETER_HEAD, named_rows(self._parts())

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield "Doubts", self.doubts


class Insertion(core.Insertion):
    """A simulated insertion, stepped one cycle at a time.

    Methods: ``step(depth, velocity, dt) -> Sample``, ``run(depth, velocity, dt)`` over arrays, ``forces(depth, dt)``
    for the force alone, ``reset()``, ``snapshot()``, ``restore(snapshot)``, and ``save()``, which returns the memory as
    bytes for ``restore``. A step never raises; the ``status`` of its sample reports invalid input. While another
    thread is in ``run`` or ``forces``, every call raises: use an insertion for each thread.

    Parameters
    ----------
    model : Model
        The model.
    max_speed : float
        Largest speed between two steps [m/s], above 0; a faster step is refused.
    hold_time : float
        How long a refused step keeps the last force before it becomes 0 [s], 0 to 1.
    depth_noise : float
        Half the range of the measured depth while the needle rests [m], 0 to 1e-3, as ``depth_noise`` finds it. A hold
        then keeps its force; a reversal is felt later by twice as much travel.
    bevel : core.Bevel, optional
        Half angle [rad], friction coefficient and face share of a bevel: each sample then has a ``lateral`` force [N].

    Raises
    ------
    InputError
        If the model is not a ``Model``, or a limit is outside its range.
    """

    def __init__(
        self,
        model: Model,
        *,
        max_speed: float = 1.0,
        hold_time: float = 0.0,
        depth_noise: float = 0.0,
        bevel: core.Bevel | None = None,
    ):
        instance_of("model", model, Model, "Give nf.preset(…) or nf.Model(…).")
        limits = core.Limits(max_speed=max_speed, hold_time=hold_time, depth_noise=depth_noise)
        super().__init__(model.stack, limits, bevel or core.Bevel())
        self.model = model

    def snapshot(self) -> "Insertion":
        """A copy with its state, which can be stepped independently or passed to ``restore``."""
        copy = Insertion(self.model)
        copy.restore(self)
        return copy

    def __repr__(self) -> str:
        return f"<Insertion of {self.model!r}>"


def solid_engine(
    model: Model | None, tissue: Any, limits: core.Limits | None = None, bevel: core.Bevel | None = None
) -> core.CondensedInsertion:
    """An insertion of a model, whose friction and cutting drag the solid, into an ``nf.fe.CondensedTissue``. ``bevel``
    is for the lateral force on the tip. Raises InputError if there is no model, the tissue is not condensed, or a law
    does not fit."""
    if model is None:
        step = "Give a model: its friction and cutting drag the solid."
        raise InputError("model", None, "needed with a tissue", next_step=step)
    if not hasattr(tissue, "bonded_stiffness"):
        step = "Give tissue.condense(path), or nf.fe.load_condensed(file)."
        raise InputError("tissue", type(tissue).__name__, "not a CondensedTissue", next_step=step)
    return core.CondensedInsertion(
        tissue.spacing, tissue.compliance, model.stack, limits or core.Limits(), bevel or core.Bevel()
    )
