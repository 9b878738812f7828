# SPDX-License-Identifier: Apache-2.0
"""Checks of the time stamps: order, repetitions, gaps and jitter."""

import numpy as np

from ..errors import InputError
from .recording import Note
from .table import Table

_GAP_STEPS = 3.0  # median steps: a longer step is a gap
UNEVEN_SHARE = 0.1  # of the median step: a step that differs by more is uneven
_MIN_JITTER_SHARE = 0.01  # of all steps: with more uneven ones a note on jitter is made


def put_in_order(table: Table) -> None:
    """Average rows with equal time stamps into one, with a note; the unit of time need not be known.

    Raises InputError if time decreases, with the line and both values.
    """
    steps = np.diff(table.values["time"])
    if len(steps) and steps.min() <= 0.0:
        _check_not_decreasing(table, steps)
        _merge(table, steps)


def check_count(table: Table) -> None:
    """Raise InputError for fewer than two samples."""
    count = len(next(iter(table.values.values())))
    if count < 2:
        raise InputError(
            "number of samples",
            count,
            "at least 2 are needed",
            str(table.layout.path),
            "Check that the recording is complete, that its columns hold values, and that its time increases.",
        )


def timing_notes(time: np.ndarray) -> list[Note]:
    """Notes on gaps (steps longer than three medians) and jitter of a strictly increasing time (n,) [s]."""
    steps = np.diff(time)
    if steps.max() <= (1.0 + UNEVEN_SHARE) * steps.min():  # then no step is far from the median
        return []
    median = float(np.median(steps))
    notes = []
    if steps.max() > _GAP_STEPS * median:
        gaps, at = int(np.count_nonzero(steps > _GAP_STEPS * median)), int(np.argmax(steps))
        notes.append(
            Note(
                "gap",
                f"{gaps} gaps, the longest of {steps[at] * 1e3:.4g} ms at {time[at]:.6g} s; "
                f"the median step is {median * 1e3:.4g} ms",
                gaps,
            )
        )
    uneven = int(np.count_nonzero(np.abs(steps - median) > UNEVEN_SHARE * median))
    if uneven > _MIN_JITTER_SHARE * len(steps):
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


def _check_not_decreasing(table: Table, steps: np.ndarray) -> None:
    decreases = np.flatnonzero(steps < 0.0)
    if len(decreases):
        row = int(decreases[0]) + 1
        before, after = table.values["time"][row - 1], table.values["time"][row]
        raise InputError(
            "time",
            f"{after:.10g} after {before:.10g}",
            "it must not decrease",
            table.place(row),
            f"It decreases {len(decreases)} times. Sort the lines, or save each run in its own file.",
        )


def _merge(table: Table, steps: np.ndarray) -> None:
    starts = np.flatnonzero(np.concatenate([[True], steps > 0.0]))
    sizes = np.diff(np.append(starts, len(steps) + 1))
    time = table.values["time"][starts]  # not averaged: an average of equal stamps could differ by an ulp
    table.values = {q: np.add.reduceat(values, starts) / sizes for q, values in table.values.items()} | {"time": time}
    table.rows = starts if table.rows is None else table.rows[starts]
    count = int(np.count_nonzero(steps == 0.0))
    table.notes.append(Note("repeated_time", f"{count} samples repeat a time stamp and are averaged", count))
