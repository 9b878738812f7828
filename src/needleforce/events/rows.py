# SPDX-License-Identifier: Apache-2.0
"""Rows of time, force and depth as they come: from a recording that is replayed, and from lines of another program."""

import math
import time
from collections.abc import Iterator
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


class Row(NamedTuple):
    """One sample: time since the start [s], force [N], depth [m]."""

    time: float
    force: float
    depth: float


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


def rows_of_lines(source: "StandardInput", rate: float | None = None) -> Iterator[list[Row]]:
    """The rows in the lines of another program, in batches that are empty while none arrives.

    Parameters
    ----------
    source : StandardInput
        The lines, not yet started.
    rate : float, optional
        Lines a second [Hz], of lines without a time.

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
    first = None
    while True:
        try:
            samples = source.receive(_LINES_TIMEOUT_S)
        except EOFError:
            return
        states = [state for state, _ in source.axis.receive()]
        times = [1e-9 * each.device if rate is None else each.sequence / rate for each in samples]
        rows = [(at, each.wrench[2], state.depth) for at, each, state in zip(times, samples, states)]
        if first is None and rows:
            first = rows[0][0]
        yield [Row(at - first, force, depth) for at, force, depth in rows]
