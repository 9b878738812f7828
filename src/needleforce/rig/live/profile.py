# SPDX-License-Identifier: Apache-2.0
"""What an axis is told to do: stretches of constant acceleration, from where it is to where it shall be."""

import math
from bisect import bisect_right
from collections.abc import Iterable


class Profile:
    """Depth over time from ``now`` on: ``stretches`` are (length [s], velocity [m/s], acceleration [m/s^2])."""

    def __init__(self, now: float, depth: float, stretches: Iterable[tuple[float, float, float]] = ()):
        self._begins, self._knots = [], []
        for length, velocity, acceleration in (*stretches, (math.inf, 0.0, 0.0)):
            self._begins.append(now)
            self._knots.append((depth, velocity, acceleration))
            if length < math.inf:
                now += length
                depth += velocity * length + 0.5 * acceleration * length**2
        self.end, self.last = now, depth

    def at(self, time: float) -> tuple[float, float]:
        """Depth [m] and velocity [m/s]; at rest before the start and after the end."""
        k = max(bisect_right(self._begins, time) - 1, 0)
        depth, velocity, acceleration = self._knots[k]
        t = max(time - self._begins[k], 0.0)
        return depth + velocity * t + 0.5 * acceleration * t * t, velocity + acceleration * t


def towards(
    depth: float, velocity: float, target: float, speed: float, acceleration: float
) -> Iterable[tuple[float, float, float]]:
    """The stretches of a trapezoid of speed to ``target``; an axis that is on its way elsewhere stops
    first."""
    travel, brake = target - depth, 0.5 * velocity**2 / acceleration
    if velocity and (velocity * travel <= 0.0 or brake > abs(travel)):
        yield abs(velocity) / acceleration, velocity, -math.copysign(acceleration, velocity)
        depth, velocity = depth + math.copysign(brake, velocity), 0.0
        travel = target - depth
    if travel:
        yield from _trapezoid(abs(travel), math.copysign(1.0, travel), abs(velocity), speed, acceleration)


def _trapezoid(travel: float, sign: float, before: float, speed: float, acceleration: float):
    top = min(speed, math.sqrt(travel * acceleration + 0.5 * before**2))
    change = math.copysign(acceleration, top - before)
    cruise = travel - abs(top**2 - before**2) / (2.0 * acceleration) - 0.5 * top**2 / acceleration
    yield abs(top - before) / acceleration, sign * before, sign * change
    yield max(cruise, 0.0) / top, sign * top, 0.0
    yield top / acceleration, sign * top, -sign * acceleration
