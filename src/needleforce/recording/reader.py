# SPDX-License-Identifier: Apache-2.0
"""``read``: from files to a recording."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..files import enough_memory
from .assumed_motion import AssumedMotion
from .card import Preamble, check_filter_length
from .cycles import MIN_CYCLES, CycleSpan, chosen_cycle, cycle_spans, spans_of_rows, with_note
from .formats.detect import format_of, tables_of
from .from_table import recording_from_table
from .joining import INWARDS
from .mappings import with_mapping
from .parts import Part, asked, chosen_part, header_texts, part_of, recordings_in
from .recording import Recording
from .table import Table

if TYPE_CHECKING:
    from .look import Look

TESTS = ("insertion", "indentation")


def read(
    path: str | os.PathLike,
    *,
    part: str | int | None = None,
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str | None = None,
    filter_length: int | None = None,
    baseline: bool = True,
    motion: str | os.PathLike | None = None,
    motion_part: str | int | None = None,
    motion_shift: float | None = None,
    start_depth: float | None = None,
    rate: float | None = None,
    speed: float | None = None,
    step: float | None = None,
    stroke: float | None = None,
    hold: float | None = None,
    first_row: int | None = None,
    test: str = "insertion",
    mapping: str | os.PathLike | None = None,
    dry_run: bool = False,
) -> "Recording | Look":
    """Read a recording from a file of any format: text, Excel, Parquet, MATLAB, HDF5, TDMS, NumPy, JSON, MCAP, bags.

    The format is detected from the first bytes. A table of text may have anything above it, a row of units, any common
    delimiter, decimal sign and encoding, and need not have headers.

    Parameters
    ----------
    path : str or os.PathLike
        The file, or the folder of a bag.
    part : str or int, optional
        Which recording, of a file with several: its name, or its number from 1. ``"cycle 3"``, or ``"NAME: cycle 3"``,
        is one cycle of a recording that repeats; a number is that of a cycle where the file has no other recordings.
    columns : mapping, optional
        Quantity (time, depth, velocity, force, fx, fy, tx, ty, tz) -> header, or number of the column from 1. Common
        headers are recognised. One with ``*`` stands for several columns, each of a recording of its own. For MCAP
        and bags, the axis of the force and the topic or joint of the depth:
        ``{"force": "/ft/wrench:-fz", "depth": "/joint_states:needle"}``.
    units : mapping, optional
        Quantity -> unit, such as ``{"time": "us", "depth": "mm"}``; ``-N`` reverses the sign, ``0.0122N`` is the force
        of one count. Units are read from the file or recognised by plausibility; messages are in SI unless given here.
    inwards : {"increasing", "decreasing"}, optional
        Whether depth increases or decreases during insertion; by default it is recognised (see ``signs.signs_of``).
    filter_length : int, optional
        Samples in the average filter of the force; by default the value in the file's card, or 1.
    baseline : bool
        Remove the bias of the force: the one marked in a live recording, otherwise the mean of the free travel before
        contact if it is significant (see ``force_signal.bias``). Nothing is removed without free travel.
    motion : str or os.PathLike, optional
        A second file with depth or velocity on its own clock with the same zero. It is interpolated onto the force's
        clock; force samples outside its times are left out. Keys such as ``motion.time`` in ``columns`` and ``units``
        apply to this file.
    motion_part : str or int, optional
        The table with depth or velocity, by its name or number, of a motion file with several; without ``motion`` a
        table of the same file, such as a group or sheet with another rate.
    motion_shift : float, optional
        Added to the times of the motion [s], if its clock has another zero. Of a motion stated by ``speed``: the time
        at which the needle starts to move, by default the first sample.
    start_depth : float, optional
        Depth [m] at the first sample of a velocity, from which it is integrated; by default ``start_depth_m`` in the
        file's card.
    rate, speed, step : float, optional
        Of a file without time or depth: samples per second [Hz], constant speed [m/s], travel between two samples [m].
        A rate that the file states is used without, as an assumption.
    stroke, hold : float, optional
        With ``speed``: the depth [m] at which the needle stops, and the time [s] after which it is drawn out at the
        same speed. Without ``hold`` it remains there.
    first_row : int, optional
        Row, or line of a text, at which the numbers begin, where rows above it are no samples.
    test : {"insertion", "indentation"}
        An indentation needs no time, and what is usual for needles is not expected of it.
    mapping : str or os.PathLike, optional
        Options kept in a TOML file, by its name or path; those given here come first. Without one ``needleforce.toml``
        in the folder of the file applies, if there is one.
    dry_run : bool
        Look at the file only: what it is, what would be assumed, and what is missing.

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
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    options |= {"start_depth": start_depth, "part": part, "rate": rate, "speed": speed, "step": step}
    options |= {"first_row": first_row, "motion_part": motion_part, "motion_shift": motion_shift}
    options |= {"stroke": stroke, "hold": hold}
    options |= {"mapping": mapping, "baseline": baseline, "motion": motion, "test": test}
    return _look(path, options) if dry_run else read_with_cycles(path, **options)[0]


def _look(path: str | os.PathLike, options: dict[str, Any]) -> "Look":
    """A look at a file, with its recording, or the first of several, if it can be read."""
    from .look import look

    def recording_of(part: str | int | None) -> tuple[Recording, tuple[CycleSpan, ...]]:
        return read_with_cycles(path, **options | {"part": part})

    with enough_memory(path):
        return look(path, recording_of, options)


