# SPDX-License-Identifier: Apache-2.0
"""Faults of the rig by name, with their meanings and ranges, and the link between sensor and client that has them: on
it datagrams are lost, duplicated, reordered or delayed."""

import heapq
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple

import numpy as np

from ...checks import one_of
from ...errors import InputError
from ...units import number_in
from ...wire.net_ft import RECORD_SIZE
from ..run import FORCE_RATE_HZ


class Fault(NamedTuple):
    """Meaning of a fault, the range of its value, and its value when it is absent."""

    meaning: str
    low: float
    high: float
    absent: float


def _share(meaning: str) -> Fault:
    return Fault(f"share of {meaning}", 0.0, 1.0, 0.0)


def _moment(meaning: str) -> Fault:
    return Fault(f"rig seconds after which {meaning}", 0.0, 1e6, math.inf)


FAULTS = {
    "lost": _share("packets that never arrive"),
    "lost_burst": Fault("packets lost in a row each time; the share stays", 1.0, 1000.0, 1.0),
    "duplicated": _share("packets that arrive twice"),
    "reordered": _share("packets that one to three later ones overtake"),
    "late": _share("packets delayed, each by up to late_ms"),
    "late_ms": Fault("longest delay of a late packet [ms]", 1.0, 10_000.0, 20.0),
    "status_error": _share("records whose status reports a failed serial link of the sensor"),
    "stale": _share("records that repeat the previous reading: sample counter and counts do not change"),
    "foreign": _share("packets with an additional packet of random counts from another socket"),
    "wrong_size": _share("packets with an additional packet that is too short or too long"),
    "sensor_drift_ppm": Fault(
        "how much faster the sensor's clock runs than the rig's [1e-6]", -10_000.0, 10_000.0, 0.0
    ),
    "axis_drift_ppm": Fault("how much faster the axis' clock runs than the rig's [1e-6]", -10_000.0, 10_000.0, 0.0),
    "clock_offset_s": Fault("time of the axis' clock at the rig's start [s]", -1e6, 1e6, 0.0),
    "stall_at_s": _moment("the axis is stuck"),
    "axis_silent_at_s": _moment("the axis neither receives nor sends anything"),
    "sensor_silent_at_s": _moment("the sensor neither receives nor sends anything"),
    "power_cut_s": _moment("everything stops and nothing answers"),
}


def checked_faults(given: Mapping[str, float]) -> dict[str, float]:
    """The value of every fault; faults that are not ``given`` are absent.

    Raises InputError for an unknown fault and for a value outside its range.
    """
    for name, value in given.items():
        one_of("fault", name, FAULTS)
        fault = FAULTS[name]
        if not fault.low <= value <= fault.high:
            raise InputError(f"fault {name}", value, f"outside {fault.low:g} to {fault.high:g}: {fault.meaning}")
    if given.get("lost_burst", 1.0) != int(given.get("lost_burst", 1.0)):
        raise InputError("fault lost_burst", given["lost_burst"], "must be an integer number of packets")
    return {name: float(given.get(name, fault.absent)) for name, fault in FAULTS.items()}


def parse_fault(text: str) -> tuple[str, float]:
    """Name and value of a text such as ``lost=0.05``. Raises InputError for any other text."""
    name, _, number = text.partition("=")
    try:
        return name.strip(), number_in(number)
    except ValueError:
        raise InputError("fault", repr(text), "not a name with a number", next_step="Write it as lost=0.05.") from None


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
