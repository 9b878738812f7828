# SPDX-License-Identifier: Apache-2.0
"""The link between sensor and client, on which datagrams are lost, duplicated, reordered or delayed."""

import heapq
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple

import numpy as np

from ...wire.rdt import RECORD_SIZE
from ..run import FORCE_RATE_HZ


class Datagram(NamedTuple):
    """Time of sending [s], order among datagrams of the same time, bytes, and whether another socket sends it."""

    due: float
    order: int
    data: bytes
    foreign: bool


@dataclass
class SentRecords:
    """Ground truth of one stream: the number of records, and the sequence numbers affected by each fault.

    ``overtaken`` and ``late`` records were delayed; ``foreign`` and ``wrong_size`` count additional packets.
    """

    sent: int = 0
    lost: list[int] = field(default_factory=list)
    duplicated: list[int] = field(default_factory=list)
    overtaken: list[int] = field(default_factory=list)
    late: list[int] = field(default_factory=list)
    status_error: list[int] = field(default_factory=list)
    stale: list[int] = field(default_factory=list)
    foreign: int = 0
    wrong_size: int = 0


class LossyLink:
    """Accepts datagrams and returns them when they are due; ``stream`` logs what was done to them.

    Each datagram has its own row of random numbers, so that changing one fault does not affect the others.
    """

    def __init__(self, faults: Mapping[str, float], random: np.random.Generator):
        self._faults, self._random, self._foreign_random = faults, random, random.spawn(1)[0]
        self._queue: list[tuple[Datagram, Sequence[int]]] = []
        self._order, self._left_of_burst = count(), 0
        self.stream = SentRecords()

    def begin(self) -> SentRecords:
        """Begin a new stream; datagrams of the previous one that are still on the link are lost."""
        self.stream.lost += [number for _, sequences in sorted(self._queue) for number in sequences]
        self._queue, self._left_of_burst, self.stream = [], 0, SentRecords()
        return self.stream

    def send(self, time: float, data: bytes, sequences: Sequence[int]) -> None:
        """Send a datagram with the records of these sequence numbers at ``time`` [s]."""
        share, stream = self._faults, self.stream
        lost, duplicated, reordered, late, foreign, wrong, amount, size = self._random.random(8).tolist()
        if share["foreign"] > foreign:
            stream.foreign += 1
            self._put(time, self._foreign_random.bytes(RECORD_SIZE), (), foreign=True)
        if share["wrong_size"] > wrong:
            stream.wrong_size += 1
            self._put(time, self._of_wrong_size(data, size), ())
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
        if share["duplicated"] > duplicated:
            stream.duplicated += sequences
            self._put(due, data, ())

    def due(self, now: float) -> list[Datagram]:
        """The datagrams that are due by ``now`` [s], in order."""
        datagrams = []
        while self._queue and self._queue[0][0].due <= now:
            datagrams.append(heapq.heappop(self._queue)[0])
        return datagrams

    def _put(self, due: float, data: bytes, sequences: Sequence[int], foreign: bool = False) -> None:
        heapq.heappush(self._queue, (Datagram(due, next(self._order), data, foreign), sequences))

    def _is_lost(self, drawn: float) -> bool:
        """Whether a datagram is lost; the probability that a burst begins gives the requested share of losses."""
        if self._left_of_burst:
            self._left_of_burst -= 1
            return True
        share, length = self._faults["lost"], int(self._faults["lost_burst"])
        begins = drawn < share / (length * (1.0 - share) + share)
        self._left_of_burst = length - 1 if begins else 0
        return begins

    @staticmethod
    def _of_wrong_size(data: bytes, drawn: float) -> bytes:
        """A datagram whose size is not a multiple of a record's, sometimes empty."""
        short = int(drawn * RECORD_SIZE)
        return data[:short] if drawn < 0.9 else data + data[:short]
