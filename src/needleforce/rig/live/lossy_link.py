# SPDX-License-Identifier: Apache-2.0
"""The way of datagrams from the sensor to who asked: on it they get lost, doubled, held up, and the like."""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple

import numpy as np

from ...wire.rdt import RECORD_SIZE
from ..run import FORCE_RATE_HZ


class Datagram(NamedTuple):
    """When it leaves [s], its place among those of the same time, its bytes, and whether another socket sends it."""

    due: float
    order: int
    data: bytes
    foreign: bool


@dataclass
class SentRecords:
    """What was really done to one stream: sequence numbers by fault, and how many records there were.

    ``overtaken`` and ``late`` are those held up; ``foreign`` and ``wrong_size`` count what was sent beside the records.
    """

    sent: int = 0
    lost: list[int] = field(default_factory=list)
    doubled: list[int] = field(default_factory=list)
    overtaken: list[int] = field(default_factory=list)
    late: list[int] = field(default_factory=list)
    status_error: list[int] = field(default_factory=list)
    stale: list[int] = field(default_factory=list)
    foreign: int = 0
    wrong_size: int = 0


class LossyLink:
    """Takes datagrams in, gives them out when they are due; what it does stands in ``stream``.

    A row of draws for each datagram: a share that changes moves no other fault's draws.
    """

    def __init__(self, faults: Mapping[str, float], random: np.random.Generator):
        self._faults, self._random, self._strange = faults, random, random.spawn(1)[0]
        self._queue: list[tuple[Datagram, Sequence[int]]] = []
        self._order, self._left_of_burst = count(), 0
        self.stream = SentRecords()

    def begin(self) -> SentRecords:
        """A new stream; what was still under way of the one before is lost."""
        self.stream.lost += [number for _, sequences in sorted(self._queue) for number in sequences]
        self._queue, self._left_of_burst, self.stream = [], 0, SentRecords()
        return self.stream

    def send(self, time: float, data: bytes, sequences: Sequence[int]) -> None:
        """A datagram of the records with these sequence numbers sets off at ``time`` [s]."""
        share, stream = self._faults, self.stream
        lost, doubled, reordered, late, foreign, wrong, amount, size = self._random.random(8).tolist()
        if share["foreign"] > foreign:
            stream.foreign += 1
            self._put(time, self._strange.bytes(RECORD_SIZE), (), foreign=True)
        if share["wrong_size"] > wrong:
            stream.wrong_size += 1
            self._put(time, self._odd(data, size), ())
        if self._is_lost(lost):
            stream.lost += sequences
            return
        due = time
        if share["reordered"] > reordered:
            stream.overtaken += sequences
            due += len(sequences) * (1.05 + 2.9 * amount) / FORCE_RATE_HZ  # between the first and the fourth after it
        if share["late"] > late:
            stream.late += sequences
            due += 1e-3 * share["late_ms"] * amount
        self._put(due, data, sequences)
        if share["doubled"] > doubled:
            stream.doubled += sequences
            self._put(due, data, ())

    def due(self, now: float) -> list[Datagram]:
        """What leaves up to ``now`` [s], in order."""
        leaving = []
        while self._queue and self._queue[0][0].due <= now:
            leaving.append(heapq.heappop(self._queue)[0])
        return leaving

    def _put(self, due: float, data: bytes, sequences: Sequence[int], foreign: bool = False) -> None:
        heapq.heappush(self._queue, (Datagram(due, next(self._order), data, foreign), sequences))

    def _is_lost(self, drawn: float) -> bool:
        """The chance of a burst to begin is such that the share of lost ones is as asked for."""
        if self._left_of_burst:
            self._left_of_burst -= 1
            return True
        share, length = self._faults["lost"], int(self._faults["lost_burst"])
        begins = drawn < share / (length * (1.0 - share) + share)
        self._left_of_burst = length - 1 if begins else 0
        return begins

    @staticmethod
    def _odd(data: bytes, drawn: float) -> bytes:
        """No multiple of a record's size, and sometimes nothing at all."""
        short = int(drawn * RECORD_SIZE)
        return data[:short] if drawn < 0.9 else data + data[:short]
