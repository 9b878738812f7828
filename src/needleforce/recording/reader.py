# SPDX-License-Identifier: Apache-2.0
"""``read``: from files to a recording."""

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from .card import Preamble, check_filter_length
from .columns import MOTION_PREFIX, of_main
from .file_table import FileTable
from .force_signal import glitch_notes, remove_bias
from .formats.detect import format_of, tables_of
from .formats.text_table import TextTable
from .joining import INWARDS, join, put_motion, put_signs, settle_motion
from .mappings import with_mapping
from .parts import chosen_part, from_row, header_texts, recordings_in
from .quantities import AXES
from .recording import Note, Recording
from .stated import AssumedMotion
from .stream import Stream, read_stream
from .timestamps import timing_notes

if TYPE_CHECKING:
    from .look import Look
    from .motion_source import MotionSource

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
    start_depth: float | None = None,
    rate: float | None = None,
    speed: float | None = None,
    step: float | None = None,
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
        Which recording, of a file with several: its name, or its number from 1.
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
    start_depth : float, optional
        Depth [m] at the first sample of a velocity, from which it is integrated; by default ``start_depth_m`` in the
        file's card.
    rate, speed, step : float, optional
        Of a file without time or depth: samples per second [Hz], constant speed [m/s], travel between two samples [m].
        A rate that the file states is used without, as an assumption.
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
    options |= {"first_row": first_row, "motion_part": motion_part}
    if dry_run:
        return _look(path, options | {"mapping": mapping, "baseline": baseline, "motion": motion, "test": test})
    options, sentence = with_mapping(Path(path), mapping, options)
    _check(options["inwards"], options["filter_length"], test)
    recording = _read_file(Path(path), options, baseline=baseline, motion=motion, counted=test == "indentation")
    if not sentence:
        return recording
    return replace(recording, card=replace(recording.card, assumptions=(sentence, *recording.card.assumptions)))


def _look(path: str | os.PathLike, options: dict[str, Any]) -> "Look":
    """A look at a file, with its recording, or the first of several, if it can be read."""
    from .look import look

    def recording_of(part: int | None) -> Recording:
        return read(path, **options | ({"part": part} if part else {}))

    return look(path, recording_of, options)


def _read_file(
    path: Path, options: dict[str, Any], *, baseline: bool, motion: str | os.PathLike | None, counted: bool
) -> Recording:
    """Read the chosen recording of a file with checked options."""
    part, first_row = options.pop("part"), options.pop("first_row")
    assumed = AssumedMotion(**{name: options.pop(name) for name in ("rate", "speed", "step")}, counted=counted)
    options |= {"baseline": baseline, "motion": motion}
    if format_of(path).log:
        if options["motion_part"] is not None and motion is None:
            step = "Choose the motion with --column depth=TOPIC:JOINT, or give a file with --motion."
            raise InputError("motion part", options["motion_part"], "a log has no tables", str(path), step)
        from .log.to_recording import read_recording

        if part is not None:
            raise InputError("part", repr(str(part)[:60]), "a log has one recording", str(path), "Leave it out.")
        return read_recording(path, **options)
    chosen = chosen_part(recordings_in(path, options["columns"]), part, path)
    try:
        table = chosen.table if first_row is None else from_row(chosen.table, first_row)
        of_motion = {q: h for q, h in header_texts(options["columns"]).items() if q.startswith(MOTION_PREFIX)}
        recording = _read_table(table, **options | {"columns": {**chosen.columns, **of_motion}}, assumed=assumed)
    except InputError as error:
        from .motion_source import OF_MOTION, motion_advice

        error = motion_advice(error, path, chosen, options["columns"])
        if not chosen.name or chosen.name in error.place or error.quantity.startswith(OF_MOTION):
            raise error from None
        place = f"{error.place}, {chosen.name}"
        raise InputError(error.quantity, error.value, error.limit, place, error.next_step) from None
    return replace(recording, card=replace(recording.card, part=chosen.name)) if chosen.name else recording


def read_all(path: str | os.PathLike, **options: Any) -> list[Recording]:
    """Every recording of a file, in its order; ``options`` are those of ``read`` without ``part``.

    Raises
    ------
    InputError
        As ``read``, for the first part that cannot be read.
    """
    if format_of(Path(path)).log:
        return [read(path, **options)]
    given, _ = with_mapping(Path(path), options.get("mapping"), {"columns": options.get("columns")})
    count = len(recordings_in(Path(path), given["columns"]))
    return [read(path, part=k, **options) for k in range(1, count + 1)]


