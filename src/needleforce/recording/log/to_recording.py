# SPDX-License-Identifier: Apache-2.0
"""From a log to a recording: messages on one clock, faulty wrenches left out, bias removed, losses reported."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import file_name
from ...units import parse
from ..alignment import align
from ..assumed_motion import AssumedMotion
from ..card import check_filter_length
from ..force_signal import glitch_notes, remove_bias
from ..joining import INWARDS, derivative, differentiate, join, leave_out_beyond, put_signs, signed
from ..motion_source import MotionSource
from ..options import ReadOptions
from ..quantities import AXES as RECORDING_AXES
from ..quantities import check_known, dimension
from ..recording import Card, Note, Recording
from ..samples import Decimated, timing_notes
from ..stream import Stream, constant_depth
from .messages import Log, Mark, Messages, distinct
from .reader import logs
from .topics import AS_TABLE
from .writer import WRENCH_TOPIC

_MAX_RESTARTS = 20  # a device clock that decreases more often is not used
_SECOND = 1e9  # ns
_MAX_FORCE = 1e9  # [N, N m] of a bias; a damaged mark may hold any number
_MAX_LISTED = 8  # topics in a message
_MAX_COUNT = 10**15  # of a note
_BLOCK = 1 << 18  # messages that are in memory at a time where a recording is reduced: some 150 MB
_NUMBER = re.compile(r"[\d.]+(e[+-]?\d+)?")
AXES = ("fx", "fy", "fz", "tx", "ty", "tz")
_CHOICES = ("force", "depth")


def on_one_clock(
    streams: dict[str, Messages], ours: bool, origin: int | None = None
) -> tuple[dict[str, np.ndarray], list[str], list[Note], int]:
    """Times (n,) [s] from the ``origin``, by default the first message of the first stream, assumptions, notes on the
    clocks' accuracy, and the origin [ns].

    ``ours`` is True for a file of this package. The headers of other recorders contain the time of measurement; those
    of this package are used only if no device has a clock of its own.
    """
    present = {name: each for name, each in streams.items() if len(each)}
    if all(_stamped(each) for each in present.values()) and not (ours and any(map(_has_clock, present.values()))):
        origin = int(next(iter(present.values())).stamp[0]) if origin is None else origin
        assumptions = ["times are those in the messages' headers, from one clock"]
        return {name: (each.stamp - origin) / _SECOND for name, each in present.items()}, assumptions, [], origin
    origin = int(next(iter(present.values())).arrival[0]) if origin is None else origin
    times, assumptions, notes = {}, [], []
    for name, each in present.items():
        times[name], assumed, found = _aligned(name, each, origin)
        assumptions, notes = assumptions + assumed, notes + found
    return times, assumptions, notes, origin


def forward(time: np.ndarray) -> np.ndarray:
    """Whether each of ``time`` (n,) is later than all previous ones."""
    return np.concatenate([[True], time[1:] > np.maximum.accumulate(time)[:-1]])


def _stamped(messages: Messages) -> bool:
    return distinct(messages.stamp) > len(messages) // 2


def _has_clock(messages: Messages) -> bool:
    return not np.array_equal(messages.device, messages.arrival)


def _aligned(name: str, messages: Messages, origin: int) -> tuple[np.ndarray, list[str], list[Note]]:
    arrival, device = (messages.arrival - origin) / _SECOND, (messages.device - messages.device[0]) / _SECOND
    starts = np.flatnonzero(np.diff(messages.device) < 0) + 1
    if not _has_clock(messages) or len(starts) > _MAX_RESTARTS:
        return arrival, [f"the {name} has no clock of its own: its times are the arrival times"], []
    parts = [slice(*ends) for ends in pairwise((0, *starts.tolist(), len(device)))]
    host, notes = np.empty(len(device)), []
    for part in parts:
        found = align(device[part], arrival[part])
        host[part] = found.host(device[part])
        drift, bound = (found.rate - 1.0) * 1e6, found.uncertainty * 1e3
        accuracy = f"within {bound:.3g} ms" if np.isfinite(bound) else "with unknown uncertainty (too few samples)"
        notes.append(Note("alignment", f"the clock of the {name} is aligned {accuracy}, its drift is {drift:.3g} ppm"))
    if len(parts) > 1:
        notes.append(Note("restart", f"the clock of the {name} restarted {len(starts)} times", len(starts)))
    return host, [], notes


def without_faults(log: Log, notes: list[Note]) -> Messages:
    """The wrenches without those with a fault status; notes count these and the duplicates."""
    if log.wrench.duplicated:
        message = f"{log.wrench.duplicated} wrenches arrived twice and are used once"
        notes.append(Note("duplicated", message, log.wrench.duplicated))
    marked = [mark.facts.get("sequence") for mark in log.marks if mark.kind == "status"]
    faulty = [sequence & 0xFFFFFFFF for sequence in marked if isinstance(sequence, int)]
    wrong = np.isin(log.wrench.sequence % 2**32, np.array(faulty, np.int64)) if log.wrench.counted else np.zeros(
        len(log.wrench), bool)  # fmt: skip
    if wrong.any():
        count = int(wrong.sum())
        words = sorted({str(mark.facts.get("words", "")) for mark in log.marks if mark.kind == "status"})
        message = f"{count} wrenches have a fault status ({'; '.join(words)[:200]}) and are left out"
        notes.append(Note("status", message, count))
    return log.wrench.kept(~wrong) if wrong.any() else log.wrench


def note_losses(wrench: Messages, notes: list[Note]) -> None:
    """Add a note on lost wrenches, from the sensor's counter and clock."""
    if not wrench.counted or len(wrench) < 2:
        return
    steps = np.diff(wrench.sequence)
    lost = int(steps.sum()) - len(steps)
    if lost:
        longest = 1e-9 * float(np.max(np.diff(wrench.device)[steps > 1]))
        share = 100.0 * lost / (lost + len(wrench))
        message = f"{lost} of {lost + len(wrench)} wrenches ({share:.3g} %) are lost, the longest gap is "
        notes.append(Note("lost", f"{message}{longest * 1e3:.4g} ms", lost))


