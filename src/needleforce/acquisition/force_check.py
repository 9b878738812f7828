# SPDX-License-Identifier: Apache-2.0
"""Readings with fresh counters that are still no measurement of the present force: frozen ones, and late ones."""

import math
from collections import deque
from collections.abc import Callable

from .sources.source import ForceSample

_DEPTHS = (1, 8)  # a sensor may freeze; a fault of a buffer may repeat a few readings in turn
_FALSE_ALARMS = 1e-12  # probability that a working sensor repeats as many readings by chance
_DEVIATIONS = 3.0  # of the share of changes that is learned from a finite number of readings
_MIN_SHARE = 0.01  # of readings that change, below which nothing follows from the noise
_BUCKET_S, _BUCKETS = 1.0, 20  # over which the smallest delay is remembered: a clock may be wrong by 1 %
_SECOND = 1e9  # [ns]


class FrozenCheck:
    """Counts readings in a row whose ``part`` repeats one of the last ``depth``; the noise determines how many are too
    many.

    ``changes`` is how many of the readings at rest did not repeat an earlier one.
    """

    def __init__(self, part: Callable[[tuple[float, ...]], object], depth: int):
        self.changes = 0
        self._part, self._depth = part, depth
        self._last: deque = deque(maxlen=depth)
        self._repeats, self._max_repeats = 0, math.inf

    def learn(self, samples: list[ForceSample]) -> None:
        """Learn from readings at rest, by the lower bound of the share of changes (Wilson's interval)."""
        last: deque = deque(maxlen=self._depth)
        repeated = []
        for sample in samples:
            value = self._part(sample.wrench)
            repeated.append(value in last)
            last.append(value)
        count = max(1, len(samples) - 1)
        self.changes = repeated[1:].count(False)
        share, z = self.changes / count, _DEVIATIONS
        scatter = z * math.sqrt(share * (1.0 - share) / count + (z / (2.0 * count)) ** 2)
        low = (share + z**2 / (2.0 * count) - scatter) / (1.0 + z**2 / count)
        if low > _MIN_SHARE:
            self._max_repeats = math.ceil(math.log(_FALSE_ALARMS) / math.log1p(-low))

    def add(self, sample: ForceSample) -> int:
        """The number of readings in a row that repeat earlier ones, if there are too many; otherwise 0."""
        value = self._part(sample.wrench)
        self._repeats = self._repeats + 1 if value in self._last else 0
        self._last.append(value)
        return self._repeats if self._repeats > self._max_repeats else 0


def frozen_checks(column: int) -> list[FrozenCheck]:
    """Checks of the whole reading and of its axial force, the value at ``column``; the last one is of that alone."""
    parts = [lambda wrench: wrench, lambda wrench: wrench[column]]
    return [FrozenCheck(part, depth) for depth in reversed(_DEPTHS) for part in parts]


class Lateness:
    """How late a reading is [s]: the time it waited here, and its delay beyond the smallest of the last 20 s.

    The delay is arrival minus the sensor's own time; a delay that grows by less than one part in eighty is taken for a
    difference of the clocks.
    """

    def __init__(self):
        self._smallest: deque[tuple[float, float]] = deque()  # begin of a second, smallest delay in it

    def add(self, sample: ForceSample) -> float:
        """The lateness of a reading."""
        now, delay = sample.arrival / _SECOND, (sample.arrival - sample.device) / _SECOND
        if not self._smallest or now - self._smallest[-1][0] > _BUCKET_S:
            self._smallest.append((now, delay))
        begin, smallest = self._smallest[-1]
        self._smallest[-1] = begin, min(smallest, delay)
        while now - self._smallest[0][0] > _BUCKETS * _BUCKET_S:
            self._smallest.popleft()
        waited = (sample.read - sample.arrival) / _SECOND
        return waited + delay - min(each for _, each in self._smallest)
