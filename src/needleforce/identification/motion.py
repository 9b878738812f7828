# SPDX-License-Identifier: Apache-2.0
"""Which samples of any motion show the cut, the shaft sliding back, or neither: pull-backs, pauses, jerks by hand.

The cut is the deepest depth so far, and there alone friction and cutting act together. In a pull-back friction reverses
through the tissue's elastic stretch; the shaft slides back only past it. On the way back to the cut the shaft slides in
its own track. At rest the tissue relaxes.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import core
from ..segmentation.strokes import cycles

REST_SPEED_SHARE = 0.2  # of the stroke's mean speed: slower, the force is that of a relaxing tissue
MIDDLE_OF_HOLD = 0.4  # [of a hold] without braking and the start of the withdrawal
MIN_REST_S = 0.1  # [s] a shorter rest is not seen


@dataclass(frozen=True, eq=False)
class DepthSignal:
    """A recorded ``depth`` (n,) [m] with its noise and what is left without it, each computed once where it is needed.

    A depth is scanned for its noise, its deepest values and its motion by several parts of a fit; this is what they
    share.
    """

    depth: np.ndarray

    @cached_property
    def noise(self) -> float:
        """Standard deviation [m] of the noise, its quantum included.

        From second differences, which a steady motion leaves at zero: those of white noise have 6 times its variance.
        Their median is robust against the ends of strokes. A depth that moves in steps of a quantum q, the smallest
        step or none in more than half of its samples, has q / sqrt(12).
        """
        return core.depth_noise(self.depth)

    @cached_property
    def backtrack_limit(self) -> float:
        """Travel [m] backwards that the noise alone reaches: twice the expected extreme of n values."""
        return 2.0 * self.noise * math.sqrt(2.0 * math.log(max(len(self.depth), 2)))

    @cached_property
    def deepest(self) -> np.ndarray:
        """The deepest depth so far, (n,) [m]."""
        return core.running_max(self.depth)

    @cached_property
    def smoothed(self) -> tuple[np.ndarray, float]:
        """The depth (n,) [m] averaged over neighbouring samples, and the noise that is left in it [m].

        Over as many samples as make the error at a corner of the motion, an eighth of the travel that they span, equal
        to what is left of the noise. A depth without noise is unchanged. The step of a sample is the median one, or the
        mean one of a needle that rests for more than half of the recording.
        """
        if not self.noise > 0.0:
            return self.depth, 0.0
        mean = float(np.ptp(self.depth)) / len(self.depth)
        step = max(core.median_step(smoothed(self.depth, 5), magnitude=True), mean)
        length = round((16.0 * self.noise / step) ** (2.0 / 3.0))
        length = min(max(length, 1), max(len(self.depth) // 20, 1))
        return smoothed(self.depth, length), self.noise / math.sqrt(length)

    @cached_property
    def steady(self) -> np.ndarray:
        """The depth (n,) [m] without its noise, which would reverse friction from sample to sample: smoothed, then
        moved only by what leaves a dead band of the noise that is left."""
        smooth, left = self.smoothed
        if not left > 0.0:
            return self.depth
        return core.dead_band(smooth, left * math.sqrt(2.0 * math.log(max(len(self.depth), 2))))


def depths_between(depth: np.ndarray, first: int, last: int) -> tuple[float, float]:
    """The least and the largest depth [m] that the samples ``first`` to ``last`` of (n,) depths may have.

    A depth that is logged more slowly than the force, or in coarse steps, stands for several samples: meanwhile the
    needle is anywhere between that value and the ones next to it.
    """
    low, high = first, last
    if _stands(depth, first):
        low = max(first - int(np.argmax(depth[first::-1] != depth[first])), 0) if depth[0] != depth[first] else 0
    if _stands(depth, last):
        high = last + int(np.argmax(depth[last:] != depth[last])) if depth[-1] != depth[last] else len(depth) - 1
    between = depth[low : high + 1]
    return float(between.min()), float(between.max())


def _stands(depth: np.ndarray, sample: int) -> bool:
    """Whether the depth of a sample is that of a neighbour too."""
    return bool(np.count_nonzero(depth[max(sample - 1, 0) : sample + 2] == depth[sample]) > 1)


def at_the_cut(depth: DepthSignal) -> np.ndarray:
    """True (n,) where an insertion's depth is the deepest so far, but for its noise."""
    return depth.depth >= depth.deepest - depth.backtrack_limit


def sliding_back(depth: DepthSignal, stretch: float) -> np.ndarray:
    """True (n,) where a pull-back within an insertion has travelled more than ``stretch`` [m] from the cut and still
    moves outwards: there friction has reversed, and nothing is cut."""
    back, limit = depth.deepest - depth.depth, depth.backtrack_limit
    found = np.zeros(len(back), bool)
    starts = np.flatnonzero(np.diff(back > limit, prepend=False) & (back > limit))
    for start in starts:
        ends = np.flatnonzero(back[start:] <= limit)
        stop = start + int(ends[0]) if len(ends) else len(back)
        run = back[start:stop]
        found[start:stop] = (run > stretch + limit) & (run >= np.maximum.accumulate(run) - limit)
    return found


def resting(time: np.ndarray, signal: DepthSignal) -> np.ndarray:
    """True (n,) where the needle pauses on its way: the deepest depth grows by less than 20 % of the mean speed over
    0.1 s, or over as long as the noise of the depth needs."""
    depth, deepest = signal.depth, signal.deepest
    if len(depth) < 3 or not depth[-1] > depth[0]:
        return np.zeros(len(depth), bool)
    speed, step = float(deepest[-1] - depth[0]) / float(time[-1] - time[0]), core.median_step(time)
    half = 0.5 * max(MIN_REST_S, 2.0 * signal.backtrack_limit / (REST_SPEED_SHARE * speed))
    reach = max(round(half / step), 1)
    return _change(deepest, reach) < REST_SPEED_SHARE * speed * _change(time, reach)


def wander_at_rest(time: np.ndarray, depth: np.ndarray) -> float:
    """Largest range [m] in which a depth (n,) may stray over a hold; 0 without one.

    The middle two fifths of a hold show it without braking; a drift continues over all of it.
    """
    holds = [
        middle_of(each.stop, each.withdrawal_start) for each in cycles(time, depth) if each.withdrawal_start > each.stop
    ]
    return max((float(np.ptp(depth[hold])) for hold in holds), default=0.0) / MIDDLE_OF_HOLD


def middle_of(first: int, last: int) -> slice:
    """The samples of a hold without its braking and the start of the withdrawal, at least one."""
    margin = round(0.5 * (1.0 - MIDDLE_OF_HOLD) * (last - first))
    return slice(first + margin, max(last - margin, first + margin + 1))


def _change(values: np.ndarray, reach: int) -> np.ndarray:
    """Change (n,) of values from ``reach`` samples before each to as many after it, fewer at the ends."""
    n, change = len(values), np.empty(len(values))
    inner, margin = max(n - 2 * reach, 0), min(reach, n)
    change[reach : reach + inner] = values[2 * reach :] - values[: n - 2 * reach] if inner else ()
    for place in (np.arange(margin), np.arange(max(n - reach, margin), n)):
        change[place] = values[np.minimum(place + reach, n - 1)] - values[np.maximum(place - reach, 0)]
    return change


def smoothed(values: np.ndarray, length: int) -> np.ndarray:
    """Moving average of (n,) values over ``length`` samples around each, fewer at the ends, symmetric."""
    return values if length < 2 else core.moving_average(values, length // 2)
