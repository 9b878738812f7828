# SPDX-License-Identifier: Apache-2.0
"""Whether readings are complete and new: a 32-bit counter unwrapped, with counts of lost, duplicated and late records;
and readings with fresh counters that are still no measurement of the present force: frozen, late, or of another scale.
"""

import math
from collections import deque
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from .source import ForceSample

LATE_WINDOW = 4096  # records by which one may be late: 4 s at 1 kHz
_WRAP, _HALF = 1 << 32, 1 << 31
_MAX_LOSS = 1 << 20  # records; a larger jump is a restarted counter
_MIN_JUMP = 100.0  # records ahead that are never a restart
_SECOND = 1_000_000_000  # [ns]
_FALSE_ALARMS = 1e-12  # probability that a working sensor repeats as many readings by chance
_DEVIATIONS = 3.0  # of the share of changes that is learned from a finite number of readings
_MIN_SHARE = 0.01  # of readings that change, below which nothing follows from the noise
_QUIET = 0.25  # of the variance of the noise at rest, below which a sensor has lost its scale
_MIN_QUANTA = 0.5  # standard deviations of a quantum, below which its noise depends on where between two counts it is
_BLOCK = 20  # readings whose mean shows a jump of the scale
_MAX_SCALE = 0.8  # after a jump, of that before
_WITHIN = 4.0  # standard errors within which six axes that fall by one factor agree, but for one time in 2000
_COINCIDENCE = 0.01  # probability that forces by chance change all axes by one factor
_BUCKET_S, _BUCKETS = 1.0, 20  # over which the smallest delay is remembered: a clock may be wrong by 1 %


class Kind(StrEnum):
    """How a record counts."""

    NEW = "new"
    DUPLICATED = "duplicated"
    LATE = "late"


class Counts(NamedTuple):
    """Counts of records in one second of host time, or in total. Late records reduce ``lost`` of their second."""

    second: int
    received: int
    lost: int
    duplicated: int
    late: int


class Unwrapped:
    """Numbers for counters. A jump back beyond ``LATE_WINDOW``, or ahead by more than a million, is a ``restart``: the
    numbers then continue after as many records as fit into the elapsed host time at ``rate`` [Hz].

    A jump ahead by more records than twice that time holds, and a second more, is a restart, too.
    """

    def __init__(self, rate: float):
        self.restart = 0
        self._rate, self._offset = rate, 0
        self._highest: int | None = None
        self._arrival = 0

    def next(self, counter: int, arrival: int) -> tuple[int, bool]:
        """The number of a ``counter``, 0 to 2^32 - 1, that arrived at ``arrival`` [ns], and whether it is beyond all
        before without a restart. O(1)."""
        restarts, before = self.restart, self._highest
        number = self._number(counter, arrival)
        return number, self.restart == restarts and (before is None or number > before)

    def _number(self, counter: int, arrival: int) -> int:
        if self._highest is None:
            self._highest, self._arrival = counter, arrival
        ahead = (counter + self._offset - self._highest + _HALF) % _WRAP - _HALF
        elapsed = max(0, round((arrival - self._arrival) * self._rate / _SECOND))
        if not -LATE_WINDOW < ahead <= min(_MAX_LOSS, 2 * elapsed + max(self._rate, _MIN_JUMP)):
            ahead = max(1, elapsed)
            self._offset = (self._highest + ahead - counter) % _WRAP
            self.restart += 1
        number = self._highest + ahead
        if ahead > 0:
            self._highest, self._arrival = number, arrival
        return number


class SequenceCheck:
    """Counts records by their unwrapped number, O(1) per record; ``lost`` is expected minus received, each once."""

    def __init__(self):
        self.received = self.duplicated = self.late = 0
        self.seconds: list[Counts] = []  # that ended; whoever takes them may clear it
        self._first = self._highest = self._start = 0
        self._received_bits = 0  # bit k: the record ``_highest - k`` was received
        self._second_start = Counts(second=0, received=0, lost=0, duplicated=0, late=0)  # totals when it began

    @property
    def lost(self) -> int:
        """Records that are missing up to now."""
        return self._highest - self._first + 1 - self.received if self.received else 0

    @property
    def total(self) -> Counts:
        """Totals; ``second`` is the number of the current second."""
        return Counts(self._second_start.second, self.received, self.lost, self.duplicated, self.late)

    def add(self, sequence: int, arrival: int) -> Kind:
        """Count the record ``sequence``, arrived at ``arrival`` [ns]; one older than ``LATE_WINDOW`` is a duplicate."""
        self._advance(arrival)
        kind = self._kind(sequence)
        if kind is Kind.DUPLICATED:
            self.duplicated += 1
            return kind
        self.received += 1
        self.late += kind is Kind.LATE
        return kind

    def close(self) -> None:
        """End the current second."""
        if self.received + self.duplicated > self._second_start.received + self._second_start.duplicated:
            self._end_second(self._second_start.second + 1)

    def _advance(self, arrival: int) -> None:
        if not self.received:
            self._start = arrival
        second = (arrival - self._start) // _SECOND
        if second > self._second_start.second:
            self._end_second(second)

    def _end_second(self, following: int) -> None:
        now = self.total
        self.seconds.append(Counts(now.second, *(b - a for a, b in zip(self._second_start[1:], now[1:]))))
        self._second_start = now._replace(second=following)

    def _kind(self, sequence: int) -> Kind:
        if not self.received:
            self._first = self._highest = sequence
            self._received_bits = 1
            return Kind.NEW
        ahead = sequence - self._highest
        if ahead > 0:
            kept = self._received_bits << ahead if ahead < LATE_WINDOW else 0
            self._received_bits, self._highest = (kept | 1) & ((1 << LATE_WINDOW) - 1), sequence
            return Kind.NEW
        bit = 1 << -ahead if -ahead < LATE_WINDOW else 0
        if not bit or self._received_bits & bit:
            return Kind.DUPLICATED
        self._received_bits |= bit
        self._first = min(self._first, sequence)
        return Kind.LATE


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


