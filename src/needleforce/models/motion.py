# SPDX-License-Identifier: Apache-2.0
"""A prescribed motion of the tip along its axis: strokes with a trapezoid of speed, and holds."""

from dataclasses import dataclass

import numpy as np

from ..errors import InputError


@dataclass(frozen=True)
class Motion:
    """Depth over time. ``moves`` are (target depth [m], speed [m/s]); a move to where the tip is waits, its speed a
    time [s].

    ``start`` [m] is the depth at time 0, below 0 above the surface; ``acceleration`` [m/s^2] is the same everywhere.
    """

    start: float
    moves: tuple[tuple[float, float], ...]
    acceleration: float = 10e-3

    def __post_init__(self):
        _check(self.start, 1.0, 1.0, 0.0, self.acceleration)
        for target, speed in self.moves:
            if not -1.0 <= target <= 1.0:
                raise InputError("motion.moves", target, "outside -1 to 1 m")
            if not 0.0 <= speed <= 1e6:
                raise InputError("motion.moves", speed, "not a speed [m/s], or a time to wait [s], from 0 to 1e6")

    @classmethod
    def insert(
        cls,
        start: float,
        speed: float,
        depth: float,
        hold: float = 0.0,
        withdraw: bool = True,
        acceleration: float = 10e-3,
    ) -> "Motion":
        """In from ``start`` to ``depth`` [m] at ``speed`` [m/s], a hold [s], and out again where ``withdraw``."""
        _check(start, speed, depth, hold, acceleration)
        moves = [(depth, speed), (depth, hold)] + ([(start, speed)] if withdraw else [])
        return cls(start, tuple(moves), acceleration)

    @property
    def duration(self) -> float:
        """Time from start to end [s]."""
        return float(self._knots()[0][-1])

    def at(self, time) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and velocity [m/s] at times (n,) [s]; at rest before the start and after the end."""
        begin, depth, velocity, acceleration = self._knots()
        time = np.asarray(time, dtype=float)
        k = np.clip(np.searchsorted(begin, time, side="right") - 1, 0, len(begin) - 1)
        t = np.clip(time - begin[k], 0.0, None)
        return depth[k] + velocity[k] * t + 0.5 * acceleration[k] * t * t, velocity[k] + acceleration[k] * t

    def _knots(self) -> tuple[np.ndarray, ...]:
        """Where each stretch of constant acceleration begins: time, depth, velocity, acceleration."""
        knots, now, here = [], 0.0, self.start
        for target, speed in self.moves:
            for length, velocity, acceleration in self._stretches(here, target, speed):
                knots.append((now, here, velocity, acceleration))
                now += length
                here += velocity * length + 0.5 * acceleration * length**2
            here = target
        knots.append((now, here, 0.0, 0.0))
        return tuple(np.array(column) for column in zip(*knots))

    def _stretches(self, here: float, target: float, speed: float):
        travel, sign = abs(target - here), np.sign(target - here)
        if travel == 0.0:
            return [(speed, 0.0, 0.0)]
        top = min(speed, np.sqrt(travel * self.acceleration))
        ramp, push = top / self.acceleration, sign * self.acceleration
        cruise = travel / top - ramp
        return [(ramp, 0.0, push), (cruise, sign * top, 0.0), (ramp, sign * top, -push)]


def _check(start: float, speed: float, depth: float, hold: float, acceleration: float) -> None:
    limits = [
        ("start", start, -1.0, 1.0, "m"),
        ("depth", depth, np.nextafter(start, 1.0), 1.0, "m"),
        ("speed", speed, 1e-9, 10.0, "m/s"),
        ("acceleration", acceleration, 1e-9, 1e4, "m/s^2"),
        ("hold", hold, 0.0, 1e6, "s"),
    ]
    for quantity, value, low, high, unit in limits:
        if not low <= value <= high:
            raise InputError(f"motion.{quantity}", value, f"outside {low:.6g} to {high:g} {unit}")
