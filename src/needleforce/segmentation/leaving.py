# SPDX-License-Identifier: Apache-2.0
"""Where the needle leaves the tissue: the contact of the withdrawal run backwards."""

from dataclasses import replace

import numpy as np

from .blocks import blocks
from .contact import Onset, onset
from .strokes import Cycle, jitter

SAME_BASELINE = 0.03  # of the greatest force: the baselines before and after differ by no more …
DRIFTED_BASELINE = 0.1  # … or by so much, if the needle is back near where it went in
NEAR = 0.25  # of the indentation: so near
ONLY_DRIFT = 1.5  # times the white noise: what a straight line in time may leave of a force that only drifts


def leave(depth: np.ndarray, force: np.ndarray, cycle: Cycle, size: int, crossing: float) -> Onset | None:
    """The exit of a withdrawal in (n,) depths [m] and forces [N]; ``low`` and ``high`` are samples, in order of time.

    Run backwards, the needle meets the tissue under tension; only if it was never pulled, under pressure.
    """
    back, pull = depth[cycle.leave : cycle.end][::-1], force[cycle.leave : cycle.end][::-1]
    for sign in (-1.0, 1.0):
        way = blocks(back, sign * pull, 0, len(back), size)
        last = onset(way, crossing)
        if last is not None:
            low, high = cycle.end - 1 - way.sample(last.high + 1), cycle.end - 1 - way.sample(last.low)
            return replace(last, low=max(low, cycle.leave), high=high, baseline=sign * last.baseline)
    return None


def returned(begin: Onset, last: Onset, deepest: float, peak: float) -> bool:
    """Whether the force after ``last`` is the baseline from before ``begin``, and not one level the needle rests at."""
    change = abs(last.baseline - begin.baseline)
    if change <= (max(5.0 * begin.noise, SAME_BASELINE * peak) if last.free else 5.0 * begin.noise):
        return True
    near = abs(last.depth - begin.depth) <= NEAR * (deepest - begin.depth)
    return change <= DRIFTED_BASELINE * peak and near and last.free


def only_drift(time: np.ndarray, force: np.ndarray, size: int) -> bool:
    """Whether a whole cycle's (n,) force is a straight line in time: there and back again, no contact is one."""
    short = blocks(time, force, 0, len(force), size)
    if len(short) < 10:
        return False
    left = short.force - np.polyval(np.polyfit(short.depth, short.force, 1), short.depth)
    return float(left.std()) <= ONLY_DRIFT * jitter(short.force)