def without_bias(wrench: Messages, marks: list[Mark], stream: Stream) -> np.ndarray:
    """The values (n, 6) minus the last bias marked before each; values before the first mark use the first bias."""
    biases = [(mark.arrival, bias) for mark in marks if mark.kind == "bias" for bias in [_six(mark.facts)] if bias]
    if not biases:
        return wrench.values
    arrivals, values = np.array([at for at, _ in biases]), np.array([bias for _, bias in biases])
    which = np.maximum(np.searchsorted(arrivals, wrench.arrival, "right") - 1, 0)
    shown = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(AXES, values[0]))
    stream.notes.append(Note("baseline", f"the bias measured before contact is removed: {shown} N, N m", len(biases)))
    found = wrench.values.copy(order="F")  # each axis by itself: of a recording of hours each copy counts
    for axis in range(found.shape[1]):
        found[:, axis] -= values[which, axis]
    return found


def axes_of(
    values: np.ndarray, chosen: str, units: Mapping[str, str], card: Mapping[str, str], stream: Stream
) -> dict[str, np.ndarray]:
    """Force and the other axes in SI from (n, 6); ``chosen`` is the axial one, such as ``fz`` or ``-fx``."""
    axial = chosen.removeprefix("-")
    if axial not in AXES[:3]:
        limit = "known are fx, fy, fz, -fx, -fy, -fz"
        advice = "Give the axis along the needle, for example --column force=fz."
        raise InputError("axis of the force", repr(chosen[:40]), limit, stream.place, advice)
    recorded = card["axes"].split() if "axes" in card else AXES
    force = values[:, AXES.index(axial)] * (-1.0 if chosen.startswith("-") else 1.0)
    found = {"force": _in_si("force", force, units)}
    for index, name in enumerate(AXES):
        if name in RECORDING_AXES and name in recorded and name != axial:
            found[name] = _in_si(name, values[:, index], units)
    if axial != "fz":
        stream.notes.append(Note("left_out", "the sensor's fz is left out: in a recording the name means axial force"))
    return found


