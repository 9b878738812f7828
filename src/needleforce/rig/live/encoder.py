# SPDX-License-Identifier: Apache-2.0
"""The axis' states as its drive reports them: at their own rate, on a clock of their own, in steps of the encoder."""

import numpy as np

from ...wire.axis_lines import RATE, AxisState
from ..clocks import SpeedClock
from .axis import Axis

STEP = 0.5e-6  # [m] of the encoder, on the motor: play is not in what it reports (assumed)
_SPEED = SpeedClock()


class Encoder:
    """``drift`` [1]: how much faster its clock runs than the rig's; ``offset`` [s]: what it showed at the start."""

    def __init__(self, axis: Axis, random: np.random.Generator, drift: float = 0.0, offset: float = 0.0):
        self._axis, self._random, self._rate, self._offset = axis, random, RATE * (1.0 + drift), offset
        self._number, self._before = 0, (axis.time, axis.motor)

    def states(self) -> list[AxisState]:
        """The states due since the axis' last tick."""
        due = []
        while (time := self._number / self._rate) <= self._axis.time:
            due.append(self._state(time))
            self._number += 1
        self._before = self._axis.time, self._axis.motor
        return due

    def _state(self, time: float) -> AxisState:
        since, depth = self._before
        if self._axis.time > since:
            depth += (self._axis.motor - depth) * (time - since) / (self._axis.time - since)
        speed = self._axis.speed + self._random.normal(0.0, _SPEED.noise)
        speed = round(speed / _SPEED.resolution) * _SPEED.resolution
        return AxisState(
            self._number, self._offset + self._number / RATE, round(depth / STEP) * STEP, speed, self._axis.condition
        )
