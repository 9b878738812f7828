# SPDX-License-Identifier: Apache-2.0
"""Samples from any program: lines on standard input as a force source and, if they contain a depth, as an axis."""

import math
import os
import queue
import re
import select
import threading
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import msgspec
import numpy as np

from ...errors import InputError
from ...recording.quantities import by_name, dimension, split
from ...recording.roles import RECORDINGS, Column, Vocabulary, assign_columns
from ...recording.table import Table
from ...units import parse
from ...wire.axis_lines import AxisState
from ...wire.net_ft import AXES
from .arrival_time import host_time_ns
from .gauge_calibration import GAUGES, Calibration
from .reading_checks import Unwrapped
from .source import ForceSample

HEADER_TIMEOUT_S = 10.0
MAX_INVALID_SHARE = 0.1  # of the lines, above which the input is refused
_MIN_LINES = 100  # before the share of invalid lines is checked
_READ_BYTES = 1 << 16
_SELECTS = os.name == "posix"  # elsewhere a thread waits for a pipe, as select takes sockets only
_MAX_LINE_BYTES = 1 << 16
_MAX_DISCARDING_READS = 64  # to empty a pipe
_SECOND = 1e9  # [ns]
_DEFAULT_RATE_HZ = 1000.0  # source paper sec. 1
_QUANTITY = {"fz": "force"}  # name of the axial force in a recording
_QUANTITIES = ("time", "depth", "velocity", "force", "fx", "fy", "tx", "ty", "tz")
_BY_NAME = Vocabulary(dimensions=RECORDINGS.dimensions, recognised={"name": by_name})
_GAUGE = re.compile(r"(?:v|g|(?:strain )?gau?ge)[ _]?(\d)(?:[ _]*[\[(]?v[\])]?)?", re.IGNORECASE)
_OTHER_QUANTITIES = ("time", "depth", "velocity", "sequence")
_RANGES = {"time": (0.0, 4e9), "sequence": (0.0, 2.0**32 - 1.0), "depth": (-1e3, 1e3), "velocity": (-1e3, 1e3)}  # SI
_MAX_MAGNITUDE = 1e9  # of a force, torque or voltage in any unit
_SEQUENCE_HEADERS = ("sequence", "seq", "rdt_sequence")
_EXAMPLE = "Write a first line such as time_s,fx_N,fy_N,fz_N,tx_Nm,ty_Nm,tz_Nm."
_EXAMPLE_UNITS = {"time": "s", "length": "mm", "velocity": "mm_s", "force": "N", "torque": "Nm"}


