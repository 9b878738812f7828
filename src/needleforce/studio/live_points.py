# SPDX-License-Identifier: Apache-2.0
"""Points of a curve that is drawn while it is measured: never more than a limit, with the lowest and the highest force
of each stretch, and every reading counted. And the model's force next to each reading."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence

import numpy as np

from ..models.model import Insertion, Model

Point = tuple[float, float | None, float, float | None]  # time [s], depth [m], force [N], the model's force [N]
MAX_WAIT = 0.1  # [s] that a reading waits for the next state of the axis, which decides its depth
_STRETCH = 4  # points of which two remain


class Points:
    """At most ``limit`` points, and how many ``readings`` they stand for."""

    def __init__(self, limit: int, points: Iterable[Point] = (), readings: int = 0):
        self.limit, self.points, self.readings = limit, list(points), readings

    def add(self, points: Sequence[Point], readings: int) -> None:
        """Add points that stand for so many readings; where they become too many, a half of all remains."""
        self.points += points
        self.readings += readings
        while len(self.points) > self.limit:
            self.points = _reduced(self.points)

    def take(self) -> tuple[list[Point], int]:
        """The points since the last call, and the readings that they stand for."""
        taken = self.points, self.readings
        self.points, self.readings = [], 0
        return taken


def _reduced(points: list[Point]) -> list[Point]:
    """Of each stretch the lowest and the highest force, in order of time."""
    kept: list[Point] = []
    for start in range(0, len(points), _STRETCH):
        stretch = points[start : start + _STRETCH]
        order = sorted(range(len(stretch)), key=lambda k: stretch[k][2])
        kept += [stretch[k] for k in sorted({order[0], order[-1]})]
    return kept


class Along:
    """Depth and the model's force at each reading, between two states of the axis.

    ``surface`` [m] is the depth at which the model's tissue begins.
    """

    def __init__(self, model: Model | None, surface: float = 0.0):
        self._insertion, self._surface = None if model is None else Insertion(model), surface
        self._states: list[tuple[float, float, float]] = []  # time, depth, the model's force
        self._waiting: list[tuple[float, float]] = []  # times and forces of readings after the newest state

    def add(self, readings: list[tuple[float, float]], states: list[tuple[float, float]]) -> list[Point]:
        """The points that are complete now, from readings (time, force) and states (time, depth)."""
        for time, depth in states:
            if not self._states or time > self._states[-1][0]:
                self._states.append((time, depth, self._force(time, depth)))
        self._waiting = sorted(self._waiting + readings)  # a late one takes its place
        newest = self._states[-1][0] if self._states else -np.inf
        late = self._waiting[-1][0] - MAX_WAIT if self._waiting else -np.inf
        ready = [each for each in self._waiting if each[0] <= max(newest, late)]
        self._waiting = self._waiting[len(ready) :]
        return self._points(ready)

    def rest(self) -> list[Point]:
        """The points of the readings that still wait."""
        waiting, self._waiting = self._waiting, []
        return self._points(waiting)

    def _force(self, time: float, depth: float) -> float:
        if self._insertion is None:
            return np.nan
        dt = time - self._states[-1][0] if self._states else 1e-3
        return self._insertion.step(depth - self._surface, None, dt).force

    def _points(self, readings: list[tuple[float, float]]) -> list[Point]:
        if not readings or not self._states:
            return [(time, None, force, None) for time, force in readings]
        times = [time for time, _ in readings]
        at, depths, forces = zip(*self._states)
        self._states = self._states[max(0, bisect_right(at, times[-1]) - 1) :]
        depth, model = np.interp(times, at, depths).tolist(), np.interp(times, at, forces).tolist()
        known = self._insertion is not None
        return [(t, z, f, m if known else None) for (t, f), z, m in zip(readings, depth, model)]
