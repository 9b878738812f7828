# SPDX-License-Identifier: Apache-2.0
"""``read``: from files to a recording."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from .card import Preamble, check_filter_length
from .columns import AXES, NamedColumns
from .file_table import FileTable
from .force_signal import glitch_notes, remove_bias
from .formats.detect import format_of
from .joining import INWARDS, check_direction, join, layout_of, of_main, put_motion, settle_motion
from .recording import Recording
from .stream import Stream, read_stream
from .text_layout import Layout
from .timestamps import timing_notes


def read(
    path: str | os.PathLike,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str = "increasing",
    filter_length: int | None = None,
    baseline: bool = True,
    motion: str | os.PathLike | None = None,
    start_depth: float | None = None,
) -> Recording:
    """Read a recording from a text file, a Parquet file, an MCAP file, or the folder of a ROS 2 bag.

    The format is detected from the first bytes. A text file needs a header; its columns are separated by commas,
    semicolons, tabs or blanks.

    Parameters
    ----------
    path : str or os.PathLike
        The file, or the folder of a bag.
    columns : mapping, optional
        Quantity (time, depth, velocity, force, fx, fy, tx, ty, tz) -> header. Common headers are recognised. For MCAP
        and bags, the axis of the force and the topic or joint of the depth:
        ``{"force": "/ft/wrench:-fz", "depth": "/joint_states:needle"}``.
    units : mapping, optional
        Quantity -> unit, such as ``{"time": "us", "depth": "mm"}``; ``-N`` reverses the sign. Units are read from the
        headers or recognised by plausibility; messages are in SI unless given here.
    inwards : {"increasing", "decreasing"}
        Whether depth increases or decreases during insertion.
    filter_length : int, optional
        Samples in the average filter of the force; by default the value in the file's card, or 1.
    baseline : bool
        Remove the bias of the force: the one marked in a live recording, otherwise the mean of the free travel before
        contact if it is significant (see ``force_signal.bias``). Nothing is removed without free travel.
    motion : str or os.PathLike, optional
        A second file with depth or velocity on its own clock with the same zero. It is interpolated onto the force's
        clock; force samples outside its times are left out. Keys such as ``motion.time`` in ``columns`` and ``units``
        apply to this file.
    start_depth : float, optional
        Depth [m] at the first sample of a velocity, from which it is integrated; by default ``start_depth_m`` in the
        file's card.

    Returns
    -------
    Recording
        Arrays in SI. ``card.assumptions`` lists what was assumed, ``notes`` what was found.

    Raises
    ------
    InputError
        The file cannot be read as a recording; the message names the line if there is one.
    """
    if inwards not in INWARDS:
        raise InputError("inwards", repr(inwards), "known are increasing and decreasing")
    check_filter_length(filter_length)
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    options |= {"baseline": baseline, "motion": motion, "start_depth": start_depth}
    return _reader(Path(path))(path, **options)


def read_columns(
    source: NamedColumns,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    inwards: str = "increasing",
    filter_length: int | None = None,
    baseline: bool = True,
) -> Recording:
    """A recording from columns in memory; the options are those of ``read``."""
    if inwards not in INWARDS:
        raise InputError("inwards", repr(inwards), "known are increasing and decreasing")
    check_filter_length(filter_length)
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    return _read_table(source, **options, baseline=baseline, motion=None, start_depth=None)


def _reader(path: Path) -> Callable[..., Recording]:
    if format_of(path).log:
        from .log.to_recording import read_recording

        return read_recording
    return _read_file


def _read_file(path: str | os.PathLike, **options: Any) -> Recording:
    return _read_table(layout_of(Path(path)), **options)


def _read_table(
    layout: Layout | FileTable | NamedColumns,
    *,
    columns: Mapping[str, str] | None,
    units: Mapping[str, str] | None,
    inwards: str,
    filter_length: int | None,
    baseline: bool,
    motion: str | os.PathLike | None,
    start_depth: float | None,
) -> Recording:
    """Read a table whose layout is known; the options are those of ``read``."""
    preamble = Preamble(layout.comments, str(layout.path))
    motion = Path(motion) if motion is not None else _motion_of_card(layout.path, preamble)
    wanted = ("time", "force", *AXES) if motion else ("time", "force", "depth", "velocity", *AXES)
    main = read_stream(layout, wanted, of_main(columns), of_main(units))
    if motion:
        direction = INWARDS[inwards]
        join(main, motion, start_depth=start_depth, columns=columns, units=units, inwards=direction)
    elif main.motion:
        put_motion(main, main.motion, start_depth, preamble, INWARDS[inwards])
        main.assumptions += main.motion.assumptions
    else:
        settle_motion(main, start_depth, preamble, INWARDS[inwards])
    if baseline:
        remove_bias(main, already_noted=any(note.kind == "baseline" for note in preamble.notes()))
    main.notes += timing_notes(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    return _recording(main, preamble, filter_length)


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
    signs = check_direction(main["depth"], main["force"], stream.place)
    notes = dict.fromkeys([*preamble.notes(), *stream.notes, *signs])
    card = preamble.card(stream.place, stream.sha256, filter_length, stream.assumptions)
    return Recording(**main, axes=values, card=card, notes=tuple(notes))


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """The entries with these ``keys`` in the card of a file of any format. Raises InputError if it cannot be read."""
    if format_of(path).log:
        from .log.reader import card_and_end

        card = card_and_end(path)[0] if path.is_file() else {}  # the folder of a bag has no card
        return {key: card[key] for key in keys if card.get(key)}
    preamble = Preamble(layout_of(path).comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