class StandardInput:
    """Lines of a stream as a force source; the first line is a header with units.

    Lines may also be JSON objects with the names of columns as keys, the keys of the first one in each. ``given`` and
    ``units`` are columns and units by quantity, for a header that lacks them. Without a column ``time`` the time of a
    sample is its arrival; without ``sequence`` its number is that of the line.
    Lines that do not fit the header, contain something that is not a number, or are incomplete at the end of the input
    are left out and counted in ``wrong_size``, the last of them line ``wrong_line`` after the header; more than a tenth
    of them is an InputError. A calibration is needed if the columns are six gauge voltages. ``axis`` is the depth in
    the lines; None before ``start`` and without a column
    ``depth``.
    """

    def __init__(
        self,
        stream: BinaryIO,
        calibration: Calibration | None = None,
        rate: float = _DEFAULT_RATE_HZ,
        *,
        given: Mapping[str, str] | None = None,
        units: Mapping[str, str] | None = None,
    ):
        self.clock_rate, self.axis = rate, None
        self._given, self._units, self._keys = given or {}, units or {}, None
        self.wrong_size = self.lines = self.wrong_line = 0
        self._stream, self._calibration = stream, calibration
        self._place = f"input {getattr(stream, 'name', '')}".replace("<stdin>", "-").strip()
        self._incomplete, self._ended = b"", False
        self._columns: LineColumns | None = None
        self._waiting: list[bytes] = []
        self._arrived: queue.SimpleQueue[bytes] | None = None
        self._next, self._last_invalid = 0, b""
        self._counter = Unwrapped(rate)
        self._newest = -1, -1  # number and time [ns]

    @property
    def restart(self) -> int:
        """How often the other program's counter restarted."""
        return self._counter.restart

    def start(self) -> None:
        """Wait for the header; when started again, discard the lines that arrived in between.

        Raises InputError if no header arrives in time, or it has no column of a force.
        """
        if self._columns:
            self._discard()
            return
        until = time.monotonic() + HEADER_TIMEOUT_S
        while not (self._waiting or self._ended):
            left = until - time.monotonic()
            if left <= 0.0:
                limit = f"none within {HEADER_TIMEOUT_S:g} s"
                raise InputError("header", "missing", limit, self._place, "Flush every line.")
            self._waiting = [line for line in self._read(left) if _has_values(line)]
        if not self._waiting:
            raise InputError("header", "missing", "the input ends before it", self._place, _EXAMPLE)
        header = self._waiting[0]
        if header.lstrip().startswith(b"{"):
            self._keys = _keys(header, self._place)
            header = b",".join(self._keys)
        else:
            del self._waiting[0]
        self._columns = columns_of(header, self._calibration, self._place, self._given, self._units)
        self.axis = LineAxis() if "depth" in self._columns.others else None

    @property
    def quantities(self) -> set[str]:
        """What the lines have next to the force, after ``start``."""
        return set(self._columns.others) if self._columns else set()

    def receive(self, timeout: float) -> list[ForceSample]:
        """The samples of the new lines after at most ``timeout`` [s]; EOFError at the end of the input."""
        lines, self._waiting = self._waiting, []
        if not lines:
            if self._ended:
                self._check_share()
                raise EOFError
            lines = self._read(timeout)
        now = host_time_ns()
        rows = [row for row in map(self._numbers, lines) if row is not None]
        self._check_share()
        return self._samples(np.array(rows), now) if rows else []

    def stop(self) -> None:
        """Stop reading until the next start; the other program is not notified."""

    def _discard(self) -> None:
        self._waiting = []
        for _ in range(_MAX_DISCARDING_READS):
            if not self._read(0.0):
                break

    def _read(self, timeout: float) -> list[bytes]:
        """The new complete lines without their ends; an incomplete last line is kept until it is complete."""
        data = self._within(timeout)
        if data is None:
            return []
        *lines, self._incomplete = (self._incomplete + data).split(b"\n")
        if not data:
            self._ended = True
            self.lines += bool(self._incomplete)
            if self._incomplete:
                self._leave_out(self._incomplete)
        if len(self._incomplete) > _MAX_LINE_BYTES:
            value, limit = f"over {_MAX_LINE_BYTES} bytes", "it has no end"
            raise InputError("line", value, limit, self._place, "Write text, line by line.")
        return lines

    def _within(self, timeout: float) -> bytes | None:
        """What arrives within ``timeout`` [s], nothing at the end of the input; None if nothing arrives."""
        if _SELECTS:
            ready = select.select([self._stream], [], [], timeout)[0]
            return os.read(self._stream.fileno(), _READ_BYTES) if ready else None
        if self._arrived is None:
            self._arrived = queue.SimpleQueue()
            threading.Thread(target=self._pass_on, daemon=True).start()
        try:
            return self._arrived.get(timeout=timeout)
        except queue.Empty:
            return None

    def _pass_on(self) -> None:
        while data := os.read(self._stream.fileno(), _READ_BYTES):
            self._arrived.put(data)
        self._arrived.put(b"")

    def _numbers(self, line: bytes) -> list[float] | None:
        """The numbers of a line; None for an invalid line, a blank one or a comment, of which only the first counts."""
        if not _has_values(line):
            return None
        self.lines += 1
        found = self._columns.numbers(line if self._keys is None else _cells(line, self._keys))
        if found is None:
            self._leave_out(line)
        return found

    def _leave_out(self, line: bytes) -> None:
        self.wrong_size += 1
        self.wrong_line, self._last_invalid = self.lines, line

    def _samples(self, rows: np.ndarray, now: int) -> list[ForceSample]:
        columns = self._columns
        cells, scale = rows[:, : columns.forces], columns.others
        others = {quantity: scale[quantity] * rows[:, columns.forces + k] for k, quantity in enumerate(scale)}
        wrench = self._calibration.wrench(cells) if self._calibration else cells @ columns.matrix.T
        status = self._calibration.status(cells).tolist() if self._calibration else [0] * len(rows)
        time_ns = (others["time"] * _SECOND).astype(np.int64).tolist() if "time" in others else [now] * len(rows)
        first = self._next
        self._next += len(rows)
        numbers = range(first, self._next)
        if "sequence" in others:
            numbers = [self._counter.next(int(counter), now)[0] for counter in others["sequence"]]
        fresh = [self._is_fresh(n, device) for n, device in zip(numbers, time_ns)]
        if self.axis:
            self.axis.add(others, time_ns, now)
        return [
            ForceSample(
                sequence=n, device=device, arrival=now, read=now, wrench=tuple(row), status=word, fresh=is_fresh
            )
            for n, device, row, word, is_fresh in zip(numbers, time_ns, wrench.tolist(), status, fresh)
        ]

    def _is_fresh(self, number: int, device: int) -> bool:
        """Whether number and time are both beyond the newest so far; times may stand still where lines have none."""
        newest_number, newest_time = self._newest
        has_time = "time" in self._columns.others
        fresh = number > newest_number and (device > newest_time or not has_time)
        self._newest = max(number, newest_number), max(device, newest_time)
        return fresh

    def _check_share(self) -> None:
        few = self.lines < _MIN_LINES and not self._ended
        if not few and self.wrong_size > MAX_INVALID_SHARE * self.lines + 1:  # the last one may be incomplete
            limit = f"{self.wrong_size} of {self.lines} lines do not fit the header"
            shown = repr(self._last_invalid[:80].decode("ascii", "replace"))
            advice = "Write a number for each column of the header, with a decimal point, and times from 0 to 4e9 s."
            raise InputError("line", shown, limit, self._place, advice)