def _in_si(quantity: str, values: np.ndarray, units: Mapping[str, str]) -> np.ndarray:
    if quantity not in units:
        return values
    return parse(units[quantity], dimension(quantity), quantity).to_si(values)


def _six(facts: Mapping) -> list[float] | None:
    bias = facts.get("wrench")
    valid = isinstance(bias, list) and len(bias) == 6 and all(isinstance(each, int | float) for each in bias)
    return list(map(float, bias)) if valid and all(abs(each) < _MAX_FORCE for each in bias) else None


def read_recording(path: Path, options: ReadOptions, assumed: AssumedMotion) -> Recording:
    """Read a recording from an MCAP file or the folder of a ROS 2 bag; the checked options are those of ``nf.read``.

    Time zero is the first wrench. Raises InputError if the file cannot be read as a recording.
    """
    columns = dict(options.columns or {})
    _check(path, columns, options)
    reduced = None if options.decimate_to is None else Decimated(options.decimate_to)
    part = None if options.part is None else str(options.part).strip()
    blocks = logs(path, columns, part, math.inf if reduced is None else _BLOCK)
    stream = Stream(place=file_name(path), sha256="", values={}, assumptions=[], notes=[])
    clock = _Clock()
    for log in blocks:
        stream.notes += log.notes
        if reduced is None or len(log.wrench) > 1 or not reduced.count:
            _put_block(stream, log, clock, options)
        if reduced is not None and stream.values:
            reduced.add(stream.values)
            stream.values = {}
    if reduced is not None:
        stream.values, stream.notes = reduced.values(), _merged(stream.notes)
    _settle_motion(stream, options, assumed, clock.moving)
    recording = _recording(stream, log, options)
    return recording if reduced is None else replace(recording, card=reduced.card(recording.card))


@dataclass
class _Clock:
    """What the blocks of a recording share: the origin [ns] of its times, the time of its first wrench on that clock
    [s], and whether it has a motion."""

    origin: int | None = None
    start: float | None = None
    moving: bool = False


def _put_block(stream: Stream, log: Log, clock: _Clock, options: ReadOptions) -> None:
    """Set time, force and axes of the stream, and depth and velocity if the log has them."""
    if len(log.wrench) < 2:
        has = f"; it has {', '.join(log.others[:_MAX_LISTED])}" if log.others else ""
        limit = f"a topic of WrenchStamped or Wrench with at least 2 messages is needed{has}"
        step = (
            f"If one of these has the force: {AS_TABLE[0].lower()}{AS_TABLE[1:]}"
            if has
            else "Check that the force was recorded."
        )
        raise InputError("number of wrenches", len(log.wrench), limit, stream.place, step)
    axis_time = _put_wrenches(stream, log, clock, options)
    log.wrench = log.wrench.kept(np.empty(0, int))  # of hours they take as much memory as the recording
    if options.motion is not None or not (clock.moving or len(log.axis)):
        return
    time = stream.values["time"]
    if clock.moving and (len(log.axis) < 2 or axis_time.max() <= time[0] or axis_time.min() >= time[-1]):
        message = f"{len(time)} samples of force are outside the motion's times and are left out"
        stream.notes.append(Note("outside_motion", message, len(time)))
        stream.values = {}
        return
    clock.moving = True
    _put_motion(stream, log.axis, axis_time, dict(options.units or {}), INWARDS[options.inwards or "increasing"])


