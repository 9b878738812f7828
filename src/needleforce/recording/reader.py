# SPDX-License-Identifier: Apache-2.0
"""``read`` and ``read_all``: a file is opened and its recordings are found; each, or a cycle of it, is read from its
table."""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate

import numpy as np

from ..errors import InputError
from ..files import enough_memory, open_regular
from .assumed_motion import AssumedMotion
from .card import Preamble, check_filter_length
from .cycles import MIN_CYCLES, CycleSpan, chosen_cycle, cycle_spans, fitting, spans_of_rows, with_note
from .force_signal import glitch_notes, remove_bias
from .formats.detect import ROS2_BAG, format_of, tables_of
from .joining import INWARDS, join, put_motion, put_signs, settle_motion
from .mappings import completed
from .options import Keywords, Reading, ReadOptions, keywords_of
from .parts import Part, asked, chosen_part, fitting_parts, listed, parts_of
from .quantities import AXES
from .recording import Note, Recording
from .roles import of_main
from .samples import decimated, timing_notes
from .stream import read_stream
from .table import Table, segments_of

if TYPE_CHECKING:
    from .look import Look

TESTS = ("insertion", "indentation")
WithCycles = tuple[Recording, tuple[CycleSpan, ...]]
"""A recording with its cycles, or those of the one that a cycle was taken from."""


def _one(read: Callable[Concatenate[Any, Keywords], Any]) -> "Reading[Keywords, Recording, Look]":
    return read


def _several(read: Callable[Concatenate[Any, Keywords], Any]) -> "Reading[Keywords, list[Recording], list[Look]]":
    return read


@_one
@keywords_of(ReadOptions)
def read(path: str | os.PathLike, options: ReadOptions) -> "Recording | Look":
    """Read a recording from a file of any format: text, Excel, Parquet, MATLAB, HDF5, TDMS, NumPy, JSON, MCAP, bags.

    The format is detected from the first bytes. A table of text may have anything above it, a row of units, any common
    delimiter, decimal sign and encoding, and need not have headers.

    Parameters
    ----------
    path : str or os.PathLike
        The file, or the folder of a bag.
    options : ReadOptions
        The keywords.

    Returns
    -------
    Recording
        Arrays in SI. ``card.assumptions`` lists what was assumed, ``notes`` what was found. With ``dry_run`` a
        ``Look``, which prints itself.

    Raises
    ------
    InputError
        The file cannot be read as a recording; the message names the line if there is one.
    """
    return read_file(path, options)


def read_file(path: str | os.PathLike, options: ReadOptions) -> "Recording | Look":
    """As ``read``, with the options as one value."""
    if not options.dry_run:
        return open_file(path, options).read(options.part)[0]
    with enough_memory(path):
        return _look(Path(path), options)


@_several
@keywords_of(ReadOptions)
def read_all(path: str | os.PathLike, options: ReadOptions) -> "list[Recording | Look]":
    """Every recording of a file, in its order, or those that ``part`` stands for, with ``*`` for any text: ``"B*"``;
    ``"cycle *"`` stands for every cycle of each recording.

    Parameters
    ----------
    path : str or os.PathLike
        The file.
    options : ReadOptions
        The keywords.

    Returns
    -------
    list of Recording

    Raises
    ------
    InputError
        As ``read``, for the first part that cannot be read.
    """
    opened = open_file(path, options)
    chosen = [part for part, _ in opened.chosen()]
    if options.dry_run:
        return [read_file(path, replace(options, part=part)) for part in chosen]
    return [opened.read(part)[0] for part in chosen]


def open_file(path: str | os.PathLike, options: ReadOptions) -> "RecordingFile":
    """Open a file, and find its recordings. Raises InputError as ``read``."""
    path = Path(path)
    options, sentence = completed(path, options)
    with enough_memory(path):
        _check(options)
        return _opened(path, options, sentence)


def _opened(path: Path, options: ReadOptions, sentence: str) -> "RecordingFile":
    """A file with its tables and the recordings in them; of a log, which has one recording, there are none."""
    tables = [] if format_of(path).log else segments_of(tables_of(path), options.segment or {})
    parts = parts_of(tables, of_main(options.columns))
    return RecordingFile(path=path, options=options, sentence=sentence, tables=tables, parts=parts)


def _check(options: ReadOptions) -> None:
    if options.inwards is not None and options.inwards not in INWARDS:
        known = "known are increasing and decreasing"
        raise InputError("inwards", repr(options.inwards), known, next_step="Give one of these.")
    if options.test not in TESTS:
        known = f"known are {' and '.join(TESTS)}"
        raise InputError("test", repr(options.test), known, next_step="Give one of these.")
    check_filter_length(options.filter_length)


