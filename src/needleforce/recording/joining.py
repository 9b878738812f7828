# SPDX-License-Identifier: Apache-2.0
"""Force and motion brought together: depth and velocity of one stream, or of another on the force's clock."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from .card import Preamble
from .formats import format_of
from .motion import derivative, integral, overlap, signed
from .parquet_table import find_stored
from .recording import Note
from .stream import Stream, constant_depth, read_stream
from .text_layout import find_layout
from .timestamps import unsteadiness


def of_main(options: Mapping[str, str] | None) -> dict[str, str]:
    """The options that are not for the file with the motion."""
    return {key: value for key, value in (options or {}).items() if not key.startswith("motion.")}


def _of_motion(options: Mapping[str, str] | None) -> dict[str, str]:
    return {key.removeprefix("motion."): value for key, value in (options or {}).items() if key.startswith("motion.")}


def settle_motion(stream: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
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
    layout = find_stored(path) if format_of(path) == "parquet" else find_layout(path)
    wanted = ("time", "depth", "velocity")
    other = read_stream(layout, wanted, _of_motion(columns), _of_motion(units), of_main(units))
    put_motion(main, other, start_depth, Preamble(layout.comments, other.place), inwards)
    main.said += [
        f"depth and velocity come from {other.place} (SHA-256 {other.sha256}), interpolated onto the "
        "force's clock; both clocks are taken to have the same zero",
        *other.said,
    ]


def put_motion(main: Stream, other: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
    """Put the depth and velocity of another stream on the clock of the first; what lies outside is left out."""
    had_depth = "depth" in other.values
    settle_motion(other, start_depth, preamble, inwards)
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
    main.notes += [Note(n.kind, f"motion: {n.message}", n.count) for n in other.notes + unsteadiness(motion["time"])]
