# SPDX-License-Identifier: Apache-2.0
"""Unwrapping of a 32-bit counter into a number that does not wrap, and counts of lost, duplicated and late records."""

from enum import StrEnum
from typing import NamedTuple

LATE_WINDOW = 4096  # records by which one may be late: 4 s at 1 kHz
_WRAP, _HALF = 1 << 32, 1 << 31
_MAX_LOSS = 1 << 20  # records; a larger jump is a restarted counter
_MIN_JUMP = 100.0  # records ahead that are never a restart
_SECOND = 1_000_000_000  # [ns]


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

    def number(self, counter: int, arrival: int) -> int:
        """The number of a ``counter``, 0 to 2^32 - 1, that arrived at ``arrival`` [ns]. O(1)."""
        return self.next(counter, arrival)[0]

    def next(self, counter: int, arrival: int) -> tuple[int, bool]:
        """As ``number``, and whether it is higher than all before without a restart."""
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
