# SPDX-License-Identifier: Apache-2.0
"""From a log to a recording: one clock, the bias removed, and what was lost told."""

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ...errors import InputError
from ..card import check_filter_length
from ..columns import check_known
from ..glitches import glitch_notes
from ..hashed import Hashed
from ..motion import check_direction, derivative, overlap, signed
from ..reader import INWARDS, join, remove_bias
from ..recording import Card, Note, Recording
from ..stream import Stream, constant_depth
from ..timestamps import unsteadiness
from .host_times import forward, on_one_clock
from .messages import Log, Messages
from .reader import read_log
from .topics import split_choice
from .wrenches import axes_of, told_losses, trusted, without_bias
from .writer import WRENCH_TOPIC

_CHOICES = ("force", "depth")


def read_recording(
    path, columns, units, inwards: str, filter_length: int | None, baseline: bool, motion, start_depth: float | None
) -> Recording:
    """Read a recording from an MCAP file or the folder of a ROS 2 bag; the options are those of ``nf.read``, checked.

    Time zero is the first wrench. Raises InputError for everything that makes no recording of the file.
    """
    columns, units = dict(columns or {}), dict(units or {})
    _check(columns)
    log = read_log(path, columns)
    place = str(path)
    if len(log.wrench) < 2:
        limit = "a topic of WrenchStamped or Wrench with at least 2 is needed"
        raise InputError("number of wrenches", len(log.wrench), limit, place)
    stream = Stream(place, "" if Path(path).is_dir() else Hashed(Path(path)).sha256(), {}, [], list(log.notes))
    axis_time = _put_wrenches(stream, log, columns, units, baseline)
    if motion is not None:
        join(stream, Path(motion), start_depth, columns, units, INWARDS[inwards])
    else:
        _put_motion(stream, log.axis, axis_time, units, INWARDS[inwards])
    marked = any(mark.kind == "bias" for mark in log.marks)
    if baseline and not marked:
        remove_bias(stream, before=any(note.kind == "baseline" for note in _notes(log.card)))
    stream.notes += unsteadiness(stream.values["time"]) + glitch_notes(stream.values["time"], stream.values["force"])
    return _recording(stream, log.card, filter_length)


def _check(columns: Mapping[str, str]) -> None:
    for quantity in columns:
        if quantity not in _CHOICES and not quantity.startswith("motion."):
            check_known(quantity)
            raise InputError(f"column of the {quantity}", "given", "in messages only force and depth are chosen")


def _put_wrenches(stream: Stream, log: Log, columns, units, baseline: bool) -> np.ndarray:
    """Fill in time, force and axes. Gives the times of the axis (m,) [s] on the same clock."""
    wrench = trusted(log, stream.notes)
    ours = wrench.topic == WRENCH_TOPIC
    times, said, notes = on_one_clock({"force": wrench, "depth": log.axis}, ours)
    stream.said += said
    stream.notes += notes
    told_losses(log.wrench, stream.notes)
    if baseline:
        wrench.values = without_bias(wrench, log.marks, stream)
    order = _usable(times["force"], wrench, "wrenches", stream)
    start = times["force"][order[0]] - _number(log.card, "start_s", stream.place)
    chosen = split_choice(columns.get("force", ""))[1] or log.card.get("axial", "")
    if not chosen:
        chosen = "fz"
        stream.said.append("the force along the needle is fz of the sensor")
    found = axes_of(wrench.values[order], chosen, units, log.card, stream)
    stream.values = {"time": times["force"][order] - start, **found}
    return times.get("depth", np.empty(0)) - start