def _keys(line: bytes, place: str) -> list[bytes]:
    """The keys of a JSON object in a line."""
    try:
        return [key.encode() for key in msgspec.json.decode(line, type=dict[str, Any])]
    except msgspec.DecodeError as error:
        raise InputError("first line", "no JSON object", str(error), place, _EXAMPLE) from None


def _cells(line: bytes, keys: list[bytes]) -> bytes:
    """The values of a JSON object as a line of cells; none for what is no object with these keys."""
    try:
        found = msgspec.json.decode(line, type=dict[str, Any])
    except msgspec.DecodeError:
        return b""
    return b",".join(str(found.get(key.decode())).encode() for key in keys)


def _has_values(line: bytes) -> bool:
    """Whether a line is neither blank nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith(b"#")


class LineAxis:
    """The depth and velocity in the lines as the states of an axis that takes no commands."""

    limits = None

    def __init__(self):
        self._states: deque[tuple[AxisState, int]] = deque()
        self._number, self._last = 0, None

    def add(self, others: dict[str, np.ndarray], time_ns: list[int], now: int) -> None:
        """Add depth (n,) [m] and velocity (n,) [m/s] at ``time_ns``; without a velocity it is the change of depth."""
        depth, seconds = others["depth"], np.array(time_ns) / _SECOND
        before = self._last or (seconds[0], depth[0])
        steps = np.diff(seconds, prepend=before[0])
        changes = np.divide(np.diff(depth, prepend=before[1]), steps, out=np.zeros(len(depth)), where=steps > 0.0)
        velocity = others.get("velocity", changes)
        self._last = seconds[-1], depth[-1]
        for at, here, speed in zip(seconds.tolist(), depth.tolist(), velocity.tolist()):
            state = AxisState(self._number, at, here, speed, "moving" if speed else "idle")
            self._states.append((state, now))
            self._number += 1

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival [ns]."""
        states = list(self._states)
        self._states.clear()
        return states


@dataclass(frozen=True, eq=False, kw_only=True)
class LineColumns:
    """The columns of a line with ``count`` cells separated by ``delimiter``, None for blanks.

    ``used`` are the indices of the cells that are read: first the ``forces`` cells from which the wrench follows, by
    ``matrix`` (6, forces) [SI] or by a calibration, then ``others`` (of time, depth, velocity, sequence), each with its
    factor to SI.
    """

    delimiter: bytes | None
    count: int
    used: list[int]
    forces: int
    matrix: np.ndarray | None
    others: dict[str, float]

    def numbers(self, line: bytes) -> list[float] | None:
        """The used cells of a line; None for another number of cells, for a cell that is not a finite number, or for a
        value that a recording cannot hold, such as a time before 0 or beyond 4e9 s."""
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
        if max(map(abs, found[: self.forces])) > _MAX_MAGNITUDE:
            return False
        others = zip(self.others.items(), found[self.forces :])
        return all(_RANGES[name][0] <= scale * value <= _RANGES[name][1] for (name, scale), value in others)


