# SPDX-License-Identifier: Apache-2.0
"""``read``: from files to a recording."""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from ..files import enough_memory
from .assumed_motion import AssumedMotion
from .card import Preamble, check_filter_length
from .cycles import MIN_CYCLES, CycleSpan, chosen_cycle, cycle_spans, spans_of_rows, with_note
from .formats.detect import format_of, tables_of
from .from_table import recording_from_table
from .joining import INWARDS
from .mappings import completed
from .options import ReadOptions, keywords_of
from .part_choice import asked, chosen_part
from .parts import Part, recordings_in
from .recording import Recording

if TYPE_CHECKING:
    from .look import Look

TESTS = ("insertion", "indentation")


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
        return read_with_cycles(path, options)[0]
    from .look import look

    def recording_of(part: str | int | None) -> tuple[Recording, tuple[CycleSpan, ...]]:
        return read_with_cycles(path, replace(options, part=part))

    with enough_memory(path):
        return look(path, recording_of, options)


def read_with_cycles(path: str | os.PathLike, options: ReadOptions) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """As ``read``, with the cycles of the recording, or of the one that a cycle was taken from."""
    options, sentence = completed(Path(path), options)
    _check(options)
    with enough_memory(path):
        recording, spans = _recording_and_cycles(Path(path), options)
    if sentence:
        assumptions = (sentence, *recording.card.assumptions)
        recording = replace(recording, card=replace(recording.card, assumptions=assumptions))
    return recording, spans


def _recording_and_cycles(path: Path, options: ReadOptions) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """Read the chosen recording of a file, or a cycle of it, with checked options; also its cycles."""
    parts = [] if format_of(path).log else recordings_in(path, options.columns)
    part, cycle = asked(options.part, [each.name for each in parts])
    of_part = replace(options, part=part)
    key = _key(path, of_part) if cycle and options.motion is None else None
    if key is None or not _whole or _whole[0][0] != key:
        _whole.clear()  # of a long recording there is one at a time in memory
        whole = _read_whole(path, parts, of_part)
        _whole.extend([(key, *whole)] if key else [])
    else:
        whole = _whole[0][1:]
    if cycle.isdecimal() and len(whole[1]) < MIN_CYCLES:  # then it is the number of a recording
        whole, cycle = _read_whole(path, parts, options), ""
    return chosen_cycle(*whole, cycle, str(path)) if cycle else with_note(*whole), whole[1]


_whole: list = []  # the recording of which a cycle was read last, with its cycles


def _key(path: Path, options: ReadOptions) -> tuple:
    """What is equal if a recording would be the same when it is read again."""
    found = path.stat() if path.exists() else None
    return path.absolute(), found and (found.st_mtime_ns, found.st_size), repr(options)


def _read_whole(path: Path, parts: Sequence[Part], options: ReadOptions) -> tuple[Recording, tuple[CycleSpan, ...]]:
    """The recording with its cycles: those that a column counts, or those in the motion."""
    assumed = AssumedMotion(
        rate=options.rate,
        speed=options.speed,
        step=options.step,
        stroke=options.stroke,
        hold=options.hold,
        start=options.motion_shift,
        counted=options.test == "indentation",
    )
    if not parts:
        recording = _read_log(path, options, assumed)
        return recording, cycle_spans(recording)
    chosen, first_row = chosen_part(parts, options.part, path), options.first_row
    recording, rows = _read_part(path, chosen, options, assumed)
    if chosen.name:
        recording = replace(recording, card=replace(recording.card, part=chosen.name))
    skipped = 0 if first_row is None else max(0, first_row - chosen.table.first_row)
    return recording, spans_of_rows(chosen.cycles, rows + skipped) or cycle_spans(recording)


def _read_log(path: Path, options: ReadOptions, assumed: AssumedMotion) -> Recording:
    """The recording of a log, which has one and no tables."""
    if options.motion_part is not None and options.motion is None:
        step = "Choose the motion with --column depth=TOPIC:JOINT, or give a file with --motion."
        raise InputError("motion part", options.motion_part, "a log has no tables", str(path), step)
    if options.part is not None:
        raise InputError("part", repr(str(options.part)[:60]), "a log has one recording", str(path), "Leave it out.")
    from .log.to_recording import read_recording

    return read_recording(path, options, assumed)


def _read_part(path: Path, chosen: Part, options: ReadOptions, assumed: AssumedMotion) -> tuple[Recording, np.ndarray]:
    """The recording of a part of a file, and the row of each sample; an error names the part."""
    try:
        part = chosen if options.first_row is None else chosen.from_row(options.first_row)
        return recording_from_table(part, options, assumed)
    except InputError as error:
        from .motion_source import OF_MOTION, motion_advice

        error = motion_advice(error, path, chosen, options.columns)
        if not chosen.name or chosen.name in error.place or error.quantity.startswith(OF_MOTION):
            raise error from None
        place = f"{error.place}, {chosen.name}"
        raise InputError(error.quantity, error.value, error.limit, place, error.next_step) from None


def _check(options: ReadOptions) -> None:
    if options.inwards is not None and options.inwards not in INWARDS:
        known = "known are increasing and decreasing"
        raise InputError("inwards", repr(options.inwards), known, next_step="Give one of these.")
    if options.test not in TESTS:
        known = f"known are {' and '.join(TESTS)}"
        raise InputError("test", repr(options.test), known, next_step="Give one of these.")
    check_filter_length(options.filter_length)


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """The entries with these ``keys`` in the card of a file of any format. Raises InputError if it cannot be read."""
    if format_of(path).log:
        from .log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in keys if card.get(key)}
    with enough_memory(path):
        preamble = Preamble(tables_of(path)[0].comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
