# SPDX-License-Identifier: Apache-2.0
"""Time and depth of a file without a column of them, from a rate, a speed or a step that is known."""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..errors import InputError

_LONG_REST = 10.0  # times the usual number of samples between two changes of the depth
COUNTED = "the file has no time: its rows are counted, one a second, and no rate or speed is known"


@dataclass(frozen=True, kw_only=True)
class AssumedMotion:
    """What a user knows of a recording: rate of the samples [Hz], constant speed [m/s], travel between two samples [m],
    each None if it is not given; ``counted`` is True if a time is not needed, ``stated`` is what the file states of the
    rate, if it is not given by the user."""

    rate: float | None = None
    speed: float | None = None
    step: float | None = None
    counted: bool = False
    stated: str = ""

    def __post_init__(self):
        """Raise InputError for values that are not above zero."""
        for name, value, unit in (("rate", self.rate, "Hz"), ("speed", self.speed, "m/s"), ("step", self.step, "m")):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                limit = f"a number above 0 {unit} is needed"
                raise InputError(name, value, limit, next_step="Give the value at which it was recorded.")

    def gives_time(self, has_depth: bool) -> bool:
        """Whether a time follows without a column of time."""
        return bool(self.rate or self.counted or (self.speed and (has_depth or self.step)))

    def gives_depth(self, has_time: bool) -> bool:
        """Whether a depth follows without a column of depth or velocity."""
        return bool(self.step or (self.speed and (has_time or self.rate)))

    def unused(self, has_time: bool, has_motion: bool) -> str:
        """A sentence on what was given and is not used, because the file has it; empty if all is used."""
        given = [("rate", self.rate is not None and not self.stated and has_time, "time")]
        given += [("speed", self.speed is not None and has_time and has_motion, "time and motion")]
        given += [("step", self.step is not None and has_motion and (has_time or not self.speed), "motion")]
        left = [
            f"the {name} that was given is not used, because the file has its own {why}"
            for name, is_, why in given
            if is_
        ]
        return "; ".join(left)

    def without_motion(self, has_source: bool) -> "AssumedMotion":
        """Without speed and step, if the motion is in another table."""
        return replace(self, speed=None, step=None) if has_source else self

    def unused_with_motion(self) -> str:
        """A sentence on what is not used because the motion is in another table; empty for nothing."""
        left = [name for name, value in (("speed", self.speed), ("step", self.step)) if value is not None]
        return (
            f"the {' and the '.join(left)} given: not used, because the motion is in a table of its own" if left else ""
        )

    def completed(self, rate: float, text: str) -> "AssumedMotion":
        """With the rate [Hz] that the file states in ``text``."""
        return replace(self, rate=rate, stated=text)

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
        return self.speed * (time - time[0]), f"depth increases at {1e3 * self.speed:g} mm/s, as given"


def _rests(depth: np.ndarray) -> str:
    """What contradicts a constant speed: a rest longer than the resolution of the depth makes of one."""
    moves = np.flatnonzero(np.diff(depth))
    rests = np.diff(np.concatenate([[-1], moves, [len(depth) - 1]])) - 1
    usual = float(np.median(rests[1:-1])) if len(rests) > 2 else 0.0
    if rests.max() <= _LONG_REST * (usual + 1.0):
        return ""
    return f", although the depth rests over {rests.max() + 1} samples: if a rate is known, give it instead (--rate-hz)"