class QuietCheck:
    """Whether the noise of the axial force has fallen to less than half: a sensor that loses its scale loses its noise
    with it, and no motion takes any away.

    The noise is that of second differences, which hardly contain the motion, over as many ``readings`` as a working
    sensor is this quiet in with a probability of 1e-12, by Chernoff's bound for their number of independent values;
    infinite if too few readings at rest, or too coarse ones, show it.
    """

    def __init__(self):
        self.readings = math.inf
        self._quiet_sum = self._sum = 0.0
        self._squares: deque[float] = deque()
        self._last = (0.0, 0.0)

    def learn(self, force: np.ndarray) -> None:
        """Learn from a force (n,) [N] at rest, of whose variance the upper bound counts."""
        steps = np.abs(np.diff(force))
        second = np.diff(force, 2)
        variance = float(np.mean(second**2)) if len(second) else 0.0
        if not variance > 6.0 * (_MIN_QUANTA * float(steps[steps > 0.0].min(initial=math.inf))) ** 2:
            return
        lags = len(second) // 4
        correlation = np.correlate(second, second, "full")[len(second) :][:lags] / (len(second) * variance)
        correlated = 1.0 + 2.0 * float(correlation @ correlation)
        share = _QUIET * (1.0 + _DEVIATIONS * math.sqrt(2.0 * correlated / len(second)))
        if share < 1.0:
            rarity = math.log(1.0 / share) - 1.0 + share
            self.readings = math.ceil(-2.0 * correlated * math.log(_FALSE_ALARMS) / rarity)
            self._quiet_sum = _QUIET * variance * self.readings

    def add(self, force: float) -> bool:
        """Whether the readings up to this one are too quiet."""
        if math.isinf(self.readings):
            return False
        before, last = self._last
        self._last = last, force
        self._squares.append((force - 2.0 * last + before) ** 2)
        self._sum += self._squares[-1]
        if len(self._squares) > self.readings:
            self._sum -= self._squares.popleft()
        return len(self._squares) == self.readings and self._sum < self._quiet_sum


class ScaleCheck:
    """Whether all axes fell by one factor between two means of 20 readings, with one mean in between: a sensor that
    loses its scale takes its bias along, a force leaves it.

    Judged are the axes that are mostly bias: of it a quarter is force at most, of which the loss is a fall to 0.8. All
    must agree, within their noise and what the force grows on, and so closely that forces that change each axis at
    random, by up to as much, do so in one of 100 changes. Such changes are met in one of ten insertions: a false alarm
    in less than one of 1000.
    """

    def __init__(self):
        self._sum, self._count = np.zeros(6), 0
        self._means: deque[np.ndarray] = deque(maxlen=4)
        self._bias = self._error = np.full(6, math.inf)

    def learn(self, wrenches: np.ndarray) -> None:
        """Learn bias and noise from readings (n, 6) at rest; that of means of 20, of correlated readings too."""
        self._bias = wrenches.mean(axis=0)
        means = wrenches[: len(wrenches) // _BLOCK * _BLOCK].reshape(-1, _BLOCK, 6).mean(axis=1)
        found = means.std(axis=0, ddof=1) if len(means) > 1 else np.zeros(6)
        self._error = np.maximum(found, wrenches.std(axis=0) / math.sqrt(_BLOCK))

    def add(self, wrench: tuple[float, ...]) -> float:
        """The factor by which the scale fell, or 1."""
        self._sum += wrench
        self._count += 1
        if self._count < _BLOCK:
            return 1.0
        self._means.append(self._sum / _BLOCK)
        self._sum, self._count = np.zeros(6), 0
        if len(self._means) < 4:
            return 1.0
        first, before, _, now = self._means
        own = (4.0 * np.abs(before - self._bias) < np.abs(self._bias)) & (self._error > 0.0)
        if not own.any():
            return 1.0
        factors = now[own] / before[own]
        within = (_WITHIN * math.sqrt(2.0) * self._error + 2.0 * np.abs(before - first))[own] / np.abs(before[own])
        factor = float(np.average(factors, weights=within**-2.0))
        if not factor < _MAX_SCALE or np.any(np.abs(factors - factor) > within):
            return 1.0
        chance = float(np.prod(np.sort(np.minimum(within / (1.0 - factor), 1.0))[1:]))
        return factor if chance < _COINCIDENCE else 1.0


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