def _settle_motion(stream: Stream, options: ReadOptions, assumed: AssumedMotion, moving: bool) -> None:
    """Set a motion that is not in the log: of another file, or that the user states."""
    unused = assumed.without_motion(options.motion is not None).unused(True, moving)
    stream.notes += [Note("unused", unused)] if unused else []
    if options.motion is not None:
        source = MotionSource(path=Path(options.motion), part=options.motion_part, shift=options.motion_shift)
        chosen = {"columns": options.columns, "units": options.units, "start_depth": options.start_depth}
        join(stream, source, **chosen, inwards=INWARDS[options.inwards or "increasing"])
    elif not moving and assumed.gives_depth(True):
        stream.values["depth"], sentence = assumed.depth(stream.values["time"])
        stream.assumptions.append(sentence)
        differentiate(stream)
    elif not moving:
        limit = "the file contains no JointState or PoseStamped"
        advice = (
            "Give a table of time and depth or velocity with --motion FILE, or --speed-mm-s of a constant motion, with "
            "--stroke-mm and --hold-s if it stops or returns."
        )
        raise InputError("the depth", "missing", limit, stream.place, advice)
    elif np.ptp(stream.values["depth"]) == 0.0:
        raise constant_depth("depth", stream.values["depth"][0], stream.place)


def _merged(notes: list[Note]) -> list[Note]:
    """The notes of blocks, of those that differ in their numbers only the one with the largest count, and the sum."""
    similar: dict[tuple[str, str], list[Note]] = {}
    for note in dict.fromkeys(notes):
        similar.setdefault((note.kind, _NUMBER.sub("#", note.message)), []).append(note)
    merged = []
    for several in similar.values():
        first, total = max(several, key=lambda note: note.count), sum(note.count for note in several)
        more = f" (in the worst of {len(several)} blocks; {total} in all)" if len(several) > 1 else ""
        merged.append(Note(first.kind, first.message + more, total))
    return merged


def _check(path: Path, columns: Mapping[str, str], options: ReadOptions) -> None:
    """Raise InputError for an option that chooses a table, or a column that a log has not."""
    if options.motion_part is not None and options.motion is None:
        step = "Choose the motion with --column depth=TOPIC:JOINT, or give a file with --motion."
        raise InputError("motion part", options.motion_part, "a log has no tables", str(path), step)

    for quantity in columns:
        if quantity not in _CHOICES and not quantity.startswith("motion."):
            check_known(quantity)
            limit = "in a log only force and depth can be chosen"
            raise InputError(f"column of the {quantity}", "given", limit, next_step="Leave it out.")


def _put_wrenches(stream: Stream, log: Log, clock: _Clock, options: ReadOptions) -> np.ndarray:
    """Set time, force and axes of the stream; return the times of the axis (m,) [s] on the same clock."""
    wrench = without_faults(log, stream.notes)
    ours = wrench.topic == WRENCH_TOPIC
    times, assumptions, notes, clock.origin = on_one_clock({"force": wrench, "depth": log.axis}, ours, clock.origin)
    stream.assumptions += assumptions
    stream.notes += notes
    note_losses(log.wrench, stream.notes)
    if options.baseline:
        wrench = replace(wrench, values=without_bias(wrench, log.marks, stream))
    order = _usable(times["force"], wrench, "wrenches", stream)
    time = times["force"][order]
    if clock.start is None:
        clock.start = time[0] - _number(log.card, "start_s", stream.place)
    chosen = log.axial or log.card.get("axial", "")
    if not chosen:
        chosen = "fz"
        stream.assumptions.append("the force along the needle is fz of the sensor")
    found = axes_of(wrench.values[order], chosen, dict(options.units or {}), log.card, stream)
    stream.values = {"time": time - clock.start, **found}
    return times.get("depth", np.empty(0)) - clock.start


