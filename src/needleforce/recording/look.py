# SPDX-License-Identifier: Apache-2.0
"""A look at a file before it is used: format, recordings, columns, what is assumed, what is missing, and how to read
it."""

import os
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..display.markup import Markup, element, join, table, visible
from ..display.tables import blocks, text_list, text_table
from ..errors import InputError
from .assumed_motion import AssumedMotion
from .cycles import CycleSpan
from .motion_source import MotionSource, motion_source
from .options import ReadOptions, flags
from .parts import Part
from .quantities import MAIN
from .recording import Recording
from .roles import of_main, stated_unit
from .stream import read_stream
from .table import Table

_MAX_LISTED = 20  # columns, and recordings, that are shown
_HEAD = 6  # values of a column that are shown
_OF_MOTION = ("time", "depth", "velocity")
_OF_FORCE = ("time", "force")  # what is read from a table whose motion is in another one


@dataclass(frozen=True, kw_only=True)
class ColumnLook:
    """One column: header, stated unit, the quantity it is read as, empty if it is not used, number of values, first,
    last, smallest and largest value in the file's unit, and the first of all values; NaN where it holds no numbers."""

    header: str
    unit: str
    quantity: str
    count: int
    first: float
    last: float
    smallest: float
    largest: float
    head: tuple[float, ...] = ()

    def cells(self, number: int) -> tuple[str, ...]:
        """What a table shows of the column with this number."""
        values = (self.first, self.last, self.smallest, self.largest)
        shown = ["" if np.isnan(value) else f"{value:.6g}" for value in values]
        return (str(number), self.header, self.unit, self.quantity, *shown)


def used_quantities(options: ReadOptions) -> tuple[str, ...]:
    """The quantities that are read from the table of the force."""
    return MAIN if options.motion is None and options.motion_part is None else _OF_FORCE


def column_looks(part: Part, used: Sequence[str] = MAIN) -> tuple[ColumnLook, ...]:
    """The first columns of a part; of the quantities, those ``used`` are named."""
    return tuple(
        ColumnLook(header=header, unit=unit, quantity=quantity if quantity in used else "", **_range(part.table, k))
        for k, (header, unit, quantity) in enumerate(_column_table(part)[:_MAX_LISTED])
    )


def _column_table(part: Part) -> list[tuple[str, str, str]]:
    """Header, stated unit, and quantity of each column of a part, for a look at it."""
    try:
        chosen = part.roles.chosen(MAIN)
        wanted = ("time", "force") if "velocity" in chosen else ("time", "depth", "force")
        chosen |= part.roles.by_unit([q for q in wanted if q not in chosen])
    except InputError:
        chosen = {}
    found = {column.index: quantity for quantity, column in chosen.items()}
    headers = enumerate(part.table.headers)
    return [(header, stated_unit(part.table, k) or "", found.get(k, "")) for k, header in headers]


def _range(table: Table, index: int) -> dict[str, Any]:
    """Number of values, first, last, smallest and largest of a column."""
    values = table.readable(index)
    head = {"head": tuple(values[:_HEAD].tolist())}
    values = values[np.isfinite(values)]
    if not len(values):
        return dict.fromkeys(("first", "last", "smallest", "largest"), float("nan")) | {"count": 0} | head
    ends = {"first": float(values[0]), "last": float(values[-1])}
    return ends | {"smallest": float(values.min()), "largest": float(values.max()), "count": len(values)} | head


def _shown(title: str, columns: Sequence[ColumnLook]) -> tuple[str, tuple[str, ...], list[tuple[str, ...]]]:
    """Title, headers and rows of a table of columns."""
    headers = ("column", "header", "unit", "read as", "first", "last", "smallest", "largest")
    return title, headers, [each.cells(k) for k, each in enumerate(columns, 1)]


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
        return [("motion", ("quantity", "value"), facts), _shown("columns of the motion", self.columns)]


