# SPDX-License-Identifier: Apache-2.0
"""The straight part of a curve that also seats, yields or breaks: the steepest one that a line describes within the
noise of the readings."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ..identification.statistics.curve_noise import CurveNoise
from ..identification.statistics.evidence import Departure, departure, long_run

MAX_EDGES = 41  # places at which a part may begin and end
MIN_PART_READINGS = 8
MIN_RISE = 0.1  # of the range of the readings: a smaller part may be a step or a slip
STEEPER_SIGMA = 4.0  # [standard errors] by which a shorter part is steeper, so that it counts
SMOOTH_CHANGE = 0.2  # of the slope from one part to the next: more is another regime, such as a toe or yielding
TRIM = 0.2  # of a part, left out at an end where the curve continues: it is found late that the line does not


@dataclass(frozen=True, kw_only=True)
class StraightPart:
    """Readings ``first`` up to ``last`` of a curve, the ``slope`` of their line with its standard ``error``, and their
    ``departure`` from it, which is found only where no part is straight; ``near`` are the slopes of as many readings
    before and after, where they differ little: of a curve that bends throughout."""

    first: int
    last: int
    slope: float
    error: float
    departure: Departure
    near: tuple[float, ...] = ()

    @property
    def used(self) -> slice:
        """Its readings."""
        return slice(self.first, self.last)


def straight_part(x: np.ndarray, y: np.ndarray, noise: CurveNoise) -> StraightPart:
    """The straight part of (n,) readings y over rising x.

    Of the parts that a line describes within the noise and that rise by a tenth of all readings, the one that rises
    furthest, unless a shorter one is steeper by four standard errors: toe and yielding are less steep than the part
    between them (ASTM D790, toe compensation). Without such a part it is all readings.
    """
    straight = [each for each in _parts(x, y, noise) if not each.departure.found]
    best: StraightPart | None = None
    while straight:
        best = max(straight, key=lambda each: each.slope * float(x[each.last - 1] - x[each.first]))
        limits = [best.slope + STEEPER_SIGMA * float(np.hypot(best.error, each.error)) for each in straight]
        straight = [each for each, limit in zip(straight, limits, strict=True) if each.slope > limit]
    if best is None:
        return _part(x, y, noise, 0, len(x))
    size = best.last - best.first
    first = best.first + int(TRIM * size) * (best.first > 0)
    last = best.last - int(TRIM * size) * (best.last < len(x))
    part = _part(x, y, noise, first, last) if last - first >= MIN_PART_READINGS else best
    return replace(part, near=tuple(_near(x, y, best)))


def _near(x: np.ndarray, y: np.ndarray, part: StraightPart) -> Iterator[float]:
    size = part.last - part.first
    for first, last in ((max(part.first - size, 0), part.first), (part.last, min(part.last + size, len(x)))):
        if last - first >= MIN_PART_READINGS:
            slope = float(np.polyfit(x[first:last], y[first:last], 1)[0])
            if abs(slope / part.slope - 1.0) < SMOOTH_CHANGE:
                yield slope


def _parts(x: np.ndarray, y: np.ndarray, noise: CurveNoise) -> Iterator[StraightPart]:
    """The parts between two edges that rise enough."""
    edges = _edges(x, y)
    smallest = MIN_RISE * float(np.ptp(y))
    for k, first in enumerate(edges):
        for last in edges[k + 1 :]:
            if last - first >= MIN_PART_READINGS:
                part = _part(x, y, noise, int(first), int(last))
                if part.slope * float(x[last - 1] - x[first]) > smallest:
                    yield part


def _edges(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Places in equal steps of x and of the rise of y together: a short steep part has as many as a long one."""
    size = max(len(y) // (4 * MAX_EDGES), 1)
    smooth = np.convolve(np.pad(y, (size // 2, size - 1 - size // 2), mode="edge"), np.full(size, 1.0 / size), "valid")
    rise = np.maximum.accumulate(smooth)
    along = (x - x[0]) / max(float(np.ptp(x)), 1e-300) + (rise - rise[0]) / max(float(np.ptp(rise)), 1e-300)
    return np.unique(np.append(np.searchsorted(along, np.linspace(0.0, along[-1], MAX_EDGES)[:-1]), len(x)))


def _part(x: np.ndarray, y: np.ndarray, noise: CurveNoise, first: int, last: int) -> StraightPart:
    place, values = x[first:last], y[first:last]
    from_mean = place - place.mean()
    squares = max(float(from_mean @ from_mean), 1e-300)
    return StraightPart(
        first=first,
        last=last,
        slope=float(from_mean @ values) / squares,
        error=(long_run(noise, last - first) / squares) ** 0.5,
        departure=departure(place, values, noise),
    )
