# SPDX-License-Identifier: Apache-2.0
"""Insertion strokes, holds and withdrawal strokes, found from the depth, and means over blocks of samples."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .. import core
from ..vocabulary import SMALLEST

REVERSAL_SHARE = 0.1  # of the depth's range: return travel after which a reversal counts
REST_SHARE = 1e-3  # of the depth's range: distance from the deepest point within which the needle rests
MIN_HOLD_S = 0.2  # [s] a shorter stop is part of the reversal
MIN_RANGE_M = 20e-6  # [m] a recording with less travel contains no insertion
MAX_POINTS = 1000  # samples of the depth in which reversals are searched; refined afterwards
MIN_INSERTION_SHARE = 0.1  # of the deepest indentation: a shallower one between two departures is a touch
ADVANCE_WINDOW = 5  # blocks over which the advance of the deepest point is averaged
MIN_ADVANCE_SHARE = 0.02  # of the median advance: with less the needle rests
SMOOTH_RATIO = 4.0  # of the advance over the samples that are averaged to the noise of their mean
CUT_SIGMA = 4.0  # [sd] noise of the depth below its deepest point so far that is no pull-back
MIN_STAND = 5  # samples of a depth that is not updated
CAUGHT_UP = 0.1  # of the jump behind them: largest distance of the motion before and after from one straight line
FOURTH_DIFFERENCE = 70**0.5  # sd of a fourth difference of values with sd 1


@dataclass(frozen=True, kw_only=True)
class Cycle:
    """One insertion stroke with its hold and withdrawal, as sample numbers.

    Insertion from ``start`` to ``stop``, hold from ``stop`` to ``withdrawal_start`` (equal without a hold), withdrawal
    from ``withdrawal_start`` to ``end``. ``withdrawn`` is False if the recording ends before the withdrawal; ``speed``
    [m/s] is the mean at the cut. Pull-backs and pauses on the way to the deepest point are part of the insertion.
    """

    start: int
    stop: int
    withdrawal_start: int
    end: int
    withdrawn: bool
    speed: float


def stands(depth: np.ndarray) -> list[tuple[int, int]]:
    """The samples before and after each stretch in which a (n,) depth is not updated: it stands at exactly one value,
    and then jumps onto the straight line of the motion before and after it; a pause ends where it began."""
    step, found = np.diff(depth), []
    moved = np.abs(step[step != 0.0])
    usual = float(np.percentile(moved, 95)) if len(moved) else 0.0
    for k in np.flatnonzero(np.abs(step) > MIN_STAND * usual).tolist():
        before = np.flatnonzero(depth[:k] != depth[k])
        first, last = int(before[-1]) + 1 if len(before) else 0, k + 1
        count = last - first
        near = min(max(count // 2, MIN_STAND), first, len(depth) - 1 - last)
        if count <= MIN_STAND or near < MIN_STAND:
            continue
        places = np.r_[first - near : first + 1, last : last + near + 1]
        line = np.polyval(np.polyfit(places - first, depth[places], 1), places - first)
        if float(np.abs(depth[places] - line).max()) <= CAUGHT_UP * abs(float(step[k])):
            found.append((first, last))
    return found


def updated_depth(depth: np.ndarray) -> np.ndarray:
    """The (n,) depth with straight lines over its ``stands``."""
    for first, last in stands(depth):
        depth = depth.copy()
        depth[first:last] = np.linspace(depth[first], depth[last], last - first, endpoint=False)
    return depth


def white_noise(values: np.ndarray) -> float:
    """The standard deviation of white noise in a smooth (n,) series, from second differences, unaffected by trends."""
    return core.second_difference_noise(values)


def deepest_sample(depth: np.ndarray, force: np.ndarray) -> int:
    """The sample at which the stroke inwards ends: of those at the largest (n,) depth, which a rounded depth has
    several of, the one with the largest force [N]; in a rest there the force only falls."""
    first = int(depth.argmax())
    other = np.flatnonzero(depth[first:] != depth[first])
    stay = slice(first, first + int(other[0]) if len(other) else len(depth))
    return first + int(np.abs(force[stay]).argmax())


def cycles(time: np.ndarray, depth: np.ndarray) -> tuple[Cycle, ...]:
    """The insertions in (n,) time [s] and depth [m], in order of time; empty if the needle does not move inwards.

    Every reversal by more than 10 % of the range ends a stroke here; ``insertions`` joins those between which the
    needle stayed in the tissue, which only the force shows.
    """
    stride = max(1, len(depth) // MAX_POINTS)
    coarse = depth[::stride]
    if len(coarse) < 3:
        return ()
    span, noise = float(np.ptp(coarse)), white_noise(coarse)
    if not span > max(MIN_RANGE_M, 20.0 * noise):
        return ()
    found = _refined(depth, core.reversals(coarse, REVERSAL_SHARE * span), stride)
    rest_distance = max(REST_SHARE * span, 4.0 * noise)
    strokes = zip(found[:-1], found[1:], [*found[2:], None], strict=True)
    return tuple(
        _cycle(time, depth, low=a, high=b, next_low=c, rest_distance=rest_distance)
        for a, b, c in strokes
        if depth[b] > depth[a]
    )


def _refined(depth: np.ndarray, found: list[int], stride: int) -> list[int]:
    """The extremes ``found`` in every ``stride``-th sample, searched again among all samples near them."""
    if stride == 1:
        return found
    turns, falling = [], len(found) > 1 and depth[stride * found[1]] > depth[stride * found[0]]
    for each in found:
        a, b = max(0, stride * (each - 1)), min(len(depth), stride * (each + 1) + 1)
        turns.append(a + int(np.argmin(depth[a:b]) if falling else np.argmax(depth[a:b])))
        falling = not falling
    return turns


def insertions(time: np.ndarray, depth: np.ndarray, surface: float) -> tuple[Cycle, ...]:
    """The insertions below ``surface`` [m], the depth above which the needle is certainly out of the tissue.

    As long as the needle does not come back out, pull-backs and pauses are part of one insertion; if it does, the next
    one begins where it was furthest out. Touches of less than a tenth of the deepest indentation are left out.
    """
    inside = depth > surface
    edges = np.flatnonzero(np.diff(inside)) + 1
    bounds = np.concatenate(([0], edges, [len(depth)]))
    deep = surface + MIN_INSERTION_SHARE * (float(depth.max()) - surface)
    spans = [(a, b) for a, b in pairwise(bounds) if inside[a] and depth[a:b].max() > deep]
    if not spans:
        return ()
    cuts = [int(np.argmin(depth[: spans[0][0] + 1]))]
    cuts += [b + int(np.argmin(depth[b : c + 1])) for (_, b), (c, _) in pairwise(spans)]
    rest_distance = max(
        REST_SHARE * float(np.ptp(depth)), 4.0 * white_noise(depth[:: max(1, len(depth) // MAX_POINTS)])
    )
    highs = [a + int(np.argmax(depth[a:b])) for a, b in spans]
    lows = [*cuts[1:], _last_low(depth, highs[-1])]
    found = (
        _cycle(time, depth, low=a, high=b, next_low=c, rest_distance=rest_distance)
        for a, b, c in zip(cuts, highs, lows, strict=True)
    )
    return tuple(each for each in found if each.speed > 0.0)


def _last_low(depth: np.ndarray, high: int) -> int | None:
    """The end of the last withdrawal, or None if the needle is not withdrawn after its deepest point ``high``."""
    low = high + int(np.argmin(depth[high:]))
    return low if depth[high] - depth[low] > REVERSAL_SHARE * float(np.ptp(depth)) else None


def _cycle(
    time: np.ndarray, depth: np.ndarray, *, low: int, high: int, next_low: int | None, rest_distance: float
) -> Cycle:
    """The cycle of the stroke from minimum ``low`` to maximum ``high``; ``next_low`` is the next minimum, if any."""
    end = len(depth) if next_low is None else next_low + 1
    start = low + int(np.flatnonzero(depth[low : high + 1] <= depth[low] + rest_distance)[-1])
    at_top = _longest_rest(np.flatnonzero(depth[low:end] >= depth[low:end].max() - rest_distance) + low)
    stop, withdrawal_start = int(at_top[0]), int(at_top[-1]) + 1
    speed = (depth[stop] - depth[start]) / max(time[stop] - time[start], 1e-9)
    if time[withdrawal_start - 1] - time[stop] < max(MIN_HOLD_S, 4.0 * rest_distance / max(speed, 1e-12)):
        stop = int(low + np.argmax(depth[low:end])) + 1
        withdrawal_start = stop if withdrawal_start < len(depth) else len(depth)  # a recording that ends at rest
    onwards = max(len(cut_samples(depth, start, stop, 1)[0]), 1) / max(stop - start, 1)
    return Cycle(
        start=start,
        stop=stop,
        withdrawal_start=withdrawal_start,
        end=end,
        withdrawn=next_low is not None,
        speed=float(speed / onwards),
    )


def _longest_rest(at_top: np.ndarray) -> np.ndarray:
    """The longest visit of the deepest point: a needle may come back to it after a pull-back."""
    breaks = np.flatnonzero(np.diff(at_top) > ADVANCE_WINDOW) + 1
    return max(np.split(at_top, breaks), key=len) if len(breaks) else at_top


@dataclass(frozen=True)
class Blocks:
    """Means over (m,) blocks of ``size`` samples each; the first samples of the blocks are (m + 1,) ``starts``."""

    starts: np.ndarray
    size: int
    depth: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.depth)

    def sample(self, block: int) -> int:
        """The first sample of a block."""
        return int(self.starts[min(max(int(block), 0), len(self))])

    def until(self, count: int) -> "Blocks":
        """The first ``count`` blocks."""
        return Blocks(self.starts[: count + 1], self.size, self.depth[:count], self.force[:count])


def blocks(depth: np.ndarray, force: np.ndarray, first: int, last: int, size: int) -> Blocks:
    """Blocks of samples ``first`` up to ``last``; samples that do not fill the last block are left out."""
    size = max(1, min(size, last - first))
    count = (last - first) // size
    part = slice(first, first + count * size)
    starts = first + size * np.arange(count + 1)
    if size == 1:
        return Blocks(starts, 1, depth[part], force[part])
    return Blocks(starts, size, core.block_means(depth[part], size), core.block_means(force[part], size))


@dataclass(frozen=True, kw_only=True)
class Cut:
    """The insertion at the cut: numbers of the (n,) ``samples`` at which the needle goes deeper than ever before, their
    ``depth`` and ``force``, and ``blocks`` of these, whose starts are places in these arrays.

    Pull-backs, returns and rests are left out, so that neighbours may be apart in time, at a place in ``gaps``;
    ``noise`` is that of the depth [m].
    """

    samples: np.ndarray
    depth: np.ndarray
    force: np.ndarray
    blocks: Blocks
    gaps: np.ndarray
    noise: float

    def sample(self, block: int) -> int:
        """The first sample of a block."""
        return self.number(self.blocks.sample(block))

    def number(self, place: int) -> int:
        """The number of the sample at a place."""
        return int(self.samples[min(max(place, 0), len(self.samples) - 1)])


def at_cut(depth: np.ndarray, force: np.ndarray, first: int, last: int, *, size: int, lag: int = 0) -> Cut:
    """The samples from ``first`` up to ``last`` at the cut, in blocks of ``size``; a filter delays the force by up to
    ``lag`` samples, which are left out after a return to the cut."""
    samples, noise = cut_samples(depth, first, last, size * (ADVANCE_WINDOW // 2))
    if lag and len(samples):
        back = np.concatenate(([first - lag], np.where(np.diff(samples) > 1, samples[1:], first - lag)))
        samples = samples[samples - np.maximum.accumulate(back) >= lag]
    z, f = depth[samples], force[samples]
    gaps = np.flatnonzero(np.diff(samples) > 1) + 1
    part = blocks(z, f, 0, len(samples), size)
    return Cut(samples=samples, depth=z, force=f, blocks=part, gaps=gaps, noise=noise)


def cut_samples(depth: np.ndarray, first: int, last: int, reach: int) -> tuple[np.ndarray, float]:
    """Numbers of the samples from ``first`` up to ``last`` at which the needle goes deeper than ever before, not at
    rest, not pulled back, and not on its way through the hole that it left; and the noise of the depth [m], at 4 sd.

    The depth is averaged until its noise is small against its advance, and its deepest point so far is known to the
    noise that remains. A needle advances if that point moves within ``reach`` samples before and after.
    """
    z, left, noise, step = _smooth(depth[first:last])
    quantum = _quantum(depth[first:last], step)
    if len(z) < 2 * ADVANCE_WINDOW:
        return np.arange(first, last), 0.0
    top, half = core.running_max(z), max(reach, int(SMOOTH_RATIO * max(left, quantum) / max(step, SMALLEST)), 1)
    half = min(half, len(z) // 4)
    gain = np.append(top[half:], np.full(half, top[-1])) - np.append(np.full(half, top[0]), top[:-half])
    forwards = gain[gain > 0.0]
    typical = core.median(forwards) if len(forwards) else 0.0
    inwards = (gain > MIN_ADVANCE_SHARE * typical) & (z >= top - left)
    inwards[:-1] &= inwards[1:]  # where it turns, the force may turn already
    inwards[-1] = False
    return first + np.flatnonzero(inwards), max(noise, quantum)


def _smooth(depth: np.ndarray) -> tuple[np.ndarray, float, float, float]:
    """The (n,) depth without most of its noise, what is left of that and all of it, at 4 sd,
    and its mean advance a sample."""
    if len(depth) < 2 * ADVANCE_WINDOW:
        return depth, 0.0, 0.0, 0.0
    step = max(float(depth.max() - depth[0]), 0.0) / len(depth)
    fourth = np.abs(np.diff(depth, 4))
    noise = float(np.median(fourth)) / 0.6745 / FOURTH_DIFFERENCE
    length = int(min((SMOOTH_RATIO * noise / max(step, SMALLEST)) ** (2.0 / 3.0), len(depth) // 10))
    if length < 2:
        return depth, CUT_SIGMA * noise, CUT_SIGMA * noise, step
    half = length // 2
    sums = np.concatenate(([0.0], np.cumsum(depth - depth[0])))
    low, high = np.maximum(np.arange(len(depth)) - half, 0), np.minimum(np.arange(len(depth)) + half + 1, len(depth))
    smooth = depth[0] + (sums[high] - sums[low]) / (high - low)
    return smooth, CUT_SIGMA * noise / length**0.5, CUT_SIGMA * noise, step


def _quantum(depth: np.ndarray, step: float) -> float:
    """The quantum of a (n,) depth that stands still for most of the samples of its ``step``, 0 if it does not."""
    moved = np.abs(np.diff(depth))
    moved = moved[moved > 0.0]
    return float(moved.min()) if 0 < len(moved) < 0.5 * len(depth) and moved.min() > step else 0.0