@dataclass(frozen=True, eq=False, kw_only=True)
class RecordingFile:
    """A file, and what is in it.

    Parameters
    ----------
    path : Path
        The file.
    options : ReadOptions
        The options of ``read``, completed by a mapping.
    sentence : str
        That the mapping is used; empty without one.
    tables : sequence of Table
        Its tables; none of a log.
    parts : sequence of Part
        Its recordings, those of its tables; none of a log, which has one.
    """

    path: Path
    options: ReadOptions
    sentence: str
    tables: Sequence[Table]
    parts: Sequence[Part]
    _whole: dict[str | int | None, WithCycles] = field(default_factory=dict)  # of which a cycle was read last

    def read(self, wanted: str | int | None) -> WithCycles:
        """The recording, or the cycle, with this ``part`` of ``read``. Raises InputError as ``read``."""
        with enough_memory(self.path):
            recording, spans = self._read(wanted)
        if self.sentence:
            assumptions = (self.sentence, *recording.card.assumptions)
            recording = replace(recording, card=replace(recording.card, assumptions=assumptions))
        return recording, spans

    def _read(self, wanted: str | int | None) -> WithCycles:
        part, cycle = asked(wanted, [each.name for each in self.parts])
        whole = self._whole.get(part) if cycle else None
        if whole is None:
            self._whole.clear()  # of a long recording there is one at a time in memory
            whole = self._read_whole(part)
            self._whole.update({part: whole} if cycle else {})
        if cycle.isdecimal() and len(whole[1]) < MIN_CYCLES:  # then it is the number of a recording
            whole, cycle = self._read_whole(wanted), ""
        return chosen_cycle(*whole, cycle, str(self.path)) if cycle else with_note(*whole), whole[1]

    def _read_whole(self, wanted: str | int | None) -> WithCycles:
        """The recording with its cycles: those that a column counts, or those in the motion."""
        options = replace(self.options, part=wanted)
        assumed = AssumedMotion(
            rate=options.rate,
            speed=options.speed,
            step=options.step,
            stroke=options.stroke,
            hold=options.hold,
            start=options.motion_shift,
            counted=options.test == "indentation",
        )
        if not self.parts:
            from .log.to_recording import read_recording

            recording = read_recording(self.path, options, assumed)
            return recording, cycle_spans(recording)
        chosen, first_row = self.named(wanted), options.first_row
        recording, rows = self._read_part(chosen, assumed)
        if options.decimate_to is not None:
            recording = decimated(recording, options.decimate_to)
            return replace(recording, card=replace(recording.card, part=chosen.name)), cycle_spans(recording)
        if chosen.name:
            recording = replace(recording, card=replace(recording.card, part=chosen.name))
        skipped = 0 if first_row is None else max(0, first_row - chosen.table.first_row)
        return recording, spans_of_rows(chosen.cycles, rows + skipped) or cycle_spans(recording)

    @property
    def _left(self) -> list[Table]:
        """The tables in which no recording was found."""
        used = {each.table.name for each in self.parts}
        return [table for table in self.tables if table.name not in used]

    def named(self, wanted: str | int | None) -> Part:
        """As ``chosen_part``, also of a table in which no recording was found: its own error states what it lacks."""
        left = [table for table in self._left if table.name.casefold() == str(wanted).strip().casefold()]
        return chosen_part(parts_of(left, of_main(self.options.columns)) or self.parts, wanted, self.path)

    def _read_part(self, chosen: Part, assumed: AssumedMotion) -> tuple[Recording, np.ndarray]:
        """The recording of a part of the file, and the row of each sample; an error names the part."""
        first_row = self.options.first_row
        try:
            part = chosen if first_row is None else chosen.from_row(first_row)
            return recording_from_table(part, self.options, assumed, self.tables, self._left)
        except InputError as error:
            from .motion_source import OF_MOTION, motion_advice

            error = motion_advice(error, self.tables, chosen, self.options.columns)
            if not chosen.name or chosen.name in error.place or error.quantity.startswith(OF_MOTION):
                raise error from None
            place = f"{error.place}, {chosen.name}"
            raise InputError(error.quantity, error.value, error.limit, place, error.next_step) from None

    def chosen(self) -> list[tuple[str | int | None, str]]:
        """The ``part`` of ``read`` and the name of each recording that ``options.part`` stands for.

        The part of the only recording of a file is None. Raises InputError if none fits.
        """
        text = _pattern(self.options)
        if text is None:
            return [(self.options.part, str(self.options.part).strip())]
        names = [each.name for each in self.parts] or [""]
        pattern, cycle = asked(text, names)
        if not cycle:
            return self._fitting(names, text)
        found = []
        for part, name in self._fitting(names, str(pattern or "*")):
            spans = fitting(self.read(part)[1], cycle, str(self.path))
            cycles = [f"{name}: {span.name}" if name else span.name for span in spans]
            found += [(each, each) for each in cycles]
        return found

    def _fitting(self, names: Sequence[str], pattern: str) -> list[tuple[str | int | None, str]]:
        """Those of the recordings whose name fits a pattern."""
        numbers = fitting_parts(names, pattern, str(self.path))
        return [(number if len(names) > 1 else None, names[number - 1]) for number in numbers]


