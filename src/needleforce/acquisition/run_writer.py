# SPDX-License-Identifier: Apache-2.0
"""The run writer: counts, aligns, marks and writes the readings and states that other threads received."""

import errno
import math
import os
from collections.abc import Mapping
from typing import Any

from ..errors import InputError
from ..recording.alignment import LiveAlignment
from ..wire.axis_lines import AxisState
from ..wire.net_ft import is_fault, status_words
from .motion_sequence import EndReason, RunEnded
from .settings import RestBias
from .sources.reading_checks import Kind, SequenceCheck
from .sources.source import ForceSample, ForceSource

SOURCE_COUNTS = ("foreign", "wrong_size", "stale", "restart", "dropped")
FILE_ENDS = (EndReason.DISK_FULL, EndReason.FILE_NOT_WRITTEN)
_DISK_FULL_MESSAGES = [os.strerror(number) for number in (errno.ENOSPC, errno.EDQUOT)]
_PAIR_INTERVAL = 10  # readings for each pair of times that is kept for the alignment, at first
_MAX_PAIRS = 100_000  # then every second one is kept
_SECOND = 1_000_000_000  # [ns]


class DeviceClock:
    """Converts times of a device's clock [ns] to this computer's [ns], from the readings received so far."""

    def __init__(self):
        self._live = LiveAlignment()
        self._origin: tuple[int, int] | None = None
        self._last = self._host = 0

    def host(self, device: int, arrival: int) -> int:
        """The time on this computer's clock at which a reading with time ``device`` was taken."""
        device_origin, host_origin = self._origin = self._origin or (device, arrival)
        if self._last > device:  # a late reading: its distance to the newest one on the device's clock is kept
            return max(0, self._host - (self._last - device))
        seconds = self._live.update((device - device_origin) / _SECOND, (arrival - host_origin) / _SECOND)
        self._last, self._host = device, host_origin + round(seconds * _SECOND)
        return self._host


class RunWriter:
    """Writes one run with ``writer``, a LogWriter. Raises RunEnded if the writer fails.

    ``marks`` are those that were written since they were taken: arrival [ns], kind and facts.
    """

    def __init__(self, writer: Any, source: ForceSource):
        self.check = SequenceCheck()
        self.marks: list[tuple[int, str, dict[str, Any]]] = []
        self.pairs: list[tuple[int, int]] = []  # time of the sensor and arrival [ns], of some readings
        self._pair_interval = _PAIR_INTERVAL
        self._writer, self._source = writer, source
        self._clock, self._axis_clock = DeviceClock(), DeviceClock()
        self._source_counts = dict.fromkeys(SOURCE_COUNTS, 0)
        self._status: set[int] = {0}
        self._condition, self._phase = "", ""
        self._arrival = 0
        self._failed = False

    @property
    def unwritten(self) -> int:
        """Readings that arrived and that the file does not keep, because it could not be written."""
        return self.check.received - self._writer.kept if self._failed else 0

    @property
    def dropped(self) -> int:
        """Packets that arrived when this computer's receive buffer was full."""
        return getattr(self._source, "dropped", 0)

    @property
    def restarts(self) -> int:
        """How often the source's counter restarted."""
        return getattr(self._source, "restart", 0)

    @property
    def buffer(self) -> float:
        """Time [s] for which this computer's receive buffer holds unread readings."""
        return getattr(self._source, "buffer", math.inf)

    def force(self, samples: list[ForceSample]) -> list[tuple[ForceSample, int]]:
        """Write the readings except duplicated ones, and mark faults and losses; returns those that it wrote, each with
        its time [ns] on this computer's clock. All are counted before any is written, because a disk that is full loses
        no packet."""
        before, written = self.check.received, []
        new = [each for each in samples if self.check.add(each.sequence, each.arrival) is not Kind.DUPLICATED]
        for count, sample in enumerate(new, before + 1):
            self._arrival = max(self._arrival, sample.arrival)
            self._mark_status(sample)
            stamp = self._clock.host(sample.device, sample.arrival)
            record = sample.sequence, sample.arrival, sample.device, stamp, sample.wrench
            self._write("wrench", *record)
            written.append((sample, stamp))
            if not count % self._pair_interval:
                self.pairs.append((sample.device, sample.arrival))
        if len(self.pairs) > _MAX_PAIRS:
            self.pairs, self._pair_interval = self.pairs[::2], 2 * self._pair_interval
        self._mark_seconds()
        return written

    def axis(self, states: list[tuple[AxisState, int]]) -> list[tuple[AxisState, int]]:
        """Write states, and mark the axis' condition where it changes; returns them with times, as ``force``."""
        written = []
        for state, arrival in states:
            self._arrival = max(self._arrival, arrival)
            if state.condition != self._condition:
                self._condition = state.condition
                self.mark("axis", condition=state.condition)
            device = max(0, round(state.time * _SECOND))
            stamp = self._axis_clock.host(device, arrival)
            record = state.number, arrival, device, stamp, state.depth, state.velocity
            self._write("state", *record)
            written.append((state, stamp))
        return written

    def bias(self, bias: RestBias) -> None:
        """Mark the bias."""
        self.mark("bias", wrench=list(bias.wrench), noise=list(bias.noise), samples=bias.samples)

    def phase(self, name: str) -> None:
        """Mark a phase where it begins."""
        if name != self._phase:
            self._phase = name
            self.mark("phase", name=name)

    def mark(self, kind: str, **facts: Any) -> None:
        """Write a mark at the time of the last arrival."""
        self._write("mark", self._arrival, kind, **facts)
        self.marks.append((self._arrival, kind, facts))

    def flush(self) -> None:
        """Pass everything written so far to the system, so that it survives a crash of this program."""
        self._write("flush")

    def close(self, reason: EndReason, end: Mapping[str, str]) -> None:
        """Mark the end and close the file."""
        self.check.close()
        self._mark_seconds()
        self.mark("end", why=reason)
        self._write("close", end)

    def _mark_status(self, sample: ForceSample) -> None:
        """Mark each reading with a fault, so that it can be left out; any other status once a second."""
        if is_fault(sample.status) or sample.status not in self._status:
            self._status.add(sample.status)
            words = status_words(sample.status)
            self.mark("status", sequence=sample.sequence, status=sample.status, words=words)

    def _mark_seconds(self) -> None:
        """Mark losses and the counts of the source for each full second."""
        if not self.check.seconds:
            return
        for counts in self.check.seconds:
            if counts.lost or counts.duplicated or counts.late:
                self.mark("lost", **counts._asdict())
        self.check.seconds.clear()
        self._status = {0}
        for kind in SOURCE_COUNTS:
            now = getattr(self._source, kind, 0)
            if now > self._source_counts[kind]:
                self.mark(kind, count=now - self._source_counts[kind])
                self._source_counts[kind] = now

    def _write(self, method: str, *arguments: Any, **facts: Any) -> None:
        try:
            getattr(self._writer, method)(*arguments, **facts)
        except (InputError, OSError) as error:
            self._failed = True
            full = any(message in str(error) for message in _DISK_FULL_MESSAGES)
            raise RunEnded(EndReason.DISK_FULL if full else EndReason.FILE_NOT_WRITTEN, str(error)) from None
