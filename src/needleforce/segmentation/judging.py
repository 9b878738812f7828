# SPDX-License-Identifier: Apache-2.0
"""What can be said of a recording: whether it can be read, whether it is whole, and what was doubtful."""

import math
from numbers import Integral

import numpy as np

from ..errors import InputError
from ..recording.force_signal import glitches, spikes
from ..vocabulary import Status
from .insertion import Insertion
from .leaving import SAME_BASELINE

NO_PULL = "The needle is out, but no pull on the way shows where it left the tissue: there is no exit."
STUCK = "The needle is back at the contact depth, but the force is not at its baseline: no exit is found."
CUT_OFF = "The withdrawal ends below the contact depth: the recording is cut off."
FURTHEST = 1.0  # [m] no rupture takes longer


def check(crossing: float, drop: float, within: float, cycle: int) -> None:
    """Raise InputError for options of ``segment`` that are out of range."""
    for name, value, low, high in (
        ("crossing", crossing, 0.0, math.inf), ("drop", drop, 0.0, 1.0), ("within", within, 0.0, FURTHEST)
    ):  # fmt: skip
        if not (isinstance(value, (int, float, np.number)) and low <= value <= high):
            raise InputError(name, repr(value), f"a number from {low:g} to {high:g} is needed", "segment")
    if not isinstance(cycle, Integral) or cycle < 0:
        raise InputError(
            "cycle", repr(cycle), "a whole number from 0 is needed", "segment", "0 is the first insertion."
        )


def unreadable(time: np.ndarray, depth: np.ndarray, force: np.ndarray) -> str:
    """Why (n,) time, depth and force make no recording; empty if they do."""
    if not all(np.isfinite(values).all() for values in (time, depth, force)):
        return "The recording holds values that are not finite."
    return "" if (np.diff(time) > 0.0).all() else "The time does not increase from sample to sample."


def no_contact(time: np.ndarray, force: np.ndarray, moved: bool) -> str:
    """Why there is no contact: the needle did not move, or the force tells none."""
    if not moved:
        return "The depth never moves inwards."
    found = glitches(force)
    if not len(found):
        return "The force never leaves its baseline."
    return f"No contact is seen beside a glitch: {spikes(time, force, found)}. Remove such samples and try again."


def judge(chosen: Insertion, count: int, depth: np.ndarray, force: np.ndarray) -> tuple[Status, tuple[str, ...]]:
    """The status of one of ``count`` insertions in (n,) depth and force, and what its reader should know."""
    notes = [] if chosen.free else ["There is hardly any free travel before the contact: its depth is doubtful."]
    if count > 1:
        notes.append(f"There are {count} insertions; the events are those of one of them.")
    if not chosen.punctures:
        notes.append("There is no puncture.")
    complete = Status.ok if chosen.punctures else Status.no_puncture
    if chosen.exit is not None:
        return complete, tuple(notes)
    missing = _no_exit(chosen, depth, force)
    return (complete if missing == NO_PULL else Status.incomplete), (*notes, missing)


def _no_exit(chosen: Insertion, depth: np.ndarray, force: np.ndarray) -> str:
    """Why there is no exit: no withdrawal, or one cut off, or none that shows in the force."""
    cycle, contact = chosen.cycle, chosen.contact
    if not cycle.withdrawn:
        return "There is no withdrawal: the recording is cut off."
    back = np.flatnonzero(depth[cycle.leave : cycle.end] <= contact.depth)
    if not len(back):
        return CUT_OFF
    change = abs(float(np.median(force[cycle.leave + back])) - chosen.baseline)
    peak = float(np.max(np.abs(force[cycle.start : cycle.stop] - chosen.baseline)))
    return NO_PULL if change <= max(5.0 * chosen.noise, SAME_BASELINE * peak) else STUCK
