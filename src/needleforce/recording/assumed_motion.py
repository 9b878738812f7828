# SPDX-License-Identifier: Apache-2.0
"""Time and depth of a file without a column of them, from a rate, a speed or a step that is known."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError

_LONG_REST = 10.0  # times the usual number of samples between two changes of the depth
_OF_MOTION = ("speed", "step", "stroke", "hold")
COUNTED = "the file has no time: its rows are counted, one a second, and no rate or speed is known"


@dataclass(frozen=True, kw_only=True)
class AssumedMotion:
    """What a user knows of a recording: rate of the samples [Hz], constant speed [m/s], travel between two samples [m],
    depth at which the needle stops [m], time after which it is drawn out again at the same speed [s], and time at which
    it starts to move [s], each None if it is not given; ``counted`` is True if a time is not needed, ``stated`` is what
    the file states of the rate, if it is not given by the user."""

    rate: float | None = None
    speed: float | None = None
    step: float | None = None
    stroke: float | None = None
    hold: float | None = None
    start: float | None = None
    counted: bool = False
    stated: str = ""

    def __post_init__(self):
        """Raise InputError for values that are not above zero."""
        for name, unit in (("rate", "Hz"), ("speed", "m/s"), ("step", "m"), ("stroke", "m")):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                limit = f"a number above 0 {unit} is needed"
                raise InputError(name, value, limit, next_step="Give the value at which it was recorded.")
        if self.hold is not None and not (math.isfinite(self.hold) and self.hold >= 0.0):
            step = "Give the time for which the needle rested at its greatest depth."
            raise InputError("hold", self.hold, "a number of at least 0 s is needed", next_step=step)
        self._check_complete()

    def _check_complete(self) -> None:
        """Raise InputError for a stroke or a hold without what it needs."""
        for name, needs, option in (("hold", "stroke", "--stroke-mm"), ("stroke", "speed", "--speed-mm-s")):
            if getattr(self, name) is not None and getattr(self, needs) is None:
                limit = f"it is used only with a {needs}"
                raise InputError(name, getattr(self, name), limit, next_step=f"Give {option}, too.")
        if self.stroke is not None and self.step is not None:
            limit = "a stroke is that of a motion in time, and a step one of a motion by samples"
            raise InputError("step and stroke", f"{self.step:g} and {self.stroke:g} m", limit,
                             next_step="Give --rate-hz instead of --step-um.")  # fmt: skip

    def gives_time(self, has_depth: bool) -> bool:
        """Whether a time follows without a column of time."""
        return bool(self.rate or self.counted or (self.speed and (has_depth or self.step)))

    def gives_depth(self, has_time: bool) -> bool:
        """Whether a depth follows without a column of depth or velocity."""
        return bool(self.step or (self.speed and (has_time or self.rate)))

    def unused(self, has_time: bool, has_motion: bool) -> str:
        """A sentence on what was given and is not used, because the file has it; empty if all is used."""
        given = [("rate", self.rate is not None and not self.stated and has_time, "time (--decimate-to-hz lowers it)")]
        given += [("speed", self.speed is not None and has_time and has_motion, "time and motion")]
        given += [("step", self.step is not None and has_motion and (has_time or not self.speed), "motion")]
        given += [(name, getattr(self, name) is not None and has_motion, "motion") for name in ("stroke", "hold")]
        given += [("motion shift", self.start is not None and has_motion, "motion")]
        left = [
            f"the {name} that was given is not used, because the file has its own {why}"
            for name, is_, why in given
            if is_
        ]
        return "; ".join(left)

    def without_motion(self, has_source: bool) -> "AssumedMotion":
        """Without those of the motion, if it is in another table."""
        return replace(self, **dict.fromkeys((*_OF_MOTION, "start"))) if has_source else self

    def unused_with_motion(self) -> str:
        """A sentence on what is not used because the motion is in another table; empty for nothing."""
        left = [name for name in _OF_MOTION if getattr(self, name) is not None]
        return (
            f"the {' and the '.join(left)} given: not used, because the motion is in a table of its own" if left else ""
        )

    def completed(self, rate: float, text: str) -> "AssumedMotion":
        """With the rate [Hz] that the file states in ``text``."""
        return replace(self, rate=rate, stated=text)

    def _check_moves(self, time: np.ndarray, moved: np.ndarray) -> None:
        """Raise InputError if the needle does not move within the times of the file."""
        last = math.inf if self.stroke is None or self.hold is None else 2.0 * self.stroke / self.speed + self.hold
        last = self.stroke / self.speed if self.stroke is not None and self.hold is None else last
        if moved[-1] <= 0.0 or moved[0] >= last:
            limit = f"the times of the file are {time[0]:.10g} to {time[-1]:.10g} s, in which the needle does not move"
            step = "Give the time of the file at which it starts to move (--motion-shift-s)."
            raise InputError("motion shift", f"{self.start or 0.0:g} s", limit, next_step=step)

    def time(self, count: int, depth: np.ndarray | None) -> tuple[np.ndarray, str]:
        """(count,) times [s] and what is assumed; ``depth`` [m] if the file has one."""
        rows = np.arange(count, dtype=float)
        if self.rate:
            source = f"as the file states: {self.stated!r}" if self.stated else "as given"
            return rows / self.rate, f"the time is that of {self.rate:g} Hz, {source}"
        if self.speed and depth is None:
            return rows * (self.step / self.speed), "the time follows from the step and the speed given"
        if self.speed:
            sentence = f"the time is that of a constant speed of {1e3 * self.speed:g} mm/s, as given"
            return self._of_travel(depth), sentence + _rests(depth)
        return rows, COUNTED

    def _of_travel(self, depth: np.ndarray) -> np.ndarray:
        """Times of a constant speed; samples without travel between them are taken as evenly spaced."""
        travels = np.abs(np.diff(depth))
        if len(travels) and travels.min() > 0.0:
            return np.concatenate([[0.0], np.cumsum(travels)]) / self.speed
        return np.arange(len(depth)) * (max(travels.mean(), 1e-12) / self.speed)

    def depth(self, time: np.ndarray) -> tuple[np.ndarray, str]:
        """(n,) depths [m] from 0, and what is assumed."""
        if self.step:
            return self.step * np.arange(len(time)), f"depth increases by {1e6 * self.step:g} um a sample, as given"
        moved = np.maximum(time - (time[0] if self.start is None else self.start), 0.0)
        self._check_moves(time, moved)
        begins = "" if self.start is None else f" from {self.start:g} s on"
        sentence = f"depth increases at {1e3 * self.speed:g} mm/s{begins}"
        if self.stroke is None:
            return self.speed * moved, f"{sentence}, as given"
        duration = self.stroke / self.speed
        inserted = self.speed * np.minimum(moved, duration)
        sentence += f", up to {1e3 * self.stroke:g} mm{'' if moved[-1] >= duration else ', which is not reached'}"
        if self.hold is None:
            return inserted, f"{sentence}, and remains there, as given"
        drawn = self.speed * np.clip(moved - duration - self.hold, 0.0, duration)
        return inserted - drawn, f"{sentence}, and after {self.hold:g} s decreases at the same speed, as given"


def _rests(depth: np.ndarray) -> str:
    """What contradicts a constant speed: a rest longer than the resolution of the depth makes of one."""
    moves = np.flatnonzero(np.diff(depth))
    rests = np.diff(np.concatenate([[-1], moves, [len(depth) - 1]])) - 1
    usual = float(np.median(rests[1:-1])) if len(rests) > 2 else 0.0
    if rests.max() <= _LONG_REST * (usual + 1.0):
        return ""
    return f", although the depth rests over {rests.max() + 1} samples: if a rate is known, give it instead (--rate-hz)"