def read_with_cycles(
    path: str | os.PathLike,
    *,
    mapping: str | os.PathLike | None = None,
    baseline: bool = True,
    motion: str | os.PathLike | None = None,
    test: str = "insertion",
    **options: Any,
) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """As ``read``, with the cycles of the recording, or of the one that a cycle was taken from."""
    known = ("columns", "units", "inwards", "filter_length", "start_depth", "part", "rate", "speed", "step",
             "stroke", "hold", "first_row", "motion_part", "motion_shift")  # fmt: skip
    options, sentence = with_mapping(Path(path), mapping, dict.fromkeys(known) | options)
    _check(options["inwards"], options["filter_length"], test)
    counted = test == "indentation"
    with enough_memory(path):
        recording, spans = _read_file(Path(path), options, baseline=baseline, motion=motion, counted=counted)
    if sentence:
        assumptions = (sentence, *recording.card.assumptions)
        recording = replace(recording, card=replace(recording.card, assumptions=assumptions))
    return recording, spans


def _read_file(
    path: Path, options: dict[str, Any], *, baseline: bool, motion: str | os.PathLike | None, counted: bool
) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """Read the chosen recording of a file, or a cycle of it, with checked options; also its cycles."""
    wanted = options.pop("part")
    parts = [] if format_of(path).log else recordings_in(path, options["columns"])
    part, cycle = asked(wanted, [each.name for each in parts])
    options |= {"baseline": baseline, "motion": motion}
    key = _key(path, options | {"part": part, "counted": counted}) if cycle and motion is None else None
    if key is None or not _whole or _whole[0][0] != key:
        _whole.clear()  # of a long recording there is one at a time in memory
        whole = _read_whole(path, parts, part, options, counted)
        _whole.extend([(key, *whole)] if key else [])
    else:
        whole = _whole[0][1:]
    if cycle.isdecimal() and len(whole[1]) < MIN_CYCLES:  # then it is the number of a recording
        whole, cycle = _read_whole(path, parts, wanted, options, counted), ""
    return chosen_cycle(*whole, cycle, str(path)) if cycle else with_note(*whole), whole[1]


_whole: list = []  # the recording of which a cycle was read last, with its cycles


def _key(path: Path, options: Mapping[str, Any]) -> tuple:
    """What is equal if a recording would be the same when it is read again."""
    found = path.stat() if path.exists() else None
    return path.absolute(), found and (found.st_mtime_ns, found.st_size), repr(sorted(options.items(), key=str))


def _read_whole(
    path: Path, parts: Sequence[Part], part: str | int | None, options: Mapping[str, Any], counted: bool
) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """The recording with its cycles: those that a column counts, or those in the motion."""
    names = ("rate", "speed", "step", "stroke", "hold")
    assumed = AssumedMotion(**{name: options[name] for name in names}, start=options["motion_shift"], counted=counted)
    others = {name: value for name, value in options.items() if name not in (*names, "first_row")}
    if not parts:
        recording = _read_log(path, part, others | {"assumed": assumed})
        return recording, cycle_spans(recording)
    chosen, first_row = chosen_part(parts, part, path), options["first_row"]
    recording, rows = _read_part(path, chosen, first_row, others, assumed)
    if chosen.name:
        recording = replace(recording, card=replace(recording.card, part=chosen.name))
    skipped = 0 if first_row is None else max(0, first_row - chosen.table.first_row)
    return recording, spans_of_rows(chosen.cycles, rows + skipped) or cycle_spans(recording)


def _read_log(path: Path, part: str | int | None, options: Mapping[str, Any]) -> Recording:
    """The recording of a log, which has one and no tables."""
    if options["motion_part"] is not None and options["motion"] is None:
        step = "Choose the motion with --column depth=TOPIC:JOINT, or give a file with --motion."
        raise InputError("motion part", options["motion_part"], "a log has no tables", str(path), step)
    if part is not None:
        raise InputError("part", repr(str(part)[:60]), "a log has one recording", str(path), "Leave it out.")
    from .log.to_recording import read_recording

    return read_recording(path, **options)


def _read_part(
    path: Path, chosen: Part, first_row: int | None, options: Mapping[str, Any], assumed: AssumedMotion
) -> tuple[Recording, np.ndarray]:
    """The recording of a part of a file, and the row of each sample; an error names the part."""
    try:
        part = chosen if first_row is None else chosen.from_row(first_row)
        return recording_from_table(part, **options, assumed=assumed)
    except InputError as error:
        from .motion_source import OF_MOTION, motion_advice

        error = motion_advice(error, path, chosen, options["columns"])
        if not chosen.name or chosen.name in error.place or error.quantity.startswith(OF_MOTION):
            raise error from None
        place = f"{error.place}, {chosen.name}"
        raise InputError(error.quantity, error.value, error.limit, place, error.next_step) from None


def read_columns(
    source: Table,
    *,
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str | None = None,
    filter_length: int | None = None,
    baseline: bool = True,
) -> Recording:
    """A recording from columns in memory; the options are those of ``read``."""
    _check(inwards, filter_length, "insertion")
    part = part_of(source, header_texts(columns))
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    options |= {"motion": None, "motion_part": None, "motion_shift": None, "start_depth": None}
    return recording_from_table(part, **options, baseline=baseline)[0]


def _check(inwards: str | None, filter_length: int | None, test: str) -> None:
    if inwards is not None and inwards not in INWARDS:
        known = "known are increasing and decreasing"
        raise InputError("inwards", repr(inwards), known, next_step="Give one of these.")
    if test not in TESTS:
        raise InputError("test", repr(test), f"known are {' and '.join(TESTS)}", next_step="Give one of these.")
    check_filter_length(filter_length)


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """The entries with these ``keys`` in the card of a file of any format. Raises InputError if it cannot be read."""
    if format_of(path).log:
        from .log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in keys if card.get(key)}
    with enough_memory(path):
        preamble = Preamble(tables_of(path)[0].comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
