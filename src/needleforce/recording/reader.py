# SPDX-License-Identifier: Apache-2.0
"""From files to a recording: the one verb, ``read``."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

from ..errors import InputError
from .card import Preamble, check_filter_length
from .columns import AXES
from .force_signal import glitch_notes, remove_bias
from .formats import format_of
from .joining import INWARDS, check_direction, join, of_main, put_motion, settle_motion
from .parquet_table import Stored, find_stored
from .recording import Recording
from .stream import Stream, read_stream
from .text_layout import Layout, find_layout
from .timestamps import unsteadiness


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
    """Read a recording: a text file with a header (comma, semicolon, tab or blanks between the columns), Parquet, MCAP,
    or the folder of a ROS 2 bag, told apart by their first bytes.

    ``columns`` maps a quantity (time, depth, velocity, force, fx, fy, tx, ty, tz) to its header, ``units`` to its unit;
    both are recognised from common headers where they are not given, and what was assumed stands in
    ``card.assumptions``. ``inwards`` is "increasing", or "decreasing" for a depth that counts the other way.
    ``filter_length`` [samples] is that of the average filter the force went through, by default the file's own word.
    In messages ``columns`` says which axis is the force, and which topic or joint the depth, where the file does not:
    ``{"force": "/ft/wrench:-fz", "depth": "/joint_states:needle"}``; they are in SI unless ``units`` says otherwise.

    ``motion`` is a second file with depth, or velocity, on its own clock with the same zero. Velocity is integrated
    from ``start_depth`` [m], the depth at its first sample (or the ``start_depth_m`` in that file's card), and depth is
    put on the force's clock; force samples outside the motion's times are left out. Keys such as ``motion.time`` in
    ``columns`` and ``units`` are for this file.

    ``baseline`` removes the bias of the force: the one marked in a live recording, else the mean of the free travel
    before contact, where it is sure and clearly above the noise (see ``baseline.bias``); a recording that starts in
    contact is left alone. Without free travel nothing is removed. What was found on the way stands in ``notes``.

    Raises InputError, with the line where there is one, for everything that makes no recording of the file.
    """
    if inwards not in INWARDS:
        raise InputError("inwards", repr(inwards), "known are increasing and decreasing")
    check_filter_length(filter_length)
    options = {"columns": columns, "units": units, "inwards": inwards, "filter_length": filter_length}
    options |= {"baseline": baseline, "motion": motion, "start_depth": start_depth}
    return _reader(Path(path))(path, **options)


def _reader(path: Path) -> Callable[..., Recording]:
    match format_of(path):
        case "log":
            from .log.to_recording import read_recording

            return read_recording
        case "parquet":
            return _read_parquet
    return _read_text


def _read_text(path, **options) -> Recording:
    return _read_table(find_layout(Path(path)), **options)


def _read_parquet(path, **options) -> Recording:
    return _read_table(find_stored(Path(path)), **options)


def _read_table(
    layout: Layout | Stored, columns, units, inwards, filter_length, baseline, motion, start_depth
) -> Recording:
    """What ``read`` makes of a table whose layout is known; the options are its."""
    preamble = Preamble(layout.comments, str(layout.path))
    motion = Path(motion) if motion is not None else _motion_beside(layout.path, preamble)
    wanted = ("time", "force", *AXES) if motion else ("time", "force", "depth", "velocity", *AXES)
    main = read_stream(layout, wanted, of_main(columns), of_main(units))
    if motion:
        join(main, motion, start_depth, columns, units, INWARDS[inwards])
    elif main.motion:
        put_motion(main, main.motion, start_depth, preamble, INWARDS[inwards])
        main.said += main.motion.said
    else:
        settle_motion(main, start_depth, preamble, INWARDS[inwards])
    if baseline:
        remove_bias(main, before=any(note.kind == "baseline" for note in preamble.notes()))
    main.notes += unsteadiness(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    return _recording(main, preamble, filter_length)


def _motion_beside(path: Path, preamble: Preamble) -> Path | None:
    """The motion a file's card names: a file in the same folder, and in no other."""
    name = preamble.text("motion")
    if not name:
        return None
    beside = Path(name).name
    if not beside or beside == ".." or "\0" in beside:
        raise preamble.refusal("motion", "the name of a file in the same folder is needed")
    return path.with_name(beside)


def _recording(stream: Stream, preamble: Preamble, filter_length: int | None) -> Recording:
    values = dict(stream.values)
    four = [values.pop(quantity) for quantity in ("time", "depth", "velocity", "force")]
    signs = check_direction(four[1], four[3], stream.place)
    notes = dict.fromkeys([*preamble.notes(), *stream.notes, *signs])
    card = preamble.card(stream.place, stream.sha256, filter_length, stream.said)
    return Recording(*four, axes=values, card=card, notes=tuple(notes))


def card_texts(path: Path, keys: tuple[str, ...]) -> dict[str, str]:
    """Those of ``keys`` that the card in a file of any format has. Raises InputError for a file that cannot be read."""
    match format_of(path):
        case "log" if path.is_file():
            from .log.reader import card_and_end

            card = card_and_end(path)[0]
            return {key: card[key] for key in keys if card.get(key)}
        case "log":  # the folder of a bag: it has no card
            return {}
        case "parquet":
            from .parquet_table import find_stored

            comments = find_stored(path).comments
        case _:
            comments = find_layout(path).comments
    preamble = Preamble(comments, str(path))
    return {key: preamble.text(key) for key in keys if preamble.text(key)}
