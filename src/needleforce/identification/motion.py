# SPDX-License-Identifier: Apache-2.0
"""Which samples of any motion show the cut, the shaft sliding back, or neither: pull-backs, pauses, jerks by hand.

The cut is the deepest depth so far, and there alone friction and cutting act together. In a pull-back friction reverses
through the tissue's elastic stretch; the shaft slides back only past it. On the way back to the cut the shaft slides in
its own track. At rest the tissue relaxes.
"""

import math

import numpy as np

from .. import core

REST_SPEED_SHARE = 0.2  # of the stroke's mean speed: slower, the force is that of a relaxing tissue
MIN_REST_S = 0.1  # [s] a shorter rest is not seen
MAX_QUANTUM_SHARE = 0.5  # of the steps of a moving depth are the smallest one or none: then it is quantised


def depth_noise(depth: np.ndarray) -> float:
    """Standard deviation [m] of the noise of a recorded depth (n,) [m], its quantum included.

    From second differences, which a steady motion leaves at zero: those of white noise have 6 times its variance. Their
    median is robust against the ends of strokes. A depth that moves in steps of a quantum q has q / sqrt(12).
    """
    if len(depth) < 3:
        return 0.0
    steps = np.diff(depth)
    scatter = float(np.median(np.abs(np.diff(steps)), overwrite_input=True)) / 0.6745 / math.sqrt(6.0)
    np.abs(steps, out=steps)
    moving = steps[steps > 0.0]
    if not 0 < len(moving) < len(steps):  # at rest, or never at rest: no steps of a quantum
        return scatter
    quantum = float(moving.min())
    stepped = float(np.mean(steps <= 1.5 * quantum)) > MAX_QUANTUM_SHARE
    return math.hypot(scatter, quantum / math.sqrt(12.0)) if stepped else scatter


def backtrack_limit(depth: np.ndarray) -> float:
    """Travel [m] backwards that the noise of the (n,) depth alone reaches: twice the expected extreme of n values."""
    return 2.0 * depth_noise(depth) * math.sqrt(2.0 * math.log(max(len(depth), 2)))


def at_the_cut(depth: np.ndarray) -> np.ndarray:
    """True (n,) where an insertion's depth is the deepest so far, but for its noise."""
    deepest = np.maximum.accumulate(depth)
    return depth >= deepest - backtrack_limit(depth)


def sliding_back(depth: np.ndarray, stretch: float) -> np.ndarray:
    """True (n,) where a pull-back within an insertion has travelled more than ``stretch`` [m] from the cut and still
    moves outwards: there friction has reversed, and nothing is cut."""
    deepest, limit = np.maximum.accumulate(depth), backtrack_limit(depth)
    back = deepest - depth
    found = np.zeros(len(depth), bool)
    starts = np.flatnonzero(np.diff(back > limit, prepend=False) & (back > limit))
    for start in starts:
        ends = np.flatnonzero(back[start:] <= limit)
        stop = start + int(ends[0]) if len(ends) else len(back)
        run = back[start:stop]
        found[start:stop] = (run > stretch + limit) & (run >= np.maximum.accumulate(run) - limit)
    return found


def resting(time: np.ndarray, depth: np.ndarray) -> np.ndarray:
    """True (n,) where the needle pauses on its way: the deepest depth grows by less than 20 % of the mean speed over
    0.1 s, or over as long as the noise of the depth needs."""
    if len(depth) < 3 or not depth[-1] > depth[0]:
        return np.zeros(len(depth), bool)
    speed, step = float(depth.max() - depth[0]) / float(time[-1] - time[0]), float(np.median(np.diff(time)))
    half = 0.5 * max(MIN_REST_S, 2.0 * backtrack_limit(depth) / (REST_SPEED_SHARE * speed))
    reach = max(round(half / step), 1)
    deepest, place = np.maximum.accumulate(depth), np.arange(len(depth))
    first, last = np.maximum(place - reach, 0), np.minimum(place + reach, len(depth) - 1)
    return deepest[last] - deepest[first] < REST_SPEED_SHARE * speed * (time[last] - time[first])


def smoothed_depth(depth: np.ndarray) -> tuple[np.ndarray, float]:
    """The (n,) depth [m] averaged over neighbouring samples, and the noise that is left in it [m].

    Over as many samples as make the error at a corner of the motion, an eighth of the travel that they span, equal to
    what is left of the noise. A depth without noise is unchanged.
    """
    noise = depth_noise(depth)
    if not noise > 0.0:
        return depth, 0.0
    step = float(np.median(np.abs(np.diff(smoothed(depth, 5)))))
    length = min(max(round((16.0 * noise / max(step, 1e-12)) ** (2.0 / 3.0)), 1), max(len(depth) // 20, 1))
    return smoothed(depth, length), noise / math.sqrt(length)


def steady_depth(depth: np.ndarray) -> np.ndarray:
    """The (n,) depth [m] without its noise, which would reverse friction from sample to sample: smoothed, then moved
    only by what leaves a dead band of the noise that is left."""
    smooth, left = smoothed_depth(depth)
    return core.dead_band(smooth, left * math.sqrt(2.0 * math.log(max(len(depth), 2)))) if left > 0.0 else depth


def smoothed(values: np.ndarray, length: int) -> np.ndarray:
    """Moving average of (n,) values over ``length`` samples around each, fewer at the ends, symmetric."""
    half = length // 2
    if half == 0:
        return values
    place = np.arange(len(values))
    reach = np.minimum(half, np.minimum(place, len(values) - 1 - place))
    sums = np.concatenate(([0.0], np.cumsum(values - values[0])))
    return values[0] + (sums[place + reach + 1] - sums[place - reach]) / (2 * reach + 1)
