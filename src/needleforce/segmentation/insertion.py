# SPDX-License-Identifier: Apache-2.0
"""The events of one cycle: contact and punctures on the way in, exit on the way out."""

from dataclasses import dataclass, replace

import numpy as np

from .blocks import blocks
from .contact import Onset, onset
from .events import Event, Puncture
from .leaving import leave, only_drift, returned
from .punctures import falls, locate
from .strokes import Cycle

FALL_TIME = 0.03  # [s] a fall may last so long however fast the stroke: needle and sensor swing
FALL_SAMPLES = 5  # or so many samples
BLOCKS_PER_FALL = 10
SMALL_DRIFT = 1e-3  # of the greatest force: less is left alone


@dataclass(frozen=True)
class Insertion:
    """What one cycle holds above ``baseline`` and ``noise`` [N]; ``exit`` is ``None`` where the force shows none."""

    cycle: Cycle
    contact: Event | None = None
    punctures: tuple[Puncture, ...] = ()
    exit: Event | None = None
    free: bool = True
    baseline: float = 0.0
    noise: float = 0.0


@dataclass(frozen=True)
class Limits:
    """``crossing`` [sd] of a contact, ``drop`` (of its peak) and ``window`` of a fall, filter ``lag`` [samples]."""

    crossing: float
    drop: float
    window: int
    lag: int

    @property
    def size(self) -> int:
        """How many samples make a block."""
        return max(1, self.window // BLOCKS_PER_FALL)


def limits(crossing: float, drop: float, within: float, rate: float, speed: float, filter_length: int) -> Limits:
    """For a fall over ``within`` [m] at ``speed`` [m/s], or for as long as sensor, filter and ``rate`` [Hz] take."""
    window = int(max(within / speed * rate, FALL_TIME * rate, FALL_SAMPLES)) + filter_length - 1
    return Limits(crossing, drop, window, filter_length - 1)


def insertion(time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: Limits) -> Insertion:
    """The events of ``cycle`` in (n,) arrays of time [s], depth [m] and force [N]."""
    begin, last = _ends(time, depth, force, cycle, allowed)
    if begin is None:
        return Insertion(cycle)
    window, size = allowed.window, allowed.size
    contact = _event(time, depth, force, begin, allowed.lag)
    stroke = blocks(depth, force, cycle.start, cycle.stop, size)
    free = (begin.low - stroke.first) // size
    found = falls(stroke, -(-window // size), free, begin.baseline, begin.noise, allowed.drop)
    punctures = []
    for a, b in found:
        fall = locate(force, stroke.sample(a), stroke.sample(b + 1), size, window, begin.noise)
        low, place = max(fall.low - allowed.lag, 0), float(depth[fall.peak])
        punctures.append(
            Puncture(float(time[fall.peak]), place, fall.force, low, fall.high, fall.drop, place - contact.depth)
        )
    leaving = None if last is None else _event(time, depth, force, last, allowed.lag)
    return Insertion(cycle, contact, tuple(punctures), leaving, begin.free, begin.baseline, begin.noise)


def _event(time: np.ndarray, depth: np.ndarray, force: np.ndarray, where: Onset, lag: int) -> Event:
    """``where`` as an event, at the first sample past its depth; a filter may have shown it ``lag`` samples late."""
    low, high = max(where.low - lag, 0), min(where.high, len(depth) - 1)
    between = depth[low : high + 1]
    passed = np.flatnonzero(between >= where.depth if depth[high] >= depth[low] else between <= where.depth)
    at = low + int(passed[0]) if len(passed) else high
    return Event(float(time[at]), float(where.depth), float(force[at]), low, high)


def _ends(
    time: np.ndarray, depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: Limits
) -> tuple[Onset | None, Onset | None]:
    """Contact and exit, ``low`` and ``high`` as samples; both are sought again without the drift between them."""
    span = slice(cycle.start, cycle.end)
    if cycle.withdrawn and only_drift(time[span], force[span], allowed.size):
        return None, None
    begin, last = _contact(depth, force, cycle, allowed), None
    if begin is None or not cycle.withdrawn:
        return begin, None
    last = leave(depth, force, cycle, allowed.size, allowed.crossing)
    peak = float(np.max(np.abs(force[span] - begin.baseline)))
    if last is None or not returned(begin, last, float(depth[cycle.stop - 1]), peak):
        return begin, None
    drift = last.baseline - begin.baseline
    if abs(drift) <= max(begin.noise, SMALL_DRIFT * peak):
        return begin, last
    before, after = time[(cycle.start + begin.low) // 2], time[(last.high + cycle.end - 1) // 2]
    level = force - drift * (time - before) / (after - before)
    again = _contact(depth, level, cycle, allowed), leave(depth, level, cycle, allowed.size, allowed.crossing)
    return again if None not in again else (begin, last)


def _contact(depth: np.ndarray, force: np.ndarray, cycle: Cycle, allowed: Limits) -> Onset | None:
    """The contact of the inward stroke, its blocks turned into samples."""
    stroke = blocks(depth, force, cycle.start, cycle.stop, allowed.size)
    found = onset(stroke, allowed.crossing)
    return None if found is None else replace(found, low=stroke.sample(found.low), high=stroke.sample(found.high + 1))
