# SPDX-License-Identifier: Apache-2.0
"""Depths that come in lines, in the place of an axis."""

from collections import deque

import numpy as np

from ...errors import InputError
from ...wire.axis_lines import AxisState

_SECOND = 1e9  # [ns]


class LineAxis:
    """The depth and velocity of the lines as the states of an axis that nobody here commands."""

    limits = None

    def __init__(self):
        self._states: deque[tuple[AxisState, int]] = deque()
        self._number, self._last = 0, None

    def take(self, others: dict[str, np.ndarray], time_ns: list[int], now: int) -> None:
        """Keep what the lines say, (n,) [m] and [m/s], at ``time_ns``; without velocity it is the change of depth."""
        depth, seconds = others["depth"], np.array(time_ns) / _SECOND
        before = self._last or (seconds[0], depth[0])
        steps = np.diff(seconds, prepend=before[0])
        changes = np.divide(np.diff(depth, prepend=before[1]), steps, out=np.zeros(len(depth)), where=steps > 0.0)
        velocity = others.get("velocity", changes)
        self._last = seconds[-1], depth[-1]
        for at, place, speed in zip(seconds.tolist(), depth.tolist(), velocity.tolist()):
            state = AxisState(self._number, at, place, speed, "moving" if speed else "idle")
            self._states.append((state, now))
            self._number += 1

    def receive(self) -> list[tuple[AxisState, int]]:
        """The states since the last call, each with its arrival [ns]."""
        states = list(self._states)
        self._states.clear()
        return states

    def move(self, depth: float, speed: float) -> None:
        """Refused: the program that writes the lines moves the needle, or nobody does."""
        raise InputError("move", f"to {depth:g} m", "standard input takes no commands", next_step="Use --axis.")

    def site(self, number: int) -> None:
        """Refused, as ``move``."""
        raise InputError("site", number, "standard input takes no commands", next_step="Use --axis.")

    def alive(self) -> None:
        """Nothing waits for it."""

    def send_stop(self) -> None:
        """Nothing can be stopped."""

    def stop(self) -> bool:
        """Nothing was stopped."""
        return False

    def close(self) -> None:
        """Nothing is held."""
