# SPDX-License-Identifier: Apache-2.0
"""How well an experiment repeats itself: each repeat beside the mean of the others."""

from dataclasses import dataclass

import numpy as np

from .one_layer.fit_recording import Single
from .span import STROKES, cycle_span, stroke_speed

SAME_DEPTH = 0.02  # of the deepest point: beyond, it is another motion
SAME_SPEED = 0.15
LEAST_OTHERS = 2


@dataclass(frozen=True, eq=False)
class Cycle:
    """One recording's cycle: samples (n,) of time [s], depth [m], force [N] and stroke (0 in, 1 at rest, 2 out)."""

    span: slice
    time: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    stroke: np.ndarray

    @property
    def peak(self) -> float:
        """Largest force [N]."""
        return float(np.abs(self.force).max())

    @property
    def speed(self) -> float:
        """Mean speed of the insertion [m/s]."""
        inwards = self.stroke == 0
        return stroke_speed(self.time[inwards], self.depth[inwards])

    def errors(self, predicted: np.ndarray) -> np.ndarray:
        """Rms error over the peak of a force (n,) [N]: whole cycle, insertion, hold, withdrawal; NaN where there is
        none."""
        squares = ((predicted - self.force) / self.peak) ** 2
        parts = [squares[self.stroke == k] for k in range(len(STROKES))]
        return np.sqrt([part.mean() if len(part) else np.nan for part in (squares, *parts)])


def cycle_of(single: Single) -> Cycle:
    """The first cycle that touches."""
    span, stroke = cycle_span(single.strokes, single.events)
    recording = single.recording
    return Cycle(span, recording.time[span], recording.depth[span], recording.force[span], stroke)


def mean_of_others(cycles: list[Cycle], left: int) -> np.ndarray:
    """Force (n,) [N] of the other repeats of the same motion at the samples of one: their mean by depth in the strokes,
    by time in the hold. NaN throughout with fewer than two such repeats."""
    own = cycles[left]
    others = [cycle for k, cycle in enumerate(cycles) if k != left and same_motion(own, cycle)]
    if len(others) < LEAST_OTHERS:
        return np.full(len(own.force), np.nan)
    return np.mean([_at(own, other) for other in others], axis=0)


def same_motion(one: Cycle, other: Cycle) -> bool:
    """True if both go as deep, as fast, and through the same strokes."""
    deep = abs(one.depth.max() - other.depth.max()) <= SAME_DEPTH * one.depth.max()
    fast = abs(one.speed - other.speed) <= SAME_SPEED * one.speed
    return bool(deep and fast and set(one.stroke) == set(other.stroke))


def _at(own: Cycle, other: Cycle) -> np.ndarray:
    """Force of another repeat where, or when, this one is."""
    found = np.empty(len(own.force))
    for k in range(len(STROKES)):
        here, there = own.stroke == k, other.stroke == k
        if not here.any():
            continue
        place, places = (own.depth[here], other.depth[there]) if k != 1 else _since(own.time[here], other.time[there])
        order = np.argsort(places, kind="stable")
        found[here] = np.interp(place, places[order], other.force[there][order])
    return found


def _since(time: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return time - time[0], others - others[0]
