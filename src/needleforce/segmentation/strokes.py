# SPDX-License-Identifier: Apache-2.0
"""Insertion strokes, holds and withdrawal strokes, found from the depth only, and means over blocks of samples."""

from dataclasses import dataclass

import numpy as np

REVERSAL_SHARE = 0.1  # of the depth's range: return travel after which a reversal counts
REST_SHARE = 1e-3  # of the depth's range: distance from the deepest point within which the needle rests
MIN_HOLD_S = 0.2  # [s] a shorter stop is part of the reversal
MIN_RANGE_M = 20e-6  # [m] a recording with less travel contains no insertion
MAX_POINTS = 20_000  # samples of the depth in which reversals are searched


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """One insertion stroke with its hold and withdrawal, as sample numbers.

    Insertion from ``start`` to ``stop``, hold from ``stop`` to ``withdrawal_start`` (equal without a hold), withdrawal
    from ``withdrawal_start`` to ``end``. ``withdrawn`` is False if the recording ends before the withdrawal; ``speed``
    [m/s] is the mean of the insertion.
    """

    start: int
    stop: int
    withdrawal_start: int
    end: int
    withdrawn: bool
    speed: float


def white_noise(values: np.ndarray) -> float:
    """The standard deviation of white noise in a smooth (n,) series, from second differences, unaffected by trends."""
    if len(values) < 3:
        return 0.0
    second = np.diff(values, 2)
    return float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6.0)


def reversals(depth: np.ndarray, min_travel: float) -> list[int]:
    """Sample numbers of the alternating minima and maxima of ``depth``, at least ``min_travel`` apart."""
    found, low, high, rising = [], 0, 0, None
    values = depth.tolist()
    for i, z in enumerate(values):
        if rising is not False and z > values[high]:
            high = i
        if rising is not True and z < values[low]:
            low = i
        if rising is not True and z - values[low] > min_travel:
            found.append(low)
            rising, high = True, i
        elif rising is not False and values[high] - z > min_travel:
            found.append(high)
            rising, low = False, i
    return [*found, high if rising else low]


def cycles(time: np.ndarray, depth: np.ndarray) -> tuple[Cycle, ...]:
    """The insertions in (n,) time [s] and depth [m], in order of time; empty if the needle does not move inwards."""
    stride = max(1, len(depth) // MAX_POINTS)
    coarse = depth[::stride]
    if len(coarse) < 3:
        return ()
    span, noise = float(np.ptp(coarse)), white_noise(coarse)
    if not span > max(MIN_RANGE_M, 20.0 * noise):
        return ()
    found = [min(stride * i, len(depth) - 1) for i in reversals(coarse, REVERSAL_SHARE * span)]
    rest_distance = max(REST_SHARE * span, 4.0 * noise)
    strokes = zip(found[:-1], found[1:], [*found[2:], None], strict=True)
    return tuple(
        _cycle(time, depth, low=a, high=b, next_low=c, rest_distance=rest_distance)
        for a, b, c in strokes
        if depth[b] > depth[a]
    )


def _cycle(
    time: np.ndarray, depth: np.ndarray, *, low: int, high: int, next_low: int | None, rest_distance: float
) -> Cycle:
    """The cycle of the stroke from minimum ``low`` to maximum ``high``; ``next_low`` is the next minimum, if any."""
    end = len(depth) if next_low is None else next_low + 1
    start = low + int(np.flatnonzero(depth[low : high + 1] <= depth[low] + rest_distance)[-1])
    at_top = np.flatnonzero(depth[low:end] >= depth[low:end].max() - rest_distance) + low
    stop, withdrawal_start = int(at_top[0]), int(at_top[-1]) + 1
    speed = (depth[stop] - depth[start]) / max(time[stop] - time[start], 1e-9)
    if time[withdrawal_start - 1] - time[stop] < max(MIN_HOLD_S, 4.0 * rest_distance / speed):
        stop = withdrawal_start = int(low + np.argmax(depth[low:end])) + 1
    return Cycle(
        start=start,
        stop=stop,
        withdrawal_start=withdrawal_start,
        end=end,
        withdrawn=next_low is not None,
        speed=float(speed),
    )


@dataclass(frozen=True)
class Blocks:
    """Means over (m,) blocks of ``size`` samples each; the first block starts at sample ``first``."""

    first: int
    size: int
    depth: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.depth)

    def sample(self, block: int) -> int:
        """The first sample of a block."""
        return self.first + self.size * int(block)


def blocks(depth: np.ndarray, force: np.ndarray, first: int, last: int, size: int) -> Blocks:
    """Blocks of samples ``first`` up to ``last``; samples that do not fill the last block are left out."""
    size = max(1, min(size, last - first))
    count = (last - first) // size
    mean = lambda values: values[first : first + count * size].reshape(count, size).mean(axis=1)  # noqa: E731
    return Blocks(first, size, mean(depth), mean(force))


def first_run(above: np.ndarray, length: int) -> int | None:
    """The index at which the first run of at least ``length`` true values in (m,) ``above`` starts, or None."""
    if len(above) < length:
        return None
    sums = np.concatenate(([0], np.cumsum(above)))
    starts = np.flatnonzero(sums[length:] - sums[:-length] == length)
    return int(starts[0]) if len(starts) else None
