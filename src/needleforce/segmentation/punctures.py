# SPDX-License-Identifier: Apache-2.0
"""Punctures: a force peak followed by a drop that is neither noise nor ripple."""

from dataclasses import dataclass

import numpy as np

from .strokes import Blocks

DROP_SIGMA = 5.0  # [sd] above the mean drop in the free travel
DROP_OF_PEAK = 0.1  # of the force at the peak itself, so that a thin deep layer counts as much as the first one
MIN_SPEED_SHARE = 0.2  # of the mean speed: at lower speed a decreasing force is relaxation
DROP_OF_MAX_FORCE = 0.03  # of the maximum force of the stroke


@dataclass(frozen=True, kw_only=True)
class ForceDrop:
    """A drop of the force: its samples ``peak``, ``low`` (before) and ``high`` (certainly after), the ``force`` at the
    peak and the ``drop`` from it [N]."""

    peak: int
    low: int
    high: int
    force: float
    drop: float


def running_max(values: np.ndarray, window: int) -> np.ndarray:
    """The maximum of each value and the ``window - 1`` before it, (n,), in O(n) (van Herk 1992)."""
    count = -(-len(values) // window)
    padded = np.full((count + 1) * window, -np.inf)
    padded[window : window + len(values)] = values
    rows = padded.reshape(-1, window)
    forward = np.maximum.accumulate(rows, axis=1).ravel()
    backward = np.maximum.accumulate(rows[:, ::-1], axis=1)[:, ::-1].ravel()
    return np.maximum(forward[window : window + len(values)], backward[1 : 1 + len(values)])


def force_drops(
    stroke: Blocks, *, window: int, free: int, baseline: float, noise: float, fraction: float = DROP_OF_PEAK
) -> list[tuple[int, int]]:
    """First and last block of every drop after the ``free`` first blocks that is not noise, ripple or slow decline.

    Within a third of the ``window`` [blocks] the force drops by more than ``DROP_SIGMA``, ``fraction`` of its peak and
    ``DROP_OF_MAX_FORCE``; over the full window that a rupture may take, slow declines would be accepted. A drop less
    than a window after the end of the previous one belongs to it, because the needle oscillates after a rupture.
    """
    force, third = middle_of_three(stroke.force) - baseline, -(-window // 3)
    before = running_max(force, third + 1)
    ripples = (before - force)[: free + 1]
    ripple = ripples.mean() + DROP_SIGMA * ripples.std() if free > window else 2**0.5 * DROP_SIGMA * noise
    threshold = np.maximum(max(ripple, DROP_OF_MAX_FORCE * float(force.max())), fraction * before)
    inside = np.flatnonzero(before - force > threshold)
    travel = stroke.depth[inside] - stroke.depth[np.maximum(inside - third, 0)]
    moving = travel > MIN_SPEED_SHARE * third * (stroke.depth[-1] - stroke.depth[0]) / len(stroke)
    inside = inside[(inside > free) & moving]
    if len(inside) == 0:
        return []
    breaks = np.flatnonzero(np.diff(inside) > window) + 1
    return [(int(group[0]), int(group[-1])) for group in np.split(inside, breaks)]


def middle_of_three(values: np.ndarray) -> np.ndarray:
    """The median of each value and its two neighbours, (n,): removes single spikes and keeps steps."""
    if len(values) < 3:
        return values
    a, b, c = values[:-2], values[1:-1], values[2:]
    middle = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return np.concatenate((values[:1], middle, values[-1:]))


def locate(force: np.ndarray, first: int, last: int, *, size: int, window: int, noise: float) -> ForceDrop:
    """The peak before the drop that was detected between samples ``first`` and ``last`` of the raw (n,) ``force``.

    ``size`` samples are averaged before and after the drop, never across it; the peak is searched up to ``window``
    samples before the steepest descent; ``noise`` is that of the averages.
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
    return ForceDrop(peak=begin + top, low=begin + min(low, top), high=min(high, len(force) - 1), force=peak, drop=drop)


def _trailing(force: np.ndarray, begin: int, end: int, size: int) -> np.ndarray:
    """Means of the ``size`` samples that end at each sample from ``begin`` up to ``end`` (fewer at the start)."""
    start = max(begin - size + 1, 0)
    sums = np.concatenate(([0.0], np.cumsum(force[start:end] - force[begin])))
    stop = np.arange(begin, end) - start + 1
    reach = np.minimum(stop, size)
    return (sums[stop] - sums[stop - reach]) / reach + force[begin]


def _line_end(values: np.ndarray) -> float:
    """The end value of a line fitted to the (n,) values, to reduce noise; the last value itself if n < 4."""
    if len(values) < 4:
        return float(values[-1])
    place = np.arange(len(values)) - (len(values) - 1) / 2
    return float(values.mean() + place[-1] * (place @ values) / (place @ place))
