# SPDX-License-Identifier: Apache-2.0
"""Samples from any program: lines on standard input, as a force source and, where they have a depth, an axis."""

import os
import select
import time
from typing import BinaryIO

import numpy as np

from ...errors import InputError
from .calibration import Calibration
from .line_axis import LineAxis
from .line_columns import LineColumns, columns_of
from .sequence import Unwrapped
from .source import ForceSample

PATIENCE = 10.0  # [s] for the header
WORST_SHARE = 0.1  # of lines that are none, beyond which nothing is believed
_JUDGED = 100  # lines before a share of them is judged
_AT_ONCE = 1 << 16  # bytes
_LONGEST = 1 << 16  # bytes in a line
_MOST_HELD = 64  # reads that empty a pipe
_SECOND = 1e9  # [ns]
_RATE = 1000.0  # [Hz] paper sec. 1


class StandardInput:
    """Lines of ``stream`` (a binary file, pipe or terminal), their first a header with units, as a force source.

    A header of six gauge voltages needs ``calibration``. ``rate`` [Hz] is nominal. Without a column ``time`` a sample's
    clock is its arrival, without ``sequence`` its number that of the line. Lines that do not fit the header, hold what
    is no number, or are not ended when the input ends are left out and counted in ``wrong_size``; more than a tenth of
    them is an InputError. ``axis`` is what the lines say of the depth, None until ``start`` and where they say nothing.
    """

    def __init__(self, stream: BinaryIO, calibration: Calibration | None = None, rate: float = _RATE):
        self.clock_rate, self.axis = rate, None
        self.wrong_size = self.lines = 0
        self._stream, self._calibration = stream, calibration
        self._place = f"input {getattr(stream, 'name', '')}".replace("<stdin>", "-").strip()
        self._rest, self._ended = b"", False
        self._columns: LineColumns | None = None
        self._waiting: list[bytes] = []
        self._next, self._wrong = 0, b""
        self._counter = Unwrapped(rate)

    @property
    def restart(self) -> int:
        """How often the other program's counter began anew."""
        return self._counter.restart

    def start(self) -> None:
        """Await the header; started again, throw away what came meanwhile.

        Raises InputError where no header comes in time, or one that names no force.
        """
        if self._columns:
            self._throw_away()
            return
        until = time.monotonic() + PATIENCE
        while not (self._waiting or self._ended):
            left = until - time.monotonic()
            if left <= 0.0:
                raise InputError("header", "none", f"awaited for {PATIENCE:g} s", self._place, "Flush every line.")
            self._waiting = [line for line in self._read(left) if _says(line)]
        if not self._waiting:
            raise InputError("header", "none", "the input ends before it", self._place)
        self._columns = columns_of(self._waiting.pop(0), self._calibration, self._place)
        self.axis = LineAxis() if "depth" in self._columns.others else None

    def receive(self, timeout: float) -> list[ForceSample]:
        """The samples of the lines that came, after at most ``timeout`` [s]; EOFError at the end of the input."""
        lines, self._waiting = self._waiting, []
        if not lines:
            if self._ended:
                self._check_share()
                raise EOFError
            lines = self._read(timeout)
        now = time.time_ns()
        rows = [row for row in map(self._numbers, lines) if row is not None]
        self._check_share()
        return self._samples(np.array(rows), now) if rows else []

    def stop(self) -> None:
        """Nothing to tell the other program: it is read no more until the next start."""

    def _throw_away(self) -> None:
        self._waiting = []
        for _ in range(_MOST_HELD):
            if not self._read(0.0):
                break

    def _read(self, timeout: float) -> list[bytes]:
        """Whole lines that came, without their ends; an unended last one is none: it may be cut."""
        if not select.select([self._stream], [], [], timeout)[0]:
            return []
        data = os.read(self._stream.fileno(), _AT_ONCE)
        *lines, self._rest = (self._rest + data).split(b"\n")
        if not data:
            self._ended = True
            self.lines += bool(self._rest)
            self.wrong_size += bool(self._rest)
            self._wrong = self._rest or self._wrong
        if len(self._rest) > _LONGEST:
            raise InputError(
                "line", f"over {_LONGEST} bytes", "it has no end", self._place, "Write text, line by line."
            )
        return lines

    def _numbers(self, line: bytes) -> list[float] | None:
        """The numbers of a line, None for a line that is none; blank ones and comments do not count."""
        if not _says(line):
            return None
        self.lines += 1
        found = self._columns.numbers(line)
        if found is None:
            self.wrong_size += 1
            self._wrong = line
        return found

    def _samples(self, rows: np.ndarray, now: int) -> list[ForceSample]:
        columns = self._columns
        cells, scale = rows[:, : columns.forces], columns.others
        others = {quantity: scale[quantity] * rows[:, columns.forces + k] for k, quantity in enumerate(scale)}
        wrench = self._calibration.wrench(cells) if self._calibration else cells @ columns.matrix.T
        status = self._calibration.status(cells).tolist() if self._calibration else [0] * len(rows)
        time_ns = (others["time"] * _SECOND).astype(np.int64).tolist() if "time" in others else [now] * len(rows)
        first = self._next
        self._next += len(rows)
        number = self._unwrapped(others["sequence"], now) if "sequence" in others else range(first, self._next)
        if self.axis:
            self.axis.take(others, time_ns, now)
        return [
            ForceSample(n, device, now, now, tuple(row), word)
            for n, device, row, word in zip(number, time_ns, wrench.tolist(), status)
        ]

    def _unwrapped(self, counters: np.ndarray, now: int) -> list[int]:
        return [self._counter.number(int(counter), now) for counter in counters]

    def _check_share(self) -> None:
        few = self.lines < _JUDGED and not self._ended
        if not few and self.wrong_size > WORST_SHARE * self.lines + 1:  # the last one may be cut
            share = f"{self.wrong_size} of {self.lines} lines do not fit the header"
            shown = repr(self._wrong[:80].decode("ascii", "replace"))
            raise InputError(
                "line",
                shown,
                share,
                self._place,
                "Write every line as the header says, with points, times from 0 to 4e9 s.",
            )


def _says(line: bytes) -> bool:
    return bool(line.strip()) and not line.lstrip().startswith(b"#")
