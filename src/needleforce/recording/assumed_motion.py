# SPDX-License-Identifier: Apache-2.0
"""Time and depth of a file that lacks them, from a rate, a speed or a step that the user states."""

import math
from dataclasses import dataclass

import numpy as np

from ..errors import InputError

COUNTED = "the file has no time: its rows are counted, one a second, and no rate or speed is known"


@dataclass(frozen=True, kw_only=True)
class AssumedMotion:
    """What a user knows of a recording: rate of the samples [Hz], constant speed [m/s], travel between two samples [m],
    each None if it is not given; ``counted`` is True if a time is not needed."""

    rate: float | None = None
    speed: float | None = None
    step: float | None = None
    counted: bool = False

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

    def time(self, count: int, depth: np.ndarray | None) -> tuple[np.ndarray, str]:
        """(count,) times [s] and what is assumed; ``depth`` [m] if the file has one."""
        rows = np.arange(count, dtype=float)
        if self.rate:
            return rows / self.rate, f"the samples are {self.rate:g} Hz apart, as given"
        if self.speed and depth is None:
            return rows * (self.step / self.speed), "the time follows from the step and the speed given"
        if self.speed:
            return self._of_travel(
                depth
            ), f"the time is that of a constant speed of {1e3 * self.speed:g} mm/s, as given"
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
