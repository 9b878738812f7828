# SPDX-License-Identifier: Apache-2.0
"""Punctures: a force peak followed by a fall that is neither noise nor a ripple."""

from dataclasses import dataclass

import numpy as np

from .strokes import Blocks

FALL_NOISE = 5.0  # [sd] above the mean of the falls that the free travel shows
FALL_PEAK = 0.1  # of the force at the peak itself, so that a late thin layer counts as much as the first
MOVING = 0.2  # of the mean speed: a force that falls while the needle rests relaxes
FALL_WHOLE = 0.03  # of the greatest force of the stroke: less cannot be seen beside it


@dataclass(frozen=True)
class Fall:
    """Samples ``peak``, ``low`` (not yet), ``high`` (surely past), force at the peak and the fall from it [N]."""

    peak: int
    low: int
    high: int
    force: float
    drop: float


def running_max(values: np.ndarray, window: int) -> np.ndarray:
    """The greatest of each value and the ``window - 1`` before it, (n,), in O(n) (van Herk 1992)."""
    count = -(-len(values) // window)
    padded = np.full((count + 1) * window, -np.inf)
    padded[window : window + len(values)] = values
    rows = padded.reshape(-1, window)
    forward = np.maximum.accumulate(rows, axis=1).ravel()
    backward = np.maximum.accumulate(rows[:, ::-1], axis=1)[:, ::-1].ravel()
    return np.maximum(forward[window : window + len(values)], backward[1 : 1 + len(values)])


def falls(
    stroke: Blocks, window: int, free: int, baseline: float, noise: float, fraction: float = FALL_PEAK
) -> list[tuple[int, int]]:
    """First and last block of every fall after the ``free`` first blocks: no noise, no ripple, no steady decline.

    It is more than ``FALL_NOISE``, ``fraction`` of its peak and ``FALL_WHOLE`` within a third of the ``window``
    [blocks]; the whole window that a rupture may take lets soft declines pass. Falls nearer than a window to the end of
    the one before belong to it: the needle rings after a rupture.
    """
    force, third = middle_of_three(stroke.force) - baseline, -(-window // 3)
    before = running_max(force, third + 1)
    ripples = (before - force)[: free + 1]
    ripple = ripples.mean() + FALL_NOISE * ripples.std() if free > window else 2**0.5 * FALL_NOISE * noise
    least = np.maximum(max(ripple, FALL_WHOLE * float(force.max())), fraction * before)
    inside = np.flatnonzero(before - force > least)
    travel = stroke.depth[inside] - stroke.depth[np.maximum(inside - third, 0)]
    moving = travel > MOVING * third * (stroke.depth[-1] - stroke.depth[0]) / len(stroke)
    inside = inside[(inside > free) & moving]
    if len(inside) == 0:
        return []
    breaks = np.flatnonzero(np.diff(inside) > window) + 1
    return [(int(group[0]), int(group[-1])) for group in np.split(inside, breaks)]


def middle_of_three(values: np.ndarray) -> np.ndarray:
    """The median of each value and its two neighbours, (n,): takes out single spikes and keeps steps."""
    if len(values) < 3:
        return values
    a, b, c = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return np.concatenate((values[:1], middle, values[-1:]))


def locate(force: np.ndarray, first: int, last: int, size: int, window: int, noise: float) -> Fall:
    """The peak before the fall seen between samples ``first`` and ``last`` of the raw (n,) ``force``.

    ``size`` samples are averaged before and after, never across the fall; the peak is sought up to ``window`` samples
    before the steepest fall; ``noise`` is that of the averages.
    """
    begin, end = max(first - window, 0), min(last + window, len(force))
    means = _trailing(force, begin, end, size)
    step = means[:-size] - means[size:] if len(means) > size else means[:1]
    edge = int(np.argmax(step[: max(last + size - begin - size + 1, 1)]))
    reach = means[max(edge - window, 0) : edge + 1]
    top = int(np.argmax(reach)) + edge + 1 - len(reach)
    peak = _line_end(force[max(begin + top - size + 1, 0) : begin + top + 1])
    after = means[edge + size : edge + size + window] if edge + size < len(means) else means[edge:]
    drop = peak - float(np.min(after))
    plateau = np.flatnonzero(means[max(edge - window, 0) : top + 1] < means[top] - 3.0 * noise)
    low = max(edge - window, 0) + int(plateau[-1]) if len(plateau) else max(edge - window, 0)
    past = np.flatnonzero(force[begin + edge + 1 : end] < peak - 0.5 * drop)
    high = begin + edge + 1 + (int(past[0]) if len(past) else 0)
    return Fall(begin + top, begin + min(low, top), min(high, len(force) - 1), peak, drop)


def _trailing(force: np.ndarray, begin: int, end: int, size: int) -> np.ndarray:
    """Means of the ``size`` samples that end at each sample from ``begin`` up to ``end`` (fewer at the very start)."""
    start = max(begin - size + 1, 0)
    sums = np.concatenate(([0.0], np.cumsum(force[start:end] - force[begin])))
    stop = np.arange(begin, end) - start + 1
    reach = np.minimum(stop, size)
    return (sums[stop] - sums[stop - reach]) / reach + force[begin]


def _line_end(values: np.ndarray) -> float:
    """The end of the line through the (n,) values, which have n times less noise; the last value itself if few."""
    if len(values) < 4:
        return float(values[-1])
    place = np.arange(len(values)) - (len(values) - 1) / 2
    return float(values.mean() + place[-1] * (place @ values) / (place @ place))
