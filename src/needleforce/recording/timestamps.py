# SPDX-License-Identifier: Apache-2.0
"""Time stamps: their order, repetitions, gaps and jitter, each told."""

import numpy as np

from ..errors import InputError
from .recording import Note
from .table import Table

_GAP = 3.0  # median steps
_UNEVEN = 0.1  # a step that differs from the median by more than this share of it
_TOLD_FROM = 0.01  # share of uneven steps from which jitter is told


def put_in_order(table: Table) -> None:
    """Average rows with one time stamp into one, with a note; needs no unit.

    Raises InputError where time runs backwards (line, both values) or fewer than two samples remain.
    """
    steps = np.diff(table.values["time"])
    if len(steps) and steps.min() <= 0.0:
        _refuse_backwards(table, steps)
        _merge(table, steps)
    count = len(table.values["time"])
    if count < 2:
        raise InputError(
            "number of samples",
            count,
            "at least 2 are needed",
            str(table.layout.path),
            "Check that the recording is complete and that its time column counts.",
        )


def unsteadiness(time: np.ndarray) -> list[Note]:
    """Notes on gaps (steps above three medians) and jitter of a strictly increasing time (n,) [s]."""
    steps = np.diff(time)
    if steps.max() <= (1.0 + _UNEVEN) * steps.min():  # then none is so far from the median: spares finding it
        return []
    median = float(np.median(steps))
    notes = []
    if steps.max() > _GAP * median:
        gaps, at = int(np.count_nonzero(steps > _GAP * median)), int(np.argmax(steps))
        notes.append(
            Note(
                "gap",
                f"{gaps} gaps, the longest of {steps[at] * 1e3:.4g} ms at {time[at]:.6g} s; "
                f"the median step is {median * 1e3:.4g} ms",
                gaps,
            )
        )
    uneven = int(np.count_nonzero(np.abs(steps - median) > _UNEVEN * median))
    if uneven > _TOLD_FROM * len(steps):
        low, high = np.percentile(steps, [5, 95]) * 1e3
        notes.append(
            Note(
                "jitter",
                f"{uneven} of {len(steps)} steps differ from their median of {median * 1e3:.4g} ms "
                f"by over 10 %; 90 % lie between {low:.4g} and {high:.4g} ms",
                uneven,
            )
        )
    return notes


def _refuse_backwards(table: Table, steps: np.ndarray) -> None:
    back = np.flatnonzero(steps < 0.0)
    if len(back):
        row = int(back[0]) + 1
        before, after = table.values["time"][row - 1], table.values["time"][row]
        raise InputError(
            "time",
            f"{after:.10g} after {before:.10g}",
            "it must not run backwards",
            table.place(row),
            f"It does so {len(back)} times: sort the lines, or save each run in its own file.",
        )


def _merge(table: Table, steps: np.ndarray) -> None:
    starts = np.flatnonzero(np.concatenate([[True], steps > 0.0]))
    sizes = np.diff(np.append(starts, len(steps) + 1))
    time = table.values["time"][starts]  # as it is: an average of equal stamps could be off by an ulp
    table.values = {q: np.add.reduceat(values, starts) / sizes for q, values in table.values.items()} | {"time": time}
    table.rows = starts if table.rows is None else table.rows[starts]
    count = int(np.count_nonzero(steps == 0.0))
    table.notes.append(Note("repeated_time", f"{count} samples repeat a time stamp: averaged into one each", count))
