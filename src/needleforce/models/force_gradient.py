# SPDX-License-Identifier: Apache-2.0
"""The force along a motion with its derivatives by the parameters of a model, and the places of its events."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from .. import core
from ..display.axes import DEPTH
from ..display.result import Result
from ..errors import InputError
from .laws import FAMILIES

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, eq=False)
class ForceEvent:
    """A contact, a puncture, the begin of slip, or a reversal, at a place that parameters move.

    Parameters
    ----------
    kind : str
        ``contact``, ``puncture``, ``slip`` or ``reversal``.
    layer : int
        Number of the layer, from 1.
    index : int
        The first sample that is at the event or past it.
    depth, jump : float
        Depth of the tip [m], and force after it less the force before [N].
    d_depth : ndarray, shape (p,)
        Derivative of the depth by each parameter. At the event itself the derivative of the force is a delta of
        ``-jump * d_depth``, at no sample.
    before, after : ndarray, shape (p,)
        Derivatives of the force at a fixed depth on both sides.
    """

    kind: str
    layer: int
    index: int
    depth: float
    jump: float
    d_depth: np.ndarray
    before: np.ndarray
    after: np.ndarray


@dataclass(frozen=True, eq=False, repr=False)
class ForceGradient(Result):
    """The force along a motion and its derivatives, of ``Model.force_gradient``.

    Parameters
    ----------
    depth, force : ndarray, shape (n,)
        Depth [m] and force [N].
    by : tuple of str
        Names of the parameters, such as ``friction.per_length``; of several layers ``layer 2 friction.per_length``.
    gradient : ndarray, shape (n, p)
        Derivative of each force by each parameter, in N over the unit of the parameter.
    events : tuple of ForceEvent
        In the order of the motion.
    """

    depth: np.ndarray
    force: np.ndarray
    by: tuple[str, ...]
    gradient: np.ndarray
    events: tuple[ForceEvent, ...]

    def column(self, name: str) -> np.ndarray:
        """The derivative of every force by one parameter, (n,); raises InputError for another name."""
        return self.gradient[:, _place(name, self.by)]

    def document(self) -> dict:
        """Depths, forces, derivatives and events in SI."""
        rows = [{**vars(event), **{k: getattr(event, k).tolist() for k in _COLUMNS}} for event in self.events]
        numbers = {"depth_m": self.depth.tolist(), "force_N": self.force.tolist()}
        return {**numbers, "by": list(self.by), "gradient": self.gradient.tolist(), "events": rows}

    def to_dataframe(self) -> "pandas.DataFrame":
        """Depth, force, and a column for each derivative."""
        import pandas

        columns = {"depth": self.depth, "force": self.force}
        return pandas.DataFrame({**columns, **{name: self.column(name) for name in self.by}})

    def _heading(self) -> str:
        return f"Force at {len(self.force)} depths and its derivatives by {len(self.by)} parameters"

    def _cells(self) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        largest = np.abs(self.gradient).max(axis=0, initial=0.0)
        rows = [(name, f"{scale:.4g}") for name, scale in zip(self.by, largest)]
        return ("parameter", "largest derivative [N per SI unit]"), rows

    def _remarks(self) -> Iterable[tuple[str, Iterable[str]]]:
        yield (
            "Events",
            (f"{e.kind} at {1e3 * e.depth:.4g} mm, the force changes by {e.jump:.3g} N" for e in self.events),
        )

    def _draw(self, axes: Any) -> tuple[str, ...]:
        largest = np.abs(self.gradient).max(axis=0, initial=0.0)
        for name, scale, column in zip(self.by, largest, self.gradient.T):
            if scale > 0.0:
                axes.plot(1e3 * self.depth, column / scale, lw=1.0, label=name)
        return DEPTH, "derivative over its largest", self.heading()


_COLUMNS = ("d_depth", "before", "after")


def force_gradient(
    stack: list[tuple[float, core.Laws]], depth: ArrayLike, time: ArrayLike, by: Sequence[str] | str | None = None
) -> ForceGradient:
    """See ``Model.force_gradient``; ``stack`` has the layers for the core."""
    depths, steps = _motion(depth, time)
    places = {_name(at, len(stack)): at[:3] for at in core.gradient_parameters(stack)}
    one = isinstance(by, str) or not isinstance(by, Iterable)
    names = tuple(places) if by is None else (by,) if one else tuple(by)
    for name in names:
        _place(name, tuple(places))
    force, gradient, events = core.force_gradient(stack, depths, steps, [places[name] for name in names])
    return ForceGradient(depths, force, names, gradient, tuple(map(_event, events)))


def _event(row: tuple) -> ForceEvent:
    kind, layer, index, depth, jump, *columns = row
    rates = dict(zip(_COLUMNS, np.array(columns, dtype=float)))
    return ForceEvent(kind=kind, layer=layer + 1, index=index, depth=depth, jump=jump, **rates)


def _name(at: tuple, layers: int) -> str:
    layer, part, _, name = at
    within = f"{FAMILIES[part]}.{name}" if part < len(FAMILIES) else name
    return f"layer {layer + 1} {within}" if layers > 1 else within


def _place(name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        limit = "no parameter of this model"
        other = "for a tip, a bevel, a needle that bends or a solid, compare the forces of two models"
        step = f"Give one of {', '.join(names)}; {other}."
        raise InputError("by", repr(name), limit, next_step=step)
    return names.index(name)


def _numbers(name: str, values: ArrayLike) -> np.ndarray:
    try:
        return np.ascontiguousarray(values, dtype=float)
    except (TypeError, ValueError):
        step = "Give a number for each sample, in SI."
        raise InputError(name, type(values).__name__, "must be one row of numbers", next_step=step) from None


def _motion(depth: ArrayLike, time: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Depths, and the time of each step [s]; the first has the length of the second."""
    depths, times = (_numbers(name, values) for name, values in (("depth", depth), ("time", time)))
    if depths.ndim != 1 or depths.shape != times.shape or len(depths) < 2:
        shapes = f"{depths.shape} and {times.shape}"
        raise InputError(
            "shapes of depth and time", shapes, "not the same (n,), n >= 2", next_step="Give one for each."
        )
    for name, values, limit in (("depth", depths, 1.0), ("time", times, np.finfo(float).max)):
        if values.min() >= -limit and values.max() <= limit:
            continue  # what is not a number fails both
        at = int(np.flatnonzero(~(np.abs(values) <= limit))[0])
        reason = "beyond 1 m" if np.isfinite(values[at]) else "not finite"
        raise InputError(f"{name}[{at}]", values[at], reason, next_step="Leave the sample out, or give it in SI.")
    steps = np.diff(times)
    if not (steps > 0.0).all():
        at = int(np.flatnonzero(~(steps > 0.0))[0]) + 1
        raise InputError(
            f"time[{at}]", times[at], "not after the sample before", next_step="Give times that grow, in s."
        )
    return depths, np.concatenate([steps[:1], steps])