def recording_from_table(
    part: Part,
    options: ReadOptions,
    assumed: AssumedMotion = AssumedMotion(),  # noqa: B008
    tables: Sequence[Table] = (),
    left: Sequence[Table] = (),
) -> tuple[Recording, np.ndarray]:
    """Read one of the ``tables`` of a file, also the row of each sample; those ``left`` are no recordings."""
    table, units = part.table, options.units
    preamble = Preamble(table.comments, str(table.path))
    source = None
    if options.motion is not None or options.motion_part is not None or preamble.text("motion") or len(tables) > 1:
        from .motion_source import motion_source

        source = motion_source(table.path, part, tables, options, preamble)
    wanted = ("time", "force", *AXES) if source else ("time", "force", "depth", "velocity", *AXES)
    within = assumed.without_motion(bool(source))
    main = read_stream(table, part.roles, wanted, of_main(units), assumed=within)
    direction, start = INWARDS[options.inwards or "increasing"], options.start_depth
    if source:
        main.notes += [Note("unused", assumed.unused_with_motion())] if assumed.unused_with_motion() else []
        join(main, source, table=table, start_depth=start, columns=options.columns, units=units, inwards=direction)
    elif main.motion:
        put_motion(main, main.motion, start, preamble, direction)
        main.assumptions += main.motion.assumptions
    else:
        settle_motion(main, start, preamble, direction)
    if not preamble.has_signs:
        put_signs(main, options.inwards, units)
    if options.baseline:
        remove_bias(main, already_noted=any(note.kind == "baseline" for note in preamble.notes()))
    if left and not source:
        main.notes.append(Note("unused", f"not read, without columns of a recording: {listed(left)}", len(left)))
    main.notes += timing_notes(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    rows = main.values.pop("row")
    card = preamble.card(main.place, main.sha256, options.filter_length, main.assumptions)
    return main.recording(card, preamble.notes()), rows


def chosen_parts(path: Path, options: ReadOptions) -> list[tuple[str | int | None, str]]:
    """As ``RecordingFile.chosen``; a file of which one is named is not opened."""
    return (
        [(options.part, str(options.part).strip())] if _pattern(options) is None else open_file(path, options).chosen()
    )


def _pattern(options: ReadOptions) -> str | None:
    """The pattern that stands for several recordings, None for the name or number of one."""
    text = "all" if options.part is None else str(options.part).strip()
    return text if text.casefold() == "all" or "*" in text else None


def _look(path: Path, given: ReadOptions) -> "Look":
    """Look at a file. One that cannot be read as a recording is no error: ``problem`` states why. Raises InputError for
    one that is absent."""
    from .look import Look, column_looks, motion_look, used_quantities

    options, sentence = completed(path, given)
    tables: Sequence[Table] = ()
    parts: Sequence[Part] = ()
    problem, recording, shown, cycles = "", None, None, ()
    form = format_of(path)
    if form != ROS2_BAG:
        open_regular(path).close()
    try:
        opened = _opened(path, options, sentence)
        tables, parts = opened.tables, opened.parts
        names = [part.name for part in parts]
        wanted, cycle = _one_of(*asked(options.part, names), names, str(path))
        shown = opened.named(wanted) if parts and wanted is not None else next(iter(parts), None)
        named = f"{shown.name}: {cycle}" if cycle and shown and shown.name else cycle
        _check(options)
        recording, cycles = opened.read(named or (1 if wanted is None and len(parts) > 1 else wanted))
    except InputError as error:
        problem = str(error)
        shown = shown or (parts[0] if parts else None)
    if len(parts) > 1 and given.part is None and recording is not None:
        given = replace(given, part=shown.name)
    return Look(
        path=os.fspath(path),
        format=form.name,
        parts=tuple(part.name for part in parts) or ("",),
        part=shown.name if shown else "",
        columns=() if shown is None else column_looks(shown, used_quantities(options)),
        recording=recording,
        problem=problem,
        given=given,
        options=options,
        cycles=cycles,
        motion=motion_look(path, tables, shown, options),
    )


def _one_of(part: str | int | None, cycle: str, names: Sequence[str], place: str) -> tuple[str | int | None, str]:
    """A recording and a cycle as they are named, the first of what stands for several. Raises InputError if a pattern
    fits none."""
    if isinstance(part, str) and (part.strip().casefold() == "all" or "*" in part):
        part = fitting_parts(names, part.strip(), place)[0] if names else None
    return part, "" if "*" in cycle else cycle