def _usable(time: np.ndarray, messages: Messages, what: str, stream: Stream) -> np.ndarray:
    """The index of the messages whose numbers are finite and whose time goes on; a note on the others."""
    order = np.arange(len(time)) if messages.counted else np.argsort(time, kind="stable")
    finite = order[np.isfinite(messages.values[order, 0]) & np.isfinite(time[order])]
    finite = finite if what != "wrenches" else finite[np.isfinite(messages.values[finite]).all(axis=1)]
    kept = finite[forward(time[finite])] if len(finite) else finite
    left = len(time) - len(kept)
    if left:
        stream.notes.append(Note("left_out", f"{left} {what} are not finite or not later than those before", left))
    if len(kept) < 2:
        raise InputError(f"number of {what}", len(kept), "at least 2 that are finite are needed", stream.place)
    return kept


def _put_motion(stream: Stream, axis: Messages, time: np.ndarray, units, inwards: float) -> None:
    """Depth and velocity of the axis, + inwards, on the force's clock."""
    from ...units import parse

    if not len(axis):
        limit = "there is no JointState or PoseStamped"
        advice = "Give the motion with --motion FILE: a table of time and depth, or velocity, with the log's time zero."
        raise InputError("the depth", "missing", limit, stream.place, advice)
    kept = _usable(time, axis, "states of the axis", stream)
    to_si = parse(units.get("depth", "m"), "length", "depth").to_si
    time, depth, velocity = time[kept], to_si(axis.values[kept, 0]) * inwards, to_si(axis.values[kept, 1]) * inwards
    if not np.isfinite(velocity).all():
        velocity, window = derivative(time, depth)
        stream.said.append(f"velocity is the change of depth over {window * 1e3:.3g} ms around each sample")
    velocity, changed = signed(time, depth, velocity)
    if changed:
        stream.said.append("velocity is a speed without sign: it has the sign of the change of depth")
    _interpolate(stream, time, depth, velocity)


def _interpolate(stream: Stream, time: np.ndarray, depth: np.ndarray, velocity: np.ndarray) -> None:
    before = len(stream.values["time"])
    within = overlap(stream.values["time"], time, stream.place)
    stream.values = {quantity: np.ascontiguousarray(values[within]) for quantity, values in stream.values.items()}
    at = stream.values["time"]
    stream.values |= {"depth": np.interp(at, time, depth), "velocity": np.interp(at, time, velocity)}
    lost = before - len(at)
    if lost:
        what = f"{lost} samples of force lie outside the motion's times: left out"
        stream.notes.append(Note("outside_motion", what, lost))
    if np.ptp(stream.values["depth"]) == 0.0:
        raise constant_depth("depth", stream.values["depth"][0], stream.place)


def _recording(stream: Stream, card: Mapping[str, str], filter_length: int | None) -> Recording:
    values = dict(stream.values)
    four = [values.pop(quantity) for quantity in ("time", "depth", "velocity", "force")]
    length = filter_length or int(_number(card, "filter_length", stream.place, usual=1))
    check_filter_length(length)
    said = tuple(dict.fromkeys([*_listed(card, "assumptions"), *stream.said]))
    texts = (card.get(key, "") for key in ("needle", "tissue", "rig"))
    notes = (*_notes(card), *stream.notes, *check_direction(four[1], four[3], stream.place))
    return Recording(*four, axes=values, card=Card(stream.place, stream.sha256, *texts, length, said),
                     notes=tuple(dict.fromkeys(notes)))  # fmt: skip


def _number(card: Mapping[str, str], key: str, place: str, usual: float = 0.0) -> float:
    try:
        number = float(card.get(key, usual))
    except ValueError:
        number = np.nan
    if not np.isfinite(number):
        raise InputError(f"{key} in the file's card", repr(card[key][:40]), "a number is needed", place)
    return number


def _notes(card: Mapping[str, str]) -> list[Note]:
    """The notes a recording brought along when it was written."""
    entries = (each for each in _listed(card, "notes") if isinstance(each, list) and len(each) == 3)
    return [Note(str(kind), str(message), count) for kind, message, count in entries if isinstance(count, int)]


def _listed(card: Mapping[str, str], key: str) -> list:
    try:
        found = json.loads(card.get(key, "[]"))
    except (ValueError, RecursionError):
        return []
    return found if isinstance(found, list) else []
