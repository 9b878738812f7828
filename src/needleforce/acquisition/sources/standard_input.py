# SPDX-License-Identifier: Apache-2.0
"""Samples from any program: lines on standard input, as a force source and, where they have a depth, an axis."""

import math
import os
import re
import select
import time
from collections import deque
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from ...errors import InputError
from ...recording.columns import choose, dimension, split
from ...units import parse
from ...wire.axis_lines import AxisState
from ...wire.rdt import AXES
from .gauge_calibration import GAUGES, Calibration
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
_QUANTITY = {"fz": "force"}  # the axial force has the name of a recording
_WANTED = ("time", "depth", "velocity", "force", "fx", "fy", "tx", "ty", "tz")
_GAUGE = re.compile(r"(?:v|g|(?:strain )?gau?ge)[ _]?(\d)(?:[ _]*[\[(]?v[\])]?)?", re.IGNORECASE)
_OTHERS = ("time", "depth", "velocity", "sequence")
_ENDS = {"time": (0.0, 4e9), "sequence": (0.0, 2.0**32 - 1.0), "depth": (-1e3, 1e3), "velocity": (-1e3, 1e3)}  # SI
_LARGEST = 1e9  # of a force, torque or voltage in any unit
_SEQUENCE = ("sequence", "seq", "rdt_sequence")
_EXAMPLE = "Write a first line such as time_s,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm."
_USUAL = {"time": "s", "length": "mm", "velocity": "mm_s", "force": "N", "torque": "Nm"}


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


