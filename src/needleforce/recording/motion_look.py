# SPDX-License-Identifier: Apache-2.0
"""A look at the columns of a table, and at a motion in another table: both clocks, and what they have in common."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .assumed_motion import AssumedMotion
from .motion_source import MotionSource
from .options import ReadOptions
from .parts import MAIN, Part, column_table
from .roles import of_main
from .stream import read_stream
from .table import Table

MAX_LISTED = 20  # columns, and recordings, that are shown
_OF_MOTION = ("time", "depth", "velocity")


@dataclass(frozen=True, kw_only=True)
class ColumnLook:
    """One column: header, stated unit, the quantity it is read as, empty if it is not used, number of values, first,
    last, smallest and largest value in the file's unit; NaN where it holds no numbers."""

    header: str
    unit: str
    quantity: str
    count: int
    first: float
    last: float
    smallest: float
    largest: float

    def cells(self, number: int) -> tuple[str, ...]:
        """What a table shows of the column with this number."""
        values = (self.first, self.last, self.smallest, self.largest)
        shown = ["" if np.isnan(value) else f"{value:.6g}" for value in values]
        return (str(number), self.header, self.unit, self.quantity, *shown)


def column_looks(part: Part, used: Sequence[str] = MAIN) -> tuple[ColumnLook, ...]:
    """The first columns of a part; of the quantities, those ``used`` are named."""
    return tuple(
        ColumnLook(header=header, unit=unit, quantity=quantity if quantity in used else "", **_range(part.table, k))
        for k, (header, unit, quantity) in enumerate(column_table(part)[:MAX_LISTED])
    )


def _range(table: Table, index: int) -> dict[str, Any]:
    """Number of values, first, last, smallest and largest of a column."""
    try:
        values = table.numbers(index)
    except InputError:
        values = np.empty(0)
    values = values[np.isfinite(values)]
    if not len(values):
        return dict.fromkeys(("first", "last", "smallest", "largest"), float("nan")) | {"count": 0}
    ends = {"first": float(values[0]), "last": float(values[-1])}
    return ends | {"smallest": float(values.min()), "largest": float(values.max()), "count": len(values)}


@dataclass(frozen=True, kw_only=True)
class MotionLook:
    """The motion of a recording in another table.

    Parameters
    ----------
    path : str
        Its file.
    part : str
        Its table, empty for a file with one.
    columns : tuple of ColumnLook
        Its columns.
    clocks : tuple of (str, str)
        Samples, rate and times of both clocks, and their overlap, as far as they can be read.
    """

    path: str
    part: str
    columns: tuple[ColumnLook, ...]
    clocks: tuple[tuple[str, str], ...]

    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """What is shown: title, headers and rows of each table."""
        facts = [("file", self.path), *([("table", self.part)] if self.part else []), *self.clocks]
        headers = ("column", "header", "unit", "read as", "first", "last", "smallest", "largest")
        rows = [each.cells(k) for k, each in enumerate(self.columns, 1)]
        return [("motion", ("quantity", "value"), facts), ("columns of the motion", headers, rows)]


def motion_look(path: Path, main: Part | None, options: ReadOptions) -> MotionLook | None:
    """The motion that the options name, None if they name none or if it cannot be found.

    Parameters
    ----------
    path : Path
        The file of the force.
    main : Part or None
        Its table; None for a log.
    options : ReadOptions
        Those of ``read``.
    """
    file, name = options.motion, options.motion_part
    if file is None and name is None:
        return None
    shift = options.motion_shift
    source = MotionSource(path=Path(file) if file else path, part=name, same_file=file is None, shift=shift)
    try:
        part = source.chosen(options.columns)
    except InputError:  # it is the problem of the recording
        return None
    return MotionLook(
        path=str(source.path),
        part=part.name,
        columns=column_looks(part, _OF_MOTION),
        clocks=tuple(_clocks(source, part, main, options)),
    )


def _clocks(source: MotionSource, part: Part, main: Part | None, options: ReadOptions) -> list[tuple[str, str]]:
    force, motion = _force_time(main, options), _motion_time(source, options)
    if motion is not None and main is not None:
        motion = motion + source.start_offset(main.table, part.table)
    named = (("clock of the force", force), ("clock of the motion", motion))
    rows = [(name, _described(time)) for name, time in named if time is not None]
    if force is None or motion is None:
        return rows
    first, last = max(force[0], motion[0]), min(force[-1], motion[-1])
    kept = int(np.count_nonzero((force >= first) & (force <= last)))
    found = f"{first:.6g} to {last:.6g} s, with {kept} of {len(force)} samples of force"
    return [*rows, ("overlap", found if first <= last else "none")]


def _force_time(main: Part | None, options: ReadOptions) -> np.ndarray | None:
    """The times of the force [s], None if they cannot be read."""
    if main is None:
        return None
    assumed = AssumedMotion(rate=options.rate)
    try:
        units = of_main(options.units)
        return read_stream(main.table, main.roles, ("time", "force"), units, assumed=assumed).values["time"]
    except InputError:
        return None


def _motion_time(source: MotionSource, options: ReadOptions) -> np.ndarray | None:
    try:
        return source.stream(options.columns, options.units)[0].values["time"]
    except InputError:
        return None


def _described(time: np.ndarray) -> str:
    rate = 1.0 / float(np.median(np.diff(time)))
    return f"{len(time)} at {rate:.6g} Hz, {time[0]:.6g} to {time[-1]:.6g} s"
