# SPDX-License-Identifier: Apache-2.0
"""From files to a recording: the one verb, ``read``."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from .baseline import bias
from .card import Preamble, check_filter_length
from .clocks import unsteadiness
from .columns import AXES
from .formats import format_of
from .glitches import glitch_notes
from .layout import find_layout
from .motion import check_direction, derivative, integral, overlap, signed
from .recording import Note, Recording
from .stream import Stream, constant_depth, read_stream

INWARDS = {"increasing": 1.0, "+": 1.0, "decreasing": -1.0, "-": -1.0}


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

    ``motion`` is a second file with depth, or velocity, on its own clock with the same zero. Velocity is integrated
    from ``start_depth`` [m], the depth at its first sample (or the ``start_depth_m`` in that file's card), and depth is
    put on the force's clock; force samples outside the motion's times are left out. Keys such as ``motion.time`` in
    ``columns`` and ``units`` are for this file.

    ``baseline`` removes the bias of the force, the mean of the free travel before contact, where it is sure and
    clearly above the noise (see ``baseline.bias``); a recording that starts in contact is left alone. Without free
    travel nothing is removed. What was found on the way stands in ``notes``.

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
            from .log import read_recording

            return read_recording
        case "parquet":
            from .parquet import read_parquet

            return read_parquet
    return _read_text


def _read_text(path, columns, units, inwards, filter_length, baseline, motion, start_depth) -> Recording:
    layout = find_layout(Path(path))
    preamble = Preamble(layout.comments, str(layout.path))
    motion = Path(motion) if motion is not None else _motion_beside(layout.path, preamble)
    wanted = ("time", "force", *AXES) if motion else ("time", "force", "depth", "velocity", *AXES)
    main = read_stream(layout, wanted, _of_main(columns), _of_main(units))
    if motion:
        join(main, motion, start_depth, columns, units, INWARDS[inwards])
    else:
        _settle_motion(main, start_depth, preamble, INWARDS[inwards])
    if baseline:
        remove_bias(main, before=any(note.kind == "baseline" for note in preamble.notes()))
    main.notes += unsteadiness(main.values["time"]) + glitch_notes(main.values["time"], main.values["force"])
    return _recording(main, preamble, filter_length)


def _of_main(options: Mapping[str, str] | None) -> dict[str, str]:
    return {key: value for key, value in (options or {}).items() if not key.startswith("motion.")}


def _of_motion(options: Mapping[str, str] | None) -> dict[str, str]:
    return {key.removeprefix("motion."): value for key, value in (options or {}).items() if key.startswith("motion.")}


def _motion_beside(path: Path, preamble: Preamble) -> Path | None:
    """The motion a file's card names: a file in the same folder, and in no other."""
    name = preamble.text("motion")
    if not name:
        return None
    beside = Path(name).name
    if not beside or beside == ".." or "\0" in beside:
        raise preamble.refusal("motion", "the name of a file in the same folder is needed")
    return path.with_name(beside)


def _settle_motion(stream: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
    """Depth and velocity of a stream, + inwards, from whichever of the two it has."""
    values = stream.values
    for quantity in {"depth", "velocity"} & values.keys():
        values[quantity] = values[quantity] if inwards > 0.0 else -values[quantity]
    if "depth" not in values:
        start = _start_depth(start_depth, preamble, stream.place)
        values["depth"] = integral(values["time"], values["velocity"], start, values["time"])
        stream.said.append(f"depth is the integral of the velocity from {start:g} m at the first sample")
        if np.ptp(values["depth"]) == 0.0:
            raise constant_depth("depth", start, stream.place)
    if "velocity" in values:
        values["velocity"], changed = signed(values["time"], values["depth"], values["velocity"])
        if changed:
            stream.said.append("velocity is a speed without sign: it has the sign of the change of depth")
    else:
        values["velocity"], window = derivative(values["time"], values["depth"])
        stream.said.append(f"velocity is the change of depth over {window * 1e3:.3g} ms around each sample")


def _start_depth(given: float | None, preamble: Preamble, place: str) -> float:
    start = given if given is not None else preamble.number("start_depth_m")
    if start is None:
        raise InputError(
            "depth at the first sample",
            "unknown",
            "a velocity gives changes of depth only",
            place,
            "Give --start-depth-mm, or a line '# start_depth_m: -0.005' above the header.",
        )
    return float(start)


def join(main: Stream, path: Path, start_depth: float | None, columns, units, inwards: float) -> None:
    """Put the depth and velocity of a second file on the clock of the first."""
    layout = find_layout(path)
    wanted = ("time", "depth", "velocity")
    other = read_stream(layout, wanted, _of_motion(columns), _of_motion(units), _of_main(units))
    had_depth = "depth" in other.values
    _settle_motion(other, start_depth, Preamble(layout.comments, other.place), inwards)
    motion, force_time = other.values, main.values["time"]
    within = overlap(force_time, motion["time"], other.place)
    main.values = {quantity: np.ascontiguousarray(values[within]) for quantity, values in main.values.items()}
    time = main.values["time"]
    main.values["velocity"] = np.interp(time, motion["time"], motion["velocity"])
    if had_depth:
        main.values["depth"] = np.interp(time, motion["time"], motion["depth"])
    else:
        main.values["depth"] = integral(motion["time"], motion["velocity"], motion["depth"][0], time)
    lost = len(force_time) - len(time)
    if lost:
        what = f"{lost} samples of force lie outside the motion's times: left out"
        main.notes.append(Note("outside_motion", what, lost))
    main.said += [
        f"depth and velocity come from {other.place} (SHA-256 {other.sha256}), interpolated onto the "
        "force's clock; both clocks are taken to have the same zero",
        *other.said,
    ]
    main.notes += [Note(n.kind, f"motion: {n.message}", n.count) for n in other.notes + unsteadiness(motion["time"])]


def remove_bias(stream: Stream, before: bool) -> None:
    """Remove a sure bias; that there is none is said unless the file tells its own story (``before``)."""
    value, why = bias(stream.values["depth"], stream.values["force"])
    if value:
        stream.values["force"] = stream.values["force"] - value
        stream.notes.append(Note("baseline", f"a bias of {value:.6g} N is removed from the force: {why}"))
    elif not before:
        stream.notes.append(Note("baseline", f"no bias is removed from the force: {why}", 0))


def _recording(stream: Stream, preamble: Preamble, filter_length: int | None) -> Recording:
    values = dict(stream.values)
    four = [values.pop(quantity) for quantity in ("time", "depth", "velocity", "force")]
    signs = check_direction(four[1], four[3], stream.place)
    notes = dict.fromkeys([*preamble.notes(), *stream.notes, *signs])
    card = preamble.card(stream.place, stream.sha256, filter_length, stream.said)
    return Recording(*four, axes=values, card=card, notes=tuple(notes))
