# SPDX-License-Identifier: Apache-2.0
"""The writing side of a run: counts, aligns, marks and writes what the other threads received."""

import errno
import math
import os
from collections.abc import Mapping

from ..errors import InputError
from ..recording.alignment import LiveAlignment
from ..wire.axis_lines import AxisState
from ..wire.rdt import is_fault, status_words
from .motion_sequence import RunEnded
from .settings import RestBias
from .sources.sequence import Kind, SequenceCheck
from .sources.source import ForceSample, ForceSource

_TALLIES = ("foreign", "wrong_size", "stale", "restart", "dropped")
FILE_ENDS = ("disk full", "file not written")
_FULL = [os.strerror(number) for number in (errno.ENOSPC, errno.EDQUOT)]
_SECOND = 1_000_000_000  # [ns]


class DeviceClock:
    """A device's clock [ns] as this computer's [ns], as well as is known so far."""

    def __init__(self):
        self._live = LiveAlignment()
        self._origin: tuple[int, int] | None = None
        self._last = self._host = 0

    def host(self, device: int, arrival: int) -> int:
        """When the device meant, for a reading of its clock that arrived."""
        here, there = self._origin = self._origin or (device, arrival)
        if self._last > device:  # late: as far before the newest as it was taken before it
            return max(0, self._host - (self._last - device))
        seconds = self._live.update((device - here) / _SECOND, (arrival - there) / _SECOND)
        self._last, self._host = device, there + round(seconds * _SECOND)
        return self._host


class RunWriter:
    """Writes one run with ``writer``, a LogWriter. What the writer cannot raises Ended."""

    def __init__(self, writer, source: ForceSource):
        self.check = SequenceCheck()
        self.pairs: list[tuple[int, int]] = []  # clock of the sensor and arrival [ns], of one reading in ten
        self._writer, self._source = writer, source
        self._clock, self._axis_clock = DeviceClock(), DeviceClock()
        self._told = 0  # seconds that are marked
        self._tally = dict.fromkeys(_TALLIES, 0)
        self._status: set[int] = {0}
        self._condition, self._phase = "", ""
        self._arrival = 0

    @property
    def dropped(self) -> int:
        """Packets that found this computer's buffer full."""
        return getattr(self._source, "dropped", 0)

    @property
    def buffer(self) -> float:
        """How long [s] this computer keeps readings that wait."""
        return getattr(self._source, "buffer", math.inf)

    def force(self, samples: list[ForceSample]) -> None:
        """Write what is not doubled, and mark what is wrong with it."""
        for sample in samples:
            self._arrival = max(self._arrival, sample.arrival)
            kind = self.check.add(sample.sequence, sample.arrival)
            if kind is Kind.DOUBLED:
                continue
            self._mark_status(sample)
            stamp = self._clock.host(sample.device, sample.arrival)
            self._write("wrench", sample.sequence, sample.arrival, sample.device, stamp, sample.wrench)
            if not self.check.received % 10:
                self.pairs.append((sample.device, sample.arrival))
        self._mark_seconds()

    def axis(self, states: list[tuple[AxisState, int]]) -> None:
        """Write states, and mark what the axis says of itself where that changes."""
        for state, arrival in states:
            self._arrival = max(self._arrival, arrival)
            if state.condition != self._condition:
                self._condition = state.condition
                self.mark("axis", condition=state.condition)
            device = max(0, round(state.time * _SECOND))
            stamp = self._axis_clock.host(device, arrival)
            self._write("state", state.number, arrival, device, stamp, state.depth, state.velocity)

    def bias(self, bias: RestBias) -> None:
        """Mark the bias."""
        self.mark("bias", wrench=list(bias.wrench), noise=list(bias.noise), samples=bias.samples)

    def phase(self, name: str) -> None:
        """Mark a phase where it begins."""
        if name != self._phase:
            self._phase = name
            self.mark("phase", name=name)

    def mark(self, kind: str, **facts) -> None:
        """A mark at the time of the last arrival."""
        self._write("mark", self._arrival, kind, **facts)

    def flush(self) -> None:
        """Bring all before to the disk."""
        self._write("flush")

    def close(self, why: str, end: Mapping[str, str]) -> None:
        """Mark the end and close the file."""
        self.check.close()
        self._mark_seconds()
        self.mark("end", why=why)
        self._write("close", end)

    def _mark_status(self, sample: ForceSample) -> None:
        """Each reading that is not to be trusted, so that it can be left out; another status once a second."""
        if is_fault(sample.status) or sample.status not in self._status:
            self._status.add(sample.status)
            words = status_words(sample.status)
            self.mark("status", sequence=sample.sequence, status=sample.status, words=words)

    def _mark_seconds(self) -> None:
        """Losses and strange packets, once a second; a status is told again in the next."""
        if len(self.check.seconds) == self._told:
            return
        for counts in self.check.seconds[self._told :]:
            if counts.lost or counts.doubled or counts.late:
                self.mark("lost", **counts._asdict())
        self._told = len(self.check.seconds)
        self._status = {0}
        for kind in _TALLIES:
            now = getattr(self._source, kind, 0)
            if now > self._tally[kind]:
                self.mark(kind, count=now - self._tally[kind])
                self._tally[kind] = now

    def _write(self, what: str, *arguments, **facts) -> None:
        try:
            getattr(self._writer, what)(*arguments, **facts)
        except (InputError, OSError) as error:
            raise RunEnded(FILE_ENDS[not any(words in str(error) for words in _FULL)], str(error)) from None
