# SPDX-License-Identifier: Apache-2.0
"""Rows of time, force and depth as they come: from a recording that is replayed, and from lines of another program."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..checks import above_zero
from ..errors import InputError

if TYPE_CHECKING:
    from ..acquisition.sources.standard_input import StandardInput
    from ..recording import Recording

_REPLAY_INTERVAL_S = 0.02  # between two batches of a replay
_BATCH_ROWS = 2000  # of a replay as fast as possible
_LINES_TIMEOUT_S = 0.1  # for which lines are waited
_PAUSE_S = 1.0  # after which the time continues where a clock restarts: how long it stood still is not known


class Row(NamedTuple):
    """One sample: time since the start [s], force [N], depth [m]."""

    time: float
    force: float
    depth: float


@dataclass
class Losses:
    """What could not be used of a stream, or not as it came, so far.

    Parameters
    ----------
    lines, unreadable : int
        Lines after the header, and those of them without a number for each column.
    unreadable_line : int
        The number of the last one of them, from 1 after the header; 0 without.
    late : int
        Rows that were left out because their time was not after that of the row before.
    late_time : float
        Of the last one of them, since the start [s].
    restarts : int
        How often the time went back for good. The rows after it are kept, as if a second had passed.
    restart_row : int
        The first row after the last restart, from 1; 0 without.
    """

    lines: int = 0
    unreadable: int = 0
    unreadable_line: int = 0
    late: int = 0
    late_time: float = 0.0
    restarts: int = 0
    restart_row: int = 0

    def sentences(self) -> list[str]:
        """What was lost, where, and what to do about it, a sentence each."""
        found = []
        if self.unreadable:
            where = f"{self.unreadable} of {self.lines}, the last one line {self.unreadable_line} after the header"
            step = "Write a number for each column of the header, with a decimal point."
            found.append(f"unreadable lines left out: {where}. {step}")
        if self.late:
            where = f"{self.late}, as their time is not after that of the row before, the last one at"
            found.append(f"rows left out: {where} {self.late_time:.3f} s. Write rows in the order of their time.")
        if self.restarts:
            where = f"{self.restarts}, the last one at row {self.restart_row}"
            kept = f"Rows after it are kept as if {_PAUSE_S:g} s had passed, over which no force is compared"
            step = "if another insertion begins there, watch it as a stream of its own."
            found.append(f"clock restarts: {where}. {kept}; {step}")
        return found


def replayed(recording: "Recording", speed: float = 1.0) -> Iterator[list[Row]]:
    """The rows of a recording in batches, as they came.

    Parameters
    ----------
    recording : Recording
        What is replayed.
    speed : float
        Seconds of the recording in one second, above 0; infinite for as fast as possible.

    Raises
    ------
    InputError
        If the speed is not above 0.
    """
    if not speed == math.inf:
        above_zero("speed", speed, next_step="Give how many seconds are shown in one, or inf.")
    times = recording.time - recording.time[0]
    columns = zip(times.tolist(), recording.force.tolist(), recording.depth.tolist())
    rows = [Row(*each) for each in columns]
    if math.isinf(speed):
        yield from (rows[k : k + _BATCH_ROWS] for k in range(0, len(rows), _BATCH_ROWS))
        return
    begun, first = time.monotonic(), 0
    while first < len(rows):
        due = int(np.searchsorted(times, speed * (time.monotonic() - begun), "right"))
        yield rows[first:due]
        first = due
        time.sleep(_REPLAY_INTERVAL_S)


def rows_of_lines(
    source: "StandardInput", rate: float | None = None, losses: Losses | None = None
) -> Iterator[list[Row]]:
    """The rows in the lines of another program, in batches that are empty while none arrives.

    Parameters
    ----------
    source : StandardInput
        The lines, not yet started.
    rate : float, optional
        Lines a second [Hz], of lines without a time.
    losses : Losses, optional
        Where it is noted what could not be used.

    Raises
    ------
    InputError
        If the lines have no depth or no time, or do not fit their header.
    """
    source.start()
    for quantity, example, known in (("depth", "depth_mm", False), ("time", "time_s", rate is not None)):
        if not known and quantity not in source.quantities:
            step = f"Write a column {example}, too." if quantity == "depth" else "Give --rate-hz, or write one."
            raise InputError(f"column of the {quantity}", "missing", "events need one", "input -", step)
    losses = Losses() if losses is None else losses
    clock = _Clock(losses)
    while True:
        try:
            samples = source.receive(_LINES_TIMEOUT_S)
        except EOFError:
            clock.end()
            return
        finally:
            losses.lines, losses.unreadable = source.lines, source.wrong_size
            losses.unreadable_line = source.wrong_line
        states = [state for state, _ in source.axis.receive()]
        times = [1e-9 * each.device if rate is None else each.sequence / rate for each in samples]
        rows = (Row(at, each.wrench[2], state.depth) for at, each, state in zip(times, samples, states))
        yield [each for row in rows for each in clock.take(row)]


class _Clock:
    """The time since the start, of rows whose own clock may restart. One row that goes back is late; where the next one
    continues from it, the clock has restarted."""

    def __init__(self, losses: Losses):
        self._losses = losses
        self._first, self._newest = None, -math.inf
        self._back: Row | None = None  # went back, and is kept until the next one shows why
        self._rows = 0

    def take(self, row: Row) -> list[Row]:
        """The rows that are certain now, with their time since the start."""
        if self._first is None:
            self._first = row.time
        back, self._back = self._back, None
        if row.time > self._newest:
            self._leave_out(back)
            return [self._kept(row)]
        if back is None or row.time <= back.time:
            self._leave_out(back)
            self._back = row
            return []
        self._losses.restarts += 1
        self._losses.restart_row = self._rows + 1
        self._first += back.time - self._newest - _PAUSE_S
        return [self._kept(back), self._kept(row)]

    def end(self) -> None:
        """No further row comes."""
        self._leave_out(self._back)

    def _kept(self, row: Row) -> Row:
        self._newest = row.time
        self._rows += 1
        return row._replace(time=row.time - self._first)

    def _leave_out(self, row: Row | None) -> None:
        if row is not None:
            self._losses.late += 1
            self._losses.late_time = row.time - self._first
