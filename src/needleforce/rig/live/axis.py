# SPDX-License-Identifier: Apache-2.0
"""A servo axis of one degree of freedom: its motion of constant accelerations, its motor and needle, and the states
that its encoder reports."""

import math
from bisect import bisect_right
from collections.abc import Iterable

import numpy as np

from ...wire.axis_lines import MAX_SILENCE_S, STATE_RATE_HZ, Answer, AxisRange, AxisState
from ..run import SpeedClock

LIMITS = AxisRange(-30e-3, 70e-3, 50e-3, 10e-3)  # of the travel and the speed; 10 mm/s^2 is Motion's
START = -4e-3  # [m] where it stands when it is switched on, as in the rig simulated at once
STOP_DECELERATION = 1.0  # [m/s^2] of a stop: 3 mm/s end after 3 ms and 4.5 um
LAG = 4e-3  # [s] time constant of the servo: it follows by LAG times the speed (assumed)
PLAY = 10e-6  # [m] of the screw: how far the motor turns back before the needle follows (assumed)
STEP = 0.5e-6  # [m] of the encoder, on the motor: play is not in what it reports (assumed)
_SPEED = SpeedClock()


class Axis:
    """Rests at ``START``. ``motor`` and ``needle`` are depths [m] at the last ``tick``, + inwards.

    The motor follows the commanded depth as a first-order servo; the needle is on the motor while that pushes it in,
    and ``PLAY`` deeper than it while it is pulled out. ``stall_at`` [s]: from then on the motor stands, whatever it is
    told.
    """

    def __init__(self, stall_at: float = math.inf):
        self.motor = self.needle = START
        self.time, self.speed = 0.0, 0.0  # [m/s] the motor's, over the last tick
        self._stall_at = stall_at
        self._profile = MotionProfile(0.0, START)
        self._commanded, self._word = START, "moving"
        self._last_heard = math.inf  # no client, nothing to wait for

    @property
    def condition(self) -> str:
        """One of the words of the axis' states."""
        if self.time >= self._stall_at:
            return "stalled"
        arrived = self.time >= self._profile.end and abs(self._profile.last - self.motor) < 1e-6
        return "idle" if arrived else self._word

    def move(self, now: float, depth: float, speed: float) -> Answer:
        """Set off to ``depth`` [m] at ``speed`` [m/s]; refused, with the reason, where it cannot be."""
        reason = self._why_not(depth, speed)
        if reason:
            return Answer("move", False, reason)
        here, velocity = self._profile.at(now)
        self._set_off(now, towards(here, velocity, depth, speed, LIMITS.max_acceleration), "moving")
        return Answer("move", True)

    def stop(self, now: float) -> Answer:
        """Come to rest at ``STOP_DECELERATION``."""
        velocity = self._profile.at(now)[1]
        if velocity:
            slower = -math.copysign(STOP_DECELERATION, velocity)
            self._set_off(now, [(abs(velocity) / STOP_DECELERATION, velocity, slower)], "stopping")
        return Answer("stop", True)

    def heard(self, now: float) -> None:
        """A client said something, or connected."""
        self._last_heard = now

    def gone(self, now: float) -> None:
        """The client went away: nobody is left who could stop the axis."""
        self._last_heard = math.inf
        self.stop(now)

    def tick(self, time: float) -> None:
        """Go on to ``time`` [s]; exact for a commanded speed that stays the same in between."""
        if time - self._last_heard > MAX_SILENCE_S:
            self.gone(self._last_heard + MAX_SILENCE_S)
        length, self.time = time - self.time, time
        commanded = self._profile.at(time)[0]
        if time < self._stall_at and length > 0.0:
            before, faded = self.motor, math.exp(-length / LAG)
            lag = (self._commanded - before) * faded + (commanded - self._commanded) / length * LAG * (1.0 - faded)
            self.motor = commanded - lag
            self.speed = (self.motor - before) / length
        elif length > 0.0:
            self.speed = 0.0
        self._commanded = commanded
        self.needle = min(max(self.needle, self.motor), self.motor + PLAY)

    def _set_off(self, now: float, stretches, word: str) -> None:
        self._profile, self._word = MotionProfile(now, self._profile.at(now)[0], stretches), word

    def _why_not(self, depth: float, speed: float) -> str:
        if self.time >= self._stall_at:
            return "the axis is stalled"
        if not LIMITS.lowest <= depth <= LIMITS.highest:
            return f"depth {depth:g} m is outside {LIMITS.lowest:g} to {LIMITS.highest:g} m"
        if not 0.0 < speed <= LIMITS.max_speed:
            return f"speed {speed:g} m/s must be above 0 and at most {LIMITS.max_speed:g} m/s"
        return ""


class MotionProfile:
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


class Encoder:
    """``drift`` [1]: how much faster its clock runs than the rig's; ``offset`` [s]: what it showed at the start."""

    def __init__(self, axis: Axis, random: np.random.Generator, drift: float = 0.0, offset: float = 0.0):
        self._axis, self._random, self._rate, self._offset = axis, random, STATE_RATE_HZ * (1.0 + drift), offset
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
            self._number,
            self._offset + self._number / STATE_RATE_HZ,
            round(depth / STEP) * STEP,
            speed,
            self._axis.condition,
        )
