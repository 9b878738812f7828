# SPDX-License-Identifier: Apache-2.0
"""Strokes: where the needle goes in, rests and comes out, found in the depth alone; long ones shortened to means
over blocks of samples."""

from dataclasses import dataclass

import numpy as np

REVERSAL = 0.1  # a turn counts once the depth has come back by this share of its whole range
REST = 1e-3  # at rest: within this share of the range of the deepest point
SHORTEST_REST = 0.2  # [s] a shorter stop is only the turn itself
SMALLEST_RANGE = 20e-6  # [m] less travel than this is no insertion
MOST_POINTS = 20_000  # turns are sought in at most so many samples of the depth


@dataclass(frozen=True)
class Cycle:
    """One inward stroke and what follows it, as sample numbers.

    Inwards ``start`` to ``stop``, at rest ``stop`` to ``leave`` (equal: no rest), outwards ``leave`` to ``end``.
    ``withdrawn`` is false where the recording ends before the needle turns back; ``speed`` [m/s] is the mean inwards.
    """

    start: int
    stop: int
    leave: int
    end: int
    withdrawn: bool
    speed: float


def jitter(values: np.ndarray) -> float:
    """The white noise (standard deviation) of a smooth (n,) series: from second differences, deaf to trends."""
    if len(values) < 3:
        return 0.0
    second = np.diff(values, 2)
    return float(np.median(np.abs(second))) / 0.6745 / np.sqrt(6.0)


def turns(depth: np.ndarray, least: float) -> list[int]:
    """Sample numbers of the alternating low and high turns of ``depth``, each at least ``least`` from the next."""
    found, low, high, rising = [], 0, 0, None
    values = depth.tolist()
    for i, z in enumerate(values):
        if rising is not False and z > values[high]:
            high = i
        if rising is not True and z < values[low]:
            low = i
        if rising is not True and z - values[low] > least:
            found.append(low)
            rising, high = True, i
        elif rising is not False and values[high] - z > least:
            found.append(high)
            rising, low = False, i
    return [*found, high if rising else low]


def cycles(time: np.ndarray, depth: np.ndarray) -> tuple[Cycle, ...]:
    """The insertions in a recording's time [s] and depth [m], (n,) each, in order; none where nothing moves inwards."""
    stride = max(1, len(depth) // MOST_POINTS)
    coarse = depth[::stride]
    if len(coarse) < 3:
        return ()
    span, noise = float(np.ptp(coarse)), jitter(coarse)
    if not span > max(SMALLEST_RANGE, 20.0 * noise):
        return ()
    found = [min(stride * i, len(depth) - 1) for i in turns(coarse, REVERSAL * span)]
    near = max(REST * span, 4.0 * noise)
    strokes = zip(found[:-1], found[1:], [*found[2:], None], strict=True)
    return tuple(_cycle(time, depth, a, b, c, near) for a, b, c in strokes if depth[b] > depth[a])


def _cycle(time: np.ndarray, depth: np.ndarray, low: int, high: int, after: int | None, near: float) -> Cycle:
    """The cycle around the stroke from turn ``low`` to turn ``high``; ``after`` is the next low turn, if there is."""
    end = len(depth) if after is None else after + 1
    start = low + int(np.flatnonzero(depth[low : high + 1] <= depth[low] + near)[-1])
    at_top = np.flatnonzero(depth[low:end] >= depth[low:end].max() - near) + low
    stop, leave = int(at_top[0]), int(at_top[-1]) + 1
    speed = (depth[stop] - depth[start]) / max(time[stop] - time[start], 1e-9)
    if time[leave - 1] - time[stop] < max(SHORTEST_REST, 4.0 * near / speed):
        stop = leave = int(low + np.argmax(depth[low:end])) + 1
    return Cycle(start, stop, leave, end, after is not None, float(speed))


@dataclass(frozen=True)
class Blocks:
    """Means of (m,) blocks of ``size`` samples each, the first block starting at sample ``first``."""

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
    """Blocks of samples ``first`` up to ``last``; what does not fill a block at the end is left out."""
    size = max(1, min(size, last - first))
    count = (last - first) // size
    mean = lambda values: values[first : first + count * size].reshape(count, size).mean(axis=1)  # noqa: E731
    return Blocks(first, size, mean(depth), mean(force))


def first_run(above: np.ndarray, length: int) -> int | None:
    """Where the first run of at least ``length`` true values in (m,) ``above`` begins."""
    if len(above) < length:
        return None
    sums = np.concatenate(([0], np.cumsum(above)))
    starts = np.flatnonzero(sums[length:] - sums[:-length] == length)
    return int(starts[0]) if len(starts) else None
