# SPDX-License-Identifier: Apache-2.0
"""Force and motion combined: depth from velocity, velocity from depth, a motion file with another clock, and the signs
of both, recognised where the data show them: a needle goes in before it comes out, and what it does to the tissue costs
work."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .. import core
from ..errors import InputError
from .card import Preamble
from .recording import Note, derivative
from .samples import timing_notes
from .stream import Stream, constant_depth, has_both_signs
from .table import Table

if TYPE_CHECKING:
    from .motion_source import MotionSource

RETURNED = 0.2  # of the travel: a recording that ends so near to its start is of a complete cycle
_ENDS = 0.1  # of the travel at either end of a single stroke, whose forces are compared
_RATIO = 3.0  # of the forces at both ends, and of work done and given back, beyond which a sign is sure
_FREE = 0.02  # of the travel: its forces are the value at the start
_MIN_SAMPLES, _NOISE = 20, 10.0  # samples of a stroke, and noise of the force, below which it shows no sign

DEPTH_REVERSED = "depth decreases while the needle goes in: its sign is reversed (--depth-inwards increasing keeps it)"
FORCE_REVERSED = "the force falls while the needle goes in: its sign is reversed (--unit force=+N keeps it)"
WITHDRAWAL = (
    "depth decreases, and the force does not show an insertion: it is taken for a withdrawal "
    "(--depth-inwards decreasing makes it an insertion)"
)

INWARDS = {"increasing": 1.0, "+": 1.0, "decreasing": -1.0, "-": -1.0}


def integral(time: np.ndarray, velocity: np.ndarray, start: float, at: np.ndarray) -> np.ndarray:
    """Integrate a velocity to depth.

    Parameters
    ----------
    time : (n,) array
        Times [s] of the velocity samples, increasing.
    velocity : (n,) array
        Velocity [m/s], linear between its samples.
    start : float
        Depth [m] at ``time[0]``.
    at : (m,) array
        Times [s] of the result, within ``time``.

    Returns
    -------
    (m,) array
        Depth [m]; the integral is exact.
    """
    steps = 0.5 * (velocity[1:] + velocity[:-1]) * np.diff(time)
    corners = start + np.concatenate([[0.0], np.cumsum(steps)])
    left = np.clip(np.searchsorted(time, at, side="right") - 1, 0, len(time) - 2)
    here = np.interp(at, time, velocity)
    return corners[left] + 0.5 * (velocity[left] + here) * (at - time[left])


def signed(time: np.ndarray, depth: np.ndarray, velocity: np.ndarray) -> tuple[np.ndarray, bool]:
    """Give a speed that is never negative the sign of the change of depth; also return whether it was changed."""
    if velocity.min() < 0.0 or depth.max() - depth[-1] < 0.02 * np.ptp(depth):
        return velocity, False
    return np.copysign(velocity, derivative(time, depth)[0]), True


def overlap(time: np.ndarray, motion: np.ndarray, place: str) -> slice:
    """The samples of ``time`` (n,) [s] within the times of the motion. Raises InputError for fewer than two."""
    first, last = np.searchsorted(time, motion[0], "left"), np.searchsorted(time, motion[-1], "right")
    if last - first < 2:
        later = time[0] - motion[0]
        order = "later" if later > 0.0 else "earlier"
        value = f"{motion[0]:.10g} to {motion[-1]:.10g} s"
        limit = f"the force runs from {time[0]:.10g} to {time[-1]:.10g} s and begins {abs(later):.10g} s {order}"
        step = f"Give --motion-shift-s {later:.3f} if both began together (it is added to the times of the motion), or "
        step += "check the units of time."
        raise InputError("times of the motion", value, limit, place, step)
    return slice(int(first), int(last))


def put_signs(stream: Stream, inwards: str | None, units: Mapping[str, str] | None) -> None:
    """Reverse depth or force where the data show that the file has the opposite sign, unless the sign was given."""
    given = (units or {}).get("force", "").strip()[:1]
    known = {"depth_known": inwards is not None, "force_known": given in ("-", "+", "\u2212")}
    found = signs_of(stream.values["depth"], stream.values["force"], **known)
    for quantity, factor in (("depth", found.depth), ("velocity", found.depth), ("force", found.force)):
        if factor < 0.0:
            stream.values[quantity] = -stream.values[quantity]
    stream.assumptions += found.sentences


def settle_motion(stream: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
    """Set depth and velocity of a stream, positive inwards, from the one that it contains."""
    _settle_depth(stream, start_depth, preamble, inwards)
    if "velocity" not in stream.values:
        differentiate(stream)


def differentiate(stream: Stream) -> None:
    """Set the velocity of a stream with time and depth, and say over which time it is taken."""
    stream.values["velocity"], window = derivative(stream.values["time"], stream.values["depth"])
    stream.assumptions.append(f"velocity is the change of depth over {window * 1e3:.3g} ms around each sample")


def _settle_depth(stream: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
    values = stream.values
    for quantity in {"depth", "velocity"} & values.keys():
        values[quantity] = values[quantity] if inwards > 0.0 else -values[quantity]
    if "depth" not in values:
        start = _start_depth(start_depth, preamble, stream.place)
        values["depth"] = integral(values["time"], values["velocity"], start, values["time"])
        stream.assumptions.append(f"depth is the integral of the velocity from {start:g} m at the first sample")
        stream.assumptions += _speed_without_sign(values["velocity"], values.get("force"))
        if np.ptp(values["depth"]) == 0.0:
            raise constant_depth("depth", start, stream.place)
    if "velocity" in values:
        values["velocity"], changed = signed(values["time"], values["depth"], values["velocity"])
        if changed:
            stream.assumptions.append("velocity is a speed without sign: it has the sign of the change of depth")


def _speed_without_sign(velocity: np.ndarray, force: np.ndarray | None) -> list[str]:
    """A sentence if an integrated velocity may be a speed: it is never negative, and the force has both signs."""
    if force is None or velocity.min() < 0.0 or not has_both_signs(force):
        return []
    found = "the velocity is never negative, but the force has both signs, as if the needle was drawn out"
    return [f"{found}: if it is a speed without sign, this depth is wrong, and a file with the motion is needed"]


def _start_depth(given: float | None, preamble: Preamble, place: str) -> float:
    start = given if given is not None else preamble.number("start_depth_m")
    if start is None:
        limit = "a velocity determines only changes of depth"
        step = "Give it, for example --start-depth-mm 0 to count from there, or add a line such as "
        step += "'# start_depth_m: -0.005' above the header."
        raise InputError("depth at the first sample", "unknown", limit, place, step)
    return float(start)


def join(
    main: Stream,
    source: "MotionSource",
    *,
    table: Table | None = None,
    start_depth: float | None,
    columns: Mapping[str, str] | None,
    units: Mapping[str, str] | None,
    inwards: float,
) -> None:
    """Interpolate depth and velocity of another table, of a second file or of the same, onto the clock of the force;
    ``table`` is that of the force."""
    other, part = source.stream(columns, units)
    offset, described = source.start_offset(table, part.table), source.described(other, part)
    other.values["time"] = other.values["time"] + offset
    put_motion(main, other, start_depth, Preamble(part.table.comments, other.place), inwards)
    zero = f"their starts are {offset:g} s apart, as the file states" if offset else ""
    zero = zero if source.shift is None else f"{source.shift:.12g} s are added to its times, as given"
    main.assumptions += [
        f"depth and velocity are read from {described} and interpolated onto the "
        f"force's clock; {zero or 'both clocks are assumed to have the same zero'}",
        *other.assumptions,
    ]


def put_motion(main: Stream, other: Stream, start_depth: float | None, preamble: Preamble, inwards: float) -> None:
    """Interpolate depth and velocity of another stream onto the clock of the first; force samples outside the motion's
    times are left out."""
    had_depth = "depth" in other.values
    _settle_depth(other, start_depth, preamble, inwards)
    motion = other.values
    leave_out_beyond(main, motion["time"], other.place)
    time = main.values["time"]
    if had_depth:
        main.values["depth"] = np.interp(time, motion["time"], motion["depth"])
    else:
        main.values["depth"] = integral(motion["time"], motion["velocity"], motion["depth"][0], time)
        main.assumptions += _speed_without_sign(motion["velocity"], main.values.get("force"))
    if "velocity" in motion:
        main.values["velocity"] = np.interp(time, motion["time"], motion["velocity"])
    else:  # on the clock of the force: the motion may be given by its corners
        differentiate(main)
    main.notes += [Note(n.kind, f"motion: {n.message}", n.count) for n in other.notes + timing_notes(motion["time"])]


def leave_out_beyond(stream: Stream, motion: np.ndarray, place: str) -> None:
    """Leave out samples outside the times of the motion (m,) [s], with a note. Raises InputError as ``overlap``."""
    before = len(stream.values["time"])
    within = overlap(stream.values["time"], motion, place)
    stream.values = {quantity: np.ascontiguousarray(values[within]) for quantity, values in stream.values.items()}
    lost = before - len(stream.values["time"])
    if lost:
        message = f"{lost} samples of force are outside the motion's times and are left out"
        stream.notes.append(Note("outside_motion", message, lost))


@dataclass(frozen=True)
class Signs:
    """Factors of +1 or -1 for depth and force, with a sentence for each that is assumed."""

    depth: float = 1.0
    force: float = 1.0
    sentences: tuple[str, ...] = ()


def signs_of(depth: np.ndarray, force: np.ndarray, *, depth_known: bool = False, force_known: bool = False) -> Signs:
    """Recognise reversed signs.

    Parameters
    ----------
    depth, force : (n,) array
        As in the file, in SI.
    depth_known, force_known : bool
        The sign was given and is not changed.

    Returns
    -------
    Signs
        Factors, and what was assumed.

    Notes
    -----
    The stroke is the motion from the first sample to the farthest one. It is an insertion if the recording returns to
    where it began, as a needle cannot be drawn out before it was inserted, or if it begins with free travel: the force
    changes within the first tenth of the travel by less than a third of its change within the last tenth; a withdrawal
    ends so. Where neither holds, the force at the end must be three times that at the start. Any other stroke is left
    as it is, and a sentence states so if its depth decreases. Along an insertion the force does
    work against the motion: the force is reversed if this work is negative and three times the work with the other
    sign. A constant bias does not matter, because the force counts from its value at the start; a force that changes by
    less than ten times its noise, of which white noise is capable in none of 1e12 recordings, shows no sign.
    """
    if len(depth) < 2 or np.ptp(depth) == 0.0:
        return Signs()
    far = int(np.argmax(np.abs(depth - depth[0])))
    outwards = bool(depth[far] < depth[0])
    stroke, travel = force[: far + 1], np.abs(depth[: far + 1] - depth[0])
    inserted = _is_insertion(depth, travel, stroke)
    if outwards and not depth_known and not inserted:
        return Signs(sentences=(WITHDRAWAL,))
    turned = outwards and not depth_known
    reverse = (inserted and (turned or not outwards)) and not force_known and _is_against(travel, stroke)
    sentences = (DEPTH_REVERSED,) * turned + (FORCE_REVERSED,) * reverse
    return Signs(-1.0 if turned else 1.0, -1.0 if reverse else 1.0, sentences)


def _is_insertion(depth: np.ndarray, travel: np.ndarray, force: np.ndarray) -> bool:
    """Whether the first stroke goes in."""
    full = float(travel[-1])
    if abs(depth[-1] - depth[0]) <= RETURNED * full:
        return True
    start, end = force[travel <= _ENDS * full], force[travel >= (1.0 - _ENDS) * full]
    noise = core.second_difference_noise(np.ascontiguousarray(force, float))
    if len(force) < _MIN_SAMPLES or np.abs(np.median(end) - np.median(start)) <= _NOISE * noise:
        return False
    changes = _change_within(start), _change_within(end)
    if max(changes) > _RATIO * min(changes):
        return changes[1] > changes[0]
    return bool(np.abs(np.median(end)) > _RATIO * np.abs(np.median(start)))


def _change_within(force: np.ndarray) -> float:
    """By how much a force changes from the first to the second half of its samples."""
    half = max(1, len(force) // 2)
    return float(np.abs(np.median(force[half:]) - np.median(force[:half]))) if len(force) > 1 else 0.0


def _is_against(travel: np.ndarray, force: np.ndarray) -> bool:
    """Whether the force helps the motion along the first stroke, counted from its value at the start."""
    change = force - np.median(force[travel <= _FREE * travel[-1]])
    shown = float(np.abs(change).max()) / _NOISE
    if len(force) < _MIN_SAMPLES or core.noise_exceeds(np.ascontiguousarray(force, float), shown):
        return False
    work = 0.5 * (change[1:] + change[:-1]) * np.diff(travel)
    return bool(-work[work < 0.0].sum() > _RATIO * work[work > 0.0].sum())