def read_columns(
    source: FileTable,
    *,
    columns: Mapping[str, str | int] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str | None = None,
    filter_length: int | None = None,
    baseline: bool = True,
) -> Recording:
    """A recording from columns in memory; the options are those of ``read``."""
    _check(inwards, filter_length, "insertion")
    options = {"columns": header_texts(columns), "units": units, "inwards": inwards, "filter_length": filter_length}
    return _read_table(source, **options, baseline=baseline, motion=None, motion_part=None, start_depth=None)


def _check(inwards: str | None, filter_length: int | None, test: str) -> None:
    if inwards is not None and inwards not in INWARDS:
        raise InputError("inwards", repr(inwards), "known are increasing and decreasing")
    if test not in TESTS:
        raise InputError("test", repr(test), f"known are {' and '.join(TESTS)}")
    check_filter_length(filter_length)


def _read_table(
    layout: FileTable | TextTable,
    *,
    columns: Mapping[str, str],
    units: Mapping[str, str] | None,
    inwards: str | None,
    filter_length: int | None,
    baseline: bool,
    motion: str | os.PathLike | None,
    motion_part: str | int | None,
    start_depth: float | None,
    assumed: AssumedMotion = AssumedMotion(),  # noqa: B008
) -> Recording:
    """Read one table; the options are those of ``read``."""
    preamble = Preamble(layout.comments, str(layout.path))
    source = _motion_source(layout.path, preamble, motion, motion_part)
    wanted = ("time", "force", *AXES) if source else ("time", "force", "depth", "velocity", *AXES)
    main = read_stream(layout, wanted, of_main(columns), of_main(units), assumed=assumed.without_motion(bool(source)))
    direction = INWARDS[inwards or "increasing"]
    if source:
        main.notes += [Note("unused", assumed.unused_with_motion())] if assumed.unused_with_motion() else []
        join(main, source, table=layout, start_depth=start_depth, columns=columns, units=units, inwards=direction)
    elif main.motion:
        put_motion(main, main.motion, start_depth, preamble, direction)
        main.assumptions += main.motion.assumptions
    else:
        settle_motion(main, start_depth, preamble, direction)
    if not preamble.has_signs:
        put_signs(main, inwards, units)
    if baseline:
        remove_bias(main, already_noted=any(note.kind == "baseline" for note in preamble.notes()))
    main.notes += timing_notes(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    return _recording(main, preamble, filter_length)


def _motion_source(
    path: Path, preamble: Preamble, motion: str | os.PathLike | None, part: str | int | None
) -> "MotionSource | None":
    """Where the motion is, None if it is in the table of the force."""
    given = motion is not None or part is not None
    named = None if given else _motion_of_card(path, preamble)
    if not given and named is None:
        return None
    from .motion_source import MotionSource

    if motion is not None:
        return MotionSource(path=Path(motion), part=part)
    if part is not None:
        return MotionSource(path=path, part=part, same_file=True)
    return MotionSource(path=named)


def _motion_of_card(path: Path, preamble: Preamble) -> Path | None:
    """The motion file that the card names, which must be in the same folder."""
    name = preamble.text("motion")
    if not name:
        return None
    filename = Path(name).name
    if not filename or filename == ".." or "\0" in filename:
        raise preamble.refusal("motion", "the name of a file in the same folder is needed")
    return path.with_name(filename)


def _recording(stream: Stream, preamble: Preamble, filter_length: int | None) -> Recording:
    values = dict(stream.values)
    main = {quantity: values.pop(quantity) for quantity in ("time", "depth", "velocity", "force")}
    notes = dict.fromkeys([*preamble.notes(), *stream.notes])
    card = preamble.card(stream.place, stream.sha256, filter_length, stream.assumptions)
    return Recording(**main, axes=values, card=card, notes=tuple(notes))


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """The entries with these ``keys`` in the card of a file of any format. Raises InputError if it cannot be read."""
    if format_of(path).log:
        from .log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in keys if card.get(key)}
    preamble = Preamble(tables_of(path)[0].comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
