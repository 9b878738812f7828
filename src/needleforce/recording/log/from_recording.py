# SPDX-License-Identifier: Apache-2.0
"""A recording, measured or simulated, as a log: any viewer of robots shows it."""

import json
import os
from pathlib import Path

import numpy as np

from ...errors import InputError
from ...files import checked_target
from ..recording import Recording
from .writer import LogWriter

_AXES = ("fx", "fy", "tx", "ty", "tz")


def write_log(recording: Recording, path: str | os.PathLike) -> Path:
    """Write a recording as MCAP, whole or not at all. ``read`` gives the same numbers back, times to the ns.

    The force is the wrench's fz, depth and velocity are states of the axis at the same times; the parts of a simulated
    force have no place in these messages and stay out. Raises InputError for times that are one and the same in ns,
    values that are not finite, and a file that cannot be made.
    """
    times = np.round((recording.time - recording.time[0]) * 1e9)
    target = checked_target(path)
    _check(recording, times, str(target))
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        _write(recording, times.astype(int).tolist(), part)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)
    return target


def _write(recording: Recording, times: list[int], part: Path) -> None:
    fx, fy, tx, ty, tz = (recording.axes.get(axis, np.zeros(len(times))).tolist() for axis in _AXES)
    wrenches = zip(fx, fy, recording.force.tolist(), tx, ty, tz)
    states = zip(recording.depth.tolist(), recording.velocity.tolist())
    log = LogWriter(part, _card(recording))
    for number, (time, wrench, state) in enumerate(zip(times, wrenches, states)):
        log.wrench(number, time, time, time, wrench)
        log.state(number, time, time, time, *state)
    log.close({"why": "written from a recording"})


def _check(recording: Recording, times: np.ndarray, place: str) -> None:
    if not (np.diff(times) > 0.0).all():
        raise InputError("time", "not increasing", "each sample must be a nanosecond later than the one before", place)
    for quantity in ("depth", "velocity", "force", *_AXES):
        values = recording.axes.get(quantity) if quantity in _AXES else getattr(recording, quantity)
        if values is not None and not np.isfinite(values).all():
            raise InputError(quantity, "not finite", f"at sample {int(np.argmin(np.isfinite(values)))}", place)


def _card(recording: Recording) -> dict[str, str]:
    card = recording.card
    return {
        "needle": card.needle,
        "tissue": card.tissue,
        "rig": card.rig,
        "filter_length": str(card.filter_length),
        "axial": "fz",
        "axes": " ".join(axis for axis in _AXES if axis in recording.axes),
        "start_s": repr(float(recording.time[0])),
        "origin": card.source,
        "origin_sha256": card.sha256,
        "assumptions": json.dumps(card.assumptions),
        "notes": json.dumps([[note.kind, note.message, note.count] for note in recording.notes]),
    }
