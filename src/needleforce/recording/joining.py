# SPDX-License-Identifier: Apache-2.0
"""Force and motion brought together: depth from velocity, velocity from depth, another file's clock, which way is
inwards."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..errors import InputError
from .card import Preamble
from .formats import format_of
from .parquet_table import find_stored
from .recording import Note
from .stream import Stream, constant_depth, read_stream
from .text_layout import find_layout
from .timestamps import unsteadiness

_SMOOTHING = 0.05  # s: depth's change over this time gives the velocity
INWARDS = {"increasing": 1.0, "+": 1.0, "decreasing": -1.0, "-": -1.0}


def integral(time: np.ndarray, velocity: np.ndarray, start: float, at: np.ndarray) -> np.ndarray:
    """Depth (m,) [m] at the times ``at`` [s], from ``start`` [m] at ``time[0]`` and velocity (n,) [m/s] on ``time``.

    Velocity is taken as linear between its samples, and integrated exactly. ``at`` must lie within ``time``.
    """
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    corners = start + np.concatenate([[0.0], np.cumsum(steps)])
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    here = np.interp(at, time, velocity)
    return corners[left] + 0.5 * (velocity[left] + here) * (at - time[left])


def derivative(time: np.ndarray, depth: np.ndarray) -> tuple[np.ndarray, float]:
    """Velocity (n,) [m/s] as the change of depth over about 50 ms around each sample, and that time [s].

    The window is cut at the ends of the recording and never below the two neighbours.
    """
    step = float(np.median(np.diff(time)))
    half = min(max(1, round(0.5 * _SMOOTHING / step)), (len(time) - 1) // 2)
    if half == 0:  # two samples
        return np.full(len(time), (depth[1] - depth[0]) / (time[1] - time[0])), step
    velocity = np.empty(len(time))
    velocity[half:-half] = (depth[2 * half :] - depth[: -2 * half]) / (time[2 * half :] - time[: -2 * half])
    velocity[:half] = (depth[half : 2 * half] - depth[0]) / (time[half : 2 * half] - time[0])
    velocity[-half:] = (depth[-1] - depth[-2 * half : -half]) / (time[-1] - time[-2 * half : -half])
    return velocity, 2 * half * step


def signed(time: np.ndarray, depth: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, bool]:
    """A speed that never turns negative though depth does, with depth's sign; and whether that was so."""
    if velocity.min() < 0.0 or depth.max() - depth[-1] < 0.02 * np.ptp(depth):
        return velocity, False
    return np.copysign(velocity, derivative(time, depth)[0]), True


def overlap(time: np.ndarray, motion: np.ndarray, place: str) -> slice:
    """The samples of ``time`` (n,) [s] that lie within the motion's own times. Raises InputError below two."""
    first, last = np.searchsorted(time, motion[0], "left"), np.searchsorted(time, motion[-1], "right")
    if last - first < 2:
        raise InputError(
            "times of the motion",
            f"{motion[0]:.6g} to {motion[-1]:.6g} s",
            f"the force runs from {time[0]:.6g} to {time[-1]:.6g} s",
            place,
            "Bring both clocks to one zero, and check the units of time.",
        )
    return slice(int(first), int(last))


def check_direction(depth: np.ndarray, force: np.ndarray, place: str) -> list[Note]:
    """Refuse depth that decreases inwards; tell of a force that seems to have the other sign.

    Along the way from the first sample to the farthest one, an insertion's force rises. A withdrawal also
    goes to smaller depths, but its force falls, or is tension: it passes.
    """
    outermost, innermost = int(np.argmin(depth)), int(np.argmax(depth))
    inwards = depth[innermost] - depth[0] >= depth[0] - depth[outermost]
    stroke = force[: (innermost if inwards else outermost) + 1] - force[0]
    rise, fall = float(stroke.max()), float(-stroke.min())
    if not inwards and rise > 3.0 * fall and stroke.max() + force[0] > 0.5 * rise:
        raise InputError(
            "depth",
            f"decreasing from {depth[0]:.6g} to {depth[outermost]:.6g} m while the force grows by {rise:.4g} N",
            "it must increase inwards",
            place,
            "If this file counts the other way, give --depth-inwards decreasing.",
        )
    if inwards and fall > 3.0 * rise:
        return [
            Note(
                "sign",
                f"the force falls by {fall:.4g} N on the way in, but + is what opposes insertion: "
                "if the sensor counts the other way, give --unit force=-N",
            )
        ]
    return []


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