class LineAxis:
    """The depth and velocity of the lines as the states of an axis that nobody here commands."""

    limits = None

    def __init__(self):
        self._states: deque[tuple[AxisState, int]] = deque()
        self._number, self._last = 0, None

    def take(self, others: dict[str, np.ndarray], time_ns: list[int], now: int) -> None:
        """Keep what the lines say, (n,) [m] and [m/s], at ``time_ns``; without velocity it is the change of depth."""
        depth, seconds = others["depth"], np.array(time_ns) / _SECOND
        before = self._last or (seconds[0], depth[0])
        steps = np.diff(seconds, prepend=before[0])
        changes = np.divide(np.diff(depth, prepend=before[1]), steps, out=np.zeros(len(depth)), where=steps > 0.0)
        velocity = others.get("velocity", changes)
        self._last = seconds[-1], depth[-1]
        for at, place, speed in zip(seconds.tolist(), depth.tolist(), velocity.tolist()):
            state = AxisState(self._number, at, place, speed, "moving" if speed else "idle")
            self._states.append((state, now))
            self._number += 1

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival [ns]."""
        states = list(self._states)
        self._states.clear()
        return states

    def move(self, depth: float, speed: float) -> None:
        """Refused: the program that writes the lines moves the needle, or nobody does."""
        raise InputError("move", f"to {depth:g} m", "standard input takes no commands", next_step="Use --axis.")

    def site(self, number: int) -> None:
        """Refused, as ``move``."""
        raise InputError("site", number, "standard input takes no commands", next_step="Use --axis.")

    def alive(self) -> None:
        """Nothing waits for it."""

    def send_stop(self) -> None:
        """Nothing can be stopped."""

    def stop(self) -> bool:
        """Nothing was stopped."""
        return False

    def close(self) -> None:
        """Nothing is held."""


@dataclass(frozen=True, eq=False)
class LineColumns:
    """Where the values stand in a line of ``count`` cells parted by ``delimiter``, None for blanks.

    ``used`` are the indices of what is read: first the ``forces`` cells that make the wrench, by ``matrix`` (6, forces)
    [SI] or by a calibration, then ``others`` (of time, depth, velocity, sequence), each with its SI units in one.
    """

    delimiter: bytes | None
    count: int
    used: list[int]
    forces: int
    matrix: np.ndarray | None
    others: dict[str, float]

    def numbers(self, line: bytes) -> list[float] | None:
        """The used cells of a line; None for a line of another length, or that holds what is no finite number, or what
        a recording cannot hold, as a time before 0 or beyond 4e9 s.
        """
        cells = line.split(self.delimiter)
        if len(cells) != self.count or b"_" in line:
            return None
        try:
            found = [float(cells[k]) for k in self.used]
        except ValueError:
            return None
        return found if math.isfinite(sum(map(abs, found))) and self._possible(found) else None

    def _possible(self, found: list[float]) -> bool:
        """Whether a recording can hold the cells."""
        if max(map(abs, found[: self.forces])) > _LARGEST:
            return False
        others = zip(self.others.items(), found[self.forces :])
        return all(_ENDS[name][0] <= scale * value <= _ENDS[name][1] for (name, scale), value in others)


def columns_of(header: bytes, calibration: Calibration | None, place: str) -> LineColumns:
    """The columns that a header names. Raises InputError for one without a force or voltages, or without units."""
    text = header.decode("utf-8-sig", "replace").strip()
    delimiter = next((mark for mark in "\t;," if mark in text), None)
    headers = [cell.strip().strip('"') for cell in (text.split(delimiter) if text else [])]
    gauges = _gauges(headers, place)
    rest = ["" if index in gauges else cell for index, cell in enumerate(headers)]
    chosen = choose(rest, _WANTED, {}, place)
    scale = {quantity: _scale(column, place) for quantity, column in chosen.items()}
    index = {quantity: column.index for quantity, column in chosen.items()}
    index |= dict([("sequence", k) for k, cell in enumerate(headers) if cell.casefold() in _SEQUENCE][:1])
    force, matrix = _force(gauges, index, scale, calibration, headers, place)
    if "velocity" in index and "depth" not in index:
        raise InputError(
            "column of the depth", "missing", "a velocity alone is no place", place, "Write depth_mm, too."
        )
    others = {quantity: scale.get(quantity, 1.0) for quantity in _OTHERS if quantity in index}
    used = [*force, *(index[quantity] for quantity in others)]
    return LineColumns(delimiter and delimiter.encode(), len(headers), used, len(force), matrix, others)


def _gauges(headers: list[str], place: str) -> list[int]:
    """Where the six voltages stand, in order; nothing where there are none."""
    found = {int(match[1]): k for k, cell in enumerate(headers) if (match := _GAUGE.fullmatch(cell))}
    if not found:
        return []
    first = min(found)
    if sorted(found) != list(range(first, first + GAUGES)) or first > 1:
        names = ", ".join(headers[k] for k in found.values())
        raise InputError(
            "gauge voltages", names, f"{GAUGES} are needed, from 0 or 1", place, "Write v0,v1,v2,v3,v4,v5."
        )
    return [found[number] for number in sorted(found)]


def _scale(column, place: str) -> float:
    if column.unit is None:
        advice = f"Write it into the header, as {split(column.header)[0]}_{_USUAL[dimension(column.quantity)]}."
        raise InputError(f"unit of column {column.header!r}", "missing", "a stream is not guessed at", place, advice)
    return float(parse(column.unit, dimension(column.quantity), column.quantity, place).to_si(1.0))


def _force(gauges, index, scale, calibration, headers, place) -> tuple[list[int], np.ndarray | None]:
    """The indices of what makes the wrench, and the matrix where no calibration does."""
    if bool(gauges) != bool(calibration):
        why = "voltages need a calibration" if gauges else "a calibration needs six voltages, v0 to v5"
        raise InputError("calibration", "none" if gauges else "given", why, place, "Use --calibration FILE with them.")
    if gauges:
        return gauges, None
    axes = [(k, _QUANTITY.get(axis, axis)) for k, axis in enumerate(AXES) if _QUANTITY.get(axis, axis) in index]
    if "force" not in index:
        named = ", ".join(map(repr, headers))
        raise InputError("column of the axial force", "missing", f"the header is {named}", place, _EXAMPLE)
    matrix = np.zeros((len(AXES), len(axes)))
    for n, (k, quantity) in enumerate(axes):
        matrix[k, n] = scale[quantity]
    return [index[quantity] for _, quantity in axes], matrix