@dataclass(frozen=True, kw_only=True, repr=False)
class Look:
    """What a file is, and how it is read.

    Parameters
    ----------
    path : str
        The file.
    format : str
        Its format in words.
    parts : tuple of str
        The names of its recordings; one empty name for a file with one.
    part : str
        The recording that is shown.
    columns : tuple of ColumnLook
        Its columns.
    recording : Recording or None
        The recording, None if it cannot be read with these options.
    problem : str
        Why it cannot be read, with what to do; empty if it can.
    given : ReadOptions
        The options of ``read`` that were given.
    options : ReadOptions
        These, completed by a mapping.
    cycles : tuple of CycleSpan
        The cycles of the recording that is shown, or of the one it was taken from: name, first sample, and the one
        after the last.
    motion : MotionLook or None
        The motion in another table, if the options name one.
    """

    path: str
    format: str
    parts: tuple[str, ...]
    part: str
    columns: tuple[ColumnLook, ...]
    recording: Recording | None
    problem: str
    given: ReadOptions
    options: ReadOptions
    cycles: tuple[CycleSpan, ...] = ()
    motion: MotionLook | None = None

    @property
    def command(self) -> str:
        """The command that identifies a model from this recording, with the options that read it."""
        return " ".join(["needleforce identify", shlex.quote(self.path), *option_words(self.given)])

    def tables(self) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
        """What is shown: title, headers and rows of each table."""
        made = [("file", ("quantity", "value"), self._facts())]
        if len(self.parts) > 1:
            rows = [(str(k), name) for k, name in enumerate(self.parts[:_MAX_LISTED], 1)]
            more = len(self.parts) - _MAX_LISTED
            rows += [("…", f"and {more} more")] if more > 0 else []
            made.append(("recordings in the file", ("number", "name"), rows))
        if self.cycles:
            made.append(("cycles in the recording", ("number", "name", "first sample", "last sample"), self._cycles()))
        if self.columns:
            made.append(_shown("columns", self.columns))
        return made + (self.motion.tables() if self.motion else [])

    def _cycles(self) -> list[tuple[str, ...]]:
        """A row for each of the first cycles."""
        shown = self.cycles[:_MAX_LISTED]
        rows = [(str(k), each.name, str(each.first + 1), str(each.stop)) for k, each in enumerate(shown, 1)]
        more = len(self.cycles) - _MAX_LISTED
        return rows + ([("…", f"and {more} more", "", "")] if more > 0 else [])

    def _facts(self) -> list[tuple[str, ...]]:
        found = str(len(self.parts)) if self.columns or self.recording else "none"
        facts = [("file", self.path), ("format", self.format), ("recordings", found)]
        facts += [("shown", self.part)] if self.part else []
        return facts + (self.recording._summary() if self.recording else [])

    def __str__(self) -> str:
        parts = [f"{title}\n{text_table(headers, rows)}" for title, headers, rows in self.tables()]
        if self.recording is not None:
            card, notes = self.recording.card, [note.message for note in self.recording.notes]
            parts += [text_list("Assumed", card.assumptions), text_list("Notes", notes)]
        parts += [f"Not read: {self.problem}", self._keywords()] if self.problem else [f"Read by: {self.command}"]
        return blocks(*parts)

    def _keywords(self) -> str:
        """What the options of the command that the problem names are called in Python."""
        words = re.findall(r"--[\w-]+", self.problem)
        named = {flag.word: name for name, flag in flags().items() if flag.word in words}
        return text_list("In Python, as keywords of read in SI", [f"{word}: {name}" for word, name in named.items()])

    __repr__ = __str__

    def _repr_html_(self) -> Markup:
        parts = [
            join([element("p", element("b", title)), table(headers, rows)]) for title, headers, rows in self.tables()
        ]
        if self.recording is not None:
            parts.append(self.recording._repr_html_())
        return visible(join([*parts, element("p", f"Not read: {self.problem}" if self.problem else self.command)]))


def option_words(options: ReadOptions) -> list[str]:
    """The options of ``read`` as words of a command line."""
    words = []
    for name, flag in flags().items():
        value = getattr(options, name)
        if isinstance(value, Mapping):
            texts = [f"{quantity}={text}" for quantity, text in value.items()]
        elif isinstance(value, int | float):
            texts = [f"{value / (flag.factor or 1.0):.12g}"]
        else:
            texts = [] if value is None else [os.fspath(value)]
        words += [word for text in texts for word in (flag.word, shlex.quote(text))]
    return words


def motion_look(path: Path, tables: Sequence[Table], main: Part | None, options: ReadOptions) -> MotionLook | None:
    """The motion that the options name, None if they name none or if it cannot be found.

    Parameters
    ----------
    path : Path
        The file of the force.
    tables : sequence of Table
        Its tables.
    main : Part or None
        The table of the force; None for a log.
    options : ReadOptions
        Those of ``read``.
    """
    source = motion_source(path, main, tables, options)
    if source is None:
        return None
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