def _usable(time: np.ndarray, messages: Messages, what: str, stream: Stream) -> np.ndarray | slice:
    """The index of the messages with finite values and increasing times, a slice of all; a note on the others."""
    order = np.arange(len(time)) if messages.counted else np.argsort(time, kind="stable")
    needed = messages.values if what == "wrenches" else messages.values[:, :1]
    finite = order[(np.isfinite(needed).all(axis=1) & np.isfinite(time))[order]]
    kept = finite[forward(time[finite])] if len(finite) else finite
    left = len(time) - len(kept)
    if left:
        message = f"{left} {what} are not finite or not later than the previous ones and are left out"
        stream.notes.append(Note("left_out", message, left))
    if len(kept) < 2:
        limit = "at least 2 with finite values and increasing times are needed"
        raise InputError(f"number of {what}", len(kept), limit, stream.place, "Check the recording of this topic.")
    return kept if left or not messages.counted else slice(None)


def _put_motion(stream: Stream, axis: Messages, time: np.ndarray, units: Mapping[str, str], inwards: float) -> None:
    """Set depth and velocity of the axis, positive inwards, on the force's clock."""
    kept = _usable(time, axis, "states of the axis", stream)
    to_si = parse(units.get("depth", "m"), "length", "depth").to_si
    time, depth, velocity = time[kept], to_si(axis.values[kept, 0]) * inwards, to_si(axis.values[kept, 1]) * inwards
    if not np.isfinite(velocity).all():
        velocity, window = derivative(time, depth)
        stream.assumptions.append(f"velocity is the change of depth over {window * 1e3:.3g} ms around each sample")
    velocity, changed = signed(time, depth, velocity)
    if changed:
        stream.assumptions.append("velocity is a speed without sign: it has the sign of the change of depth")
    leave_out_beyond(stream, time, stream.place)
    at = stream.values["time"]
    stream.values |= {"depth": np.interp(at, time, depth), "velocity": np.interp(at, time, velocity)}


def _recording(stream: Stream, log: Log, options: ReadOptions) -> Recording:
    """The recording with its signs, without bias, with notes on what the samples show; ``log`` is the last block."""
    card, notes = log.card, _notes(log.card)
    if log.wrench.topic != WRENCH_TOPIC:
        units = {"force": log.axial} if "force" in (options.columns or {}) else options.units
        put_signs(stream, options.inwards, units)
    if options.baseline and not any(mark.kind == "bias" for mark in log.marks):
        remove_bias(stream, already_noted=any(note.kind == "baseline" for note in notes))
    stream.notes += timing_notes(stream.values["time"]) + glitch_notes(stream.values["time"], stream.values["force"])
    length = options.filter_length or int(_number(card, "filter_length", stream.place, default=1))
    check_filter_length(length)
    read_card = Card(
        source=stream.place,
        sha256=log.sha256,
        **{key: card.get(key, "") for key in ("needle", "tissue", "rig")},
        filter_length=length,
        assumptions=tuple(dict.fromkeys([*_listed(card, "assumptions"), *stream.assumptions])),
    )
    return stream.recording(read_card, notes)


def _number(card: Mapping[str, str], key: str, place: str, default: float = 0.0) -> float:
    try:
        number = float(card.get(key, default))
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        limit, step = "a number is needed", "Give the value as an option."
        raise InputError(f"{key} in the file's card", repr(card[key][:40]), limit, place, step)
    return number


def _notes(card: Mapping[str, str]) -> list[Note]:
    """The notes stored in the card."""
    entries = (each for each in _listed(card, "notes") if isinstance(each, list) and len(each) == 3)
    counted = (each for each in entries if isinstance(each[2], int) and 0 <= each[2] < _MAX_COUNT)
    return [Note(str(kind), str(message), count) for kind, message, count in counted]


def _listed(card: Mapping[str, str], key: str) -> list:
    try:
        found = json.loads(card.get(key, "[]"))
    except (ValueError, RecursionError):
        return []
    return found if isinstance(found, list) else []
