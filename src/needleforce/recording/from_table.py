# SPDX-License-Identifier: Apache-2.0
"""One table of a file as a recording: its motion, which may be in another table, its signs and its bias."""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .assumed_motion import AssumedMotion
from .card import Preamble
from .force_signal import glitch_notes, remove_bias
from .joining import INWARDS, join, put_motion, put_signs, settle_motion
from .options import ReadOptions
from .parts import Part
from .quantities import AXES
from .recording import Note, Recording
from .roles import of_main
from .samples import timing_notes
from .stream import Stream, read_stream

if TYPE_CHECKING:
    from .motion_source import MotionSource


def recording_from_table(
    part: Part,
    options: ReadOptions,
    assumed: AssumedMotion = AssumedMotion(),  # noqa: B008
) -> tuple[Recording, np.ndarray]:
    """Read one table, also the row of each sample; ``options.columns`` are those of a motion in another table."""
    table, units = part.table, options.units
    preamble = Preamble(table.comments, str(table.path))
    source = _motion_source(table.path, preamble, options)
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
    main.notes += timing_notes(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    rows = main.values.pop("row")
    return _recording(main, preamble, options.filter_length), rows


def _motion_source(path: Path, preamble: Preamble, options: ReadOptions) -> "MotionSource | None":
    """Where the motion is, None if it is in the table of the force."""
    motion, part, shift = options.motion, options.motion_part, options.motion_shift
    given = motion is not None or part is not None
    named = None if given else _motion_of_card(path, preamble)
    if not given and named is None:
        return None
    from .motion_source import MotionSource

    if motion is not None:
        return MotionSource(path=Path(motion), part=part, shift=shift)
    if part is not None:
        return MotionSource(path=path, part=part, same_file=True, shift=shift)
    return MotionSource(path=named, shift=shift)


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
