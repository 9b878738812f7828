# SPDX-License-Identifier: Apache-2.0
"""A counter of 32 bits as a number that only grows, and what of it is lost, doubled or late."""

from enum import StrEnum
from typing import NamedTuple

WINDOW = 4096  # records within which one may be late: 4 s at 1 kHz
_WRAP, _HALF = 1 << 32, 1 << 31
_LONGEST_LOSS = 1 << 20  # records; a longer jump is another counter
_SECOND = 1_000_000_000  # [ns]


class Kind(StrEnum):
    """What a record is."""

    NEW = "new"
    DOUBLED = "doubled"
    LATE = "late"


class Counts(NamedTuple):
    """Records of one second of host time, or of all. ``lost`` is the change of what is missing: late ones lower it."""

    second: int
    received: int
    lost: int
    doubled: int
    late: int


class Unwrapped:
    """Numbers for counters. A jump back beyond ``WINDOW``, or ahead by more than a million, is a ``restart``: the
    numbers then go on after as many records as the host's clock says went by at ``rate`` [Hz].
    """

    def __init__(self, rate: float):
        self.restart = 0
        self._rate, self._offset = rate, 0
        self._highest: int | None = None
        self._arrival = 0

    def number(self, counter: int, arrival: int) -> int:
        """The number of a ``counter``, 0 to 2^32 - 1, that arrived at ``arrival`` [ns]. O(1)."""
        if self._highest is None:
            self._highest, self._arrival = counter, arrival
        ahead = (counter + self._offset - self._highest + _HALF) % _WRAP - _HALF
        if not -WINDOW < ahead <= _LONGEST_LOSS:
            ahead = max(1, round((arrival - self._arrival) * self._rate / _SECOND))
            self._offset = (self._highest + ahead - counter) % _WRAP
            self.restart += 1
        number = self._highest + ahead
        if ahead > 0:
            self._highest, self._arrival = number, arrival
        return number


class SequenceCheck:
    """Counts what came, by unwrapped number: O(1) a record. ``lost`` is what was to come less what came, each once."""

    def __init__(self):
        self.received = self.doubled = self.late = 0
        self.seconds: list[Counts] = []
        self._first = self._highest = self._start = 0
        self._seen = 0  # bit k: the record ``_highest - k`` came
        self._told = Counts(0, 0, 0, 0, 0)  # totals at the beginning of the second

    @property
    def lost(self) -> int:
        """Records that did not come, up to now."""
        return self._highest - self._first + 1 - self.received if self.received else 0

    @property
    def total(self) -> Counts:
        """All of it; ``second`` is the number of the second that goes on."""
        return Counts(self._told.second, self.received, self.lost, self.doubled, self.late)

    def add(self, sequence: int, arrival: int) -> Kind:
        """What the record ``sequence`` is that arrived at ``arrival`` [ns]. Older than ``WINDOW``: doubled."""
        self._turn(arrival)
        kind = self._kind(sequence)
        if kind is Kind.DOUBLED:
            self.doubled += 1
            return kind
        self.received += 1
        self.late += kind is Kind.LATE
        return kind

    def close(self) -> None:
        """End the second that goes on."""
        if self.received + self.doubled > self._told.received + self._told.doubled:
            self._end_second(self._told.second + 1)

    def _turn(self, arrival: int) -> None:
        if not self.received:
            self._start = arrival
        second = (arrival - self._start) // _SECOND
        if second > self._told.second:
            self._end_second(second)

    def _end_second(self, following: int) -> None:
        now = self.total
        self.seconds.append(Counts(now.second, *(b - a for a, b in zip(self._told[1:], now[1:]))))
        self._told = now._replace(second=following)

    def _kind(self, sequence: int) -> Kind:
        if not self.received:
            self._first = self._highest = sequence
            self._seen = 1
            return Kind.NEW
        ahead = sequence - self._highest
        if ahead > 0:
            kept = self._seen << ahead if ahead < WINDOW else 0
            self._seen, self._highest = (kept | 1) & ((1 << WINDOW) - 1), sequence
            return Kind.NEW
        bit = 1 << -ahead if -ahead < WINDOW else 0
        if not bit or self._seen & bit:
            return Kind.DOUBLED
        self._seen |= bit
        self._first = min(self._first, sequence)
        return Kind.LATE