def columns_of(
    header: bytes,
    calibration: Calibration | None,
    place: str,
    given: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> LineColumns:
    """The columns of a header, or those that are given, with their units. Raises InputError for a header without a
    force or voltages, or without units."""
    text = header.decode("utf-8-sig", "replace").strip()
    delimiter = next((mark for mark in "\t;," if mark in text), None)
    headers = [cell.strip().strip('"') for cell in (text.split(delimiter) if text else [])]
    gauges = _gauges(headers, place)
    rest = ["" if index in gauges else cell for index, cell in enumerate(headers)]
    chosen = assign_columns(Table(path=Path(place), headers=rest), given or {}, _BY_NAME).chosen(_QUANTITIES)
    known = units or {}
    scale = {quantity: _scale(column, place, known.get(quantity)) for quantity, column in chosen.items()}
    index = {quantity: column.index for quantity, column in chosen.items()}
    index |= dict([("sequence", k) for k, cell in enumerate(headers) if cell.casefold() in _SEQUENCE_HEADERS][:1])
    _check_calibration(gauges, calibration, place)
    force, matrix = (gauges, None) if gauges else _force(index, scale, headers, place)
    if "velocity" in index and "depth" not in index:
        limit = "there is a velocity without a depth"
        raise InputError("column of the depth", "missing", limit, place, "Write a column depth_mm, too.")
    others = {quantity: scale.get(quantity, 1.0) for quantity in _OTHER_QUANTITIES if quantity in index}
    used = [*force, *(index[quantity] for quantity in others)]
    return LineColumns(
        delimiter=delimiter and delimiter.encode(),
        count=len(headers),
        used=used,
        forces=len(force),
        matrix=matrix,
        others=others,
    )


def _gauges(headers: list[str], place: str) -> list[int]:
    """The indices of the six voltages in order, or none."""
    found = {int(match[1]): k for k, cell in enumerate(headers) if (match := _GAUGE.fullmatch(cell))}
    if not found:
        return []
    first = min(found)
    if sorted(found) != list(range(first, first + GAUGES)) or first > 1:
        names = ", ".join(headers[k] for k in found.values())
        limit = f"{GAUGES} are needed, numbered from 0 or 1"
        raise InputError("gauge voltages", names, limit, place, "Write v0,v1,v2,v3,v4,v5.")
    return [found[number] for number in sorted(found)]


def _scale(column: Column, place: str, given: str | None) -> float:
    unit = given or column.unit
    if unit is None:
        advice = f"Write it into the header, as {split(column.header)[0]}_{_EXAMPLE_UNITS[dimension(column.quantity)]}."
        limit = "units of a stream are not guessed"
        raise InputError(f"unit of column {column.header!r}", "missing", limit, place, advice)
    return float(parse(unit, dimension(column.quantity), column.quantity, place).to_si(1.0))


def _check_calibration(gauges: list[int], calibration: Calibration | None, place: str) -> None:
    if bool(gauges) and not calibration:
        limit, advice = "voltages need a calibration", "Give it with --calibration FILE."
        raise InputError("calibration", "missing", limit, place, advice)
    if calibration and not gauges:
        limit, advice = "a calibration needs six voltages", "Write columns v0 to v5, or leave out --calibration."
        raise InputError("calibration", "given", limit, place, advice)


def _force(
    index: dict[str, int], scale: dict[str, float], headers: list[str], place: str
) -> tuple[list[int], np.ndarray]:
    """The indices of the forces and torques, and the matrix from them to the wrench."""
    axes = [(k, _QUANTITY.get(axis, axis)) for k, axis in enumerate(AXES) if _QUANTITY.get(axis, axis) in index]
    if "force" not in index:
        named = ", ".join(map(repr, headers))
        raise InputError("column of the axial force", "missing", f"the header is {named}", place, _EXAMPLE)
    matrix = np.zeros((len(AXES), len(axes)))
    for n, (k, quantity) in enumerate(axes):
        matrix[k, n] = scale[quantity]
    return [index[quantity] for _, quantity in axes], matrix
