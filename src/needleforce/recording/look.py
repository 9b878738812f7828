# SPDX-License-Identifier: Apache-2.0
"""A look at a file before it is used: format, recordings, columns, what is assumed, what is missing, and how to read
it."""

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..display.tables import blocks, text_list, text_table
from ..errors import InputError
from ..files import open_regular
from .cycles import CycleSpan
from .formats.detect import format_of
from .formats.no_tables import ROS2_BAG
from .mappings import completed
from .motion_look import MAX_LISTED, ColumnLook, MotionLook, column_looks, motion_look
from .options import ReadOptions, flags
from .part_choice import asked, chosen_part, fitting_parts
from .parts import Part, recordings_in
from .quantities import MAIN
from .recording import Recording

_OF_FORCE = ("time", "force")  # what is read from a table whose motion is in another one


@dataclass(frozen=True, kw_only=True)
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
            rows = [(str(k), name) for k, name in enumerate(self.parts[:MAX_LISTED], 1)]
            more = len(self.parts) - MAX_LISTED
            rows += [("…", f"and {more} more")] if more > 0 else []
            made.append(("recordings in the file", ("number", "name"), rows))
        if self.cycles:
            made.append(("cycles in the recording", ("number", "name", "first sample", "last sample"), self._cycles()))
        if self.columns:
            headers = ("column", "header", "unit", "read as", "first", "last", "smallest", "largest")
            made.append(("columns", headers, [each.cells(k) for k, each in enumerate(self.columns, 1)]))
        return made + (self.motion.tables() if self.motion else [])

    def _cycles(self) -> list[tuple[str, ...]]:
        """A row for each of the first cycles."""
        shown = self.cycles[:MAX_LISTED]
        rows = [(str(k), each.name, str(each.first + 1), str(each.stop)) for k, each in enumerate(shown, 1)]
        more = len(self.cycles) - MAX_LISTED
        return rows + ([("…", f"and {more} more", "", "")] if more > 0 else [])

    def _facts(self) -> list[tuple[str, ...]]:
        facts = [("file", self.path), ("format", self.format), ("recordings", str(len(self.parts)))]
        facts += [("shown", self.part)] if self.part else []
        return facts + (self.recording._summary() if self.recording else [])

    def __str__(self) -> str:
        parts = [f"{title}\n{text_table(headers, rows)}" for title, headers, rows in self.tables()]
        if self.recording is not None:
            card, notes = self.recording.card, [note.message for note in self.recording.notes]
            parts += [text_list("Assumed", card.assumptions), text_list("Notes", notes)]
        parts += [f"Not read: {self.problem}"] if self.problem else [f"Read by: {self.command}"]
        return blocks(*parts)


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


def look(
    path: str | os.PathLike,
    recording_of: Callable[[Any], tuple[Recording, tuple[CycleSpan, ...]]],
    given: ReadOptions,
) -> Look:
    """Look at a file.

    A file that cannot be read as a recording is no error: ``problem`` states why. Raises InputError for one that is
    absent.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    recording_of : callable
        The ``part`` of ``read``, None for the only one -> Recording, and its cycles; raises InputError.
    given : ReadOptions
        The options of ``read`` that were given.

    Returns
    -------
    Look
    """
    options = completed(Path(path), given)[0]
    parts: Sequence[Part] = ()
    problem, recording, shown, cycles = "", None, None, ()
    form = format_of(Path(path))
    if form != ROS2_BAG:
        open_regular(Path(path)).close()
    try:
        parts = () if form.log else recordings_in(Path(path), options.columns)
        names = [part.name for part in parts]
        wanted, cycle = _one_of(*asked(options.part, names), names, str(path))
        shown = _shown(parts, wanted, Path(path))
        named = f"{shown.name}: {cycle}" if cycle and shown and shown.name else cycle
        recording, cycles = recording_of(named or (parts.index(shown) + 1 if len(parts) > 1 else wanted))
    except InputError as error:
        problem = str(error)
        shown = shown or (parts[0] if parts else None)
    if len(parts) > 1 and given.part is None and recording is not None:
        given = replace(given, part=shown.name)
    moved = options.motion is not None or options.motion_part is not None
    return Look(
        path=os.fspath(path),
        format=form.name,
        parts=tuple(part.name for part in parts) or ("",),
        part=shown.name if shown else "",
        columns=() if shown is None else column_looks(shown, [q for q in MAIN if not moved or q in _OF_FORCE]),
        recording=recording,
        problem=problem,
        given=given,
        options=options,
        cycles=cycles,
        motion=motion_look(Path(path), shown, options),
    )


def _one_of(part: str | int | None, cycle: str, names: Sequence[str], place: str) -> tuple[str | int | None, str]:
    """A recording and a cycle as they are named, the first of what stands for several. Raises InputError if a pattern
    fits none."""
    if isinstance(part, str) and (part.strip().casefold() == "all" or "*" in part):
        part = fitting_parts(names, part.strip(), place)[0] if names else None
    return part, "" if "*" in cycle else cycle


def _shown(parts: Sequence[Part], wanted: Any, path: Path) -> Part | None:
    """The part that was chosen, or the first."""
    return chosen_part(parts, wanted, path) if parts and wanted is not None else next(iter(parts), None)
