# SPDX-License-Identifier: Apache-2.0
"""A servo axis with one degree of freedom: profiles of constant acceleration, motor and needle, and the states that its
encoder reports."""

import math
from bisect import bisect_right
from collections.abc import Iterable

import numpy as np

from ...wire.axis_lines import MAX_SILENCE_S, STATE_RATE_HZ, Answer, AxisRange, AxisState
from ..run import SpeedClock

LIMITS = AxisRange(-30e-3, 70e-3, 50e-3, 10e-3, 1.0)  # 10 mm/s^2 is the acceleration of Motion
START = -4e-3  # [m] at power-on, as in the simulated experiment
SERVO_LAG_S = 4e-3  # time constant of the servo: the position error is this times the speed (assumed)
BACKLASH_M = 10e-6  # of the screw: travel of the motor at a reversal before the needle follows (assumed)
ENCODER_STEP_M = 0.5e-6  # of the encoder on the motor, which does not measure the backlash (assumed)
_SPEED = SpeedClock()


class Axis:
    """An axis that rests at ``START``; ``motor`` and ``needle`` are depths [m] at the last ``tick``, + inwards.

    The motor follows the commanded depth as a first-order servo. The needle is at the motor's depth during insertion,
    and ``BACKLASH_M`` deeper during withdrawal. From ``stall_at`` [s] on the motor does not move.
    """

    def __init__(self, stall_at: float = math.inf):
        self.motor = self.needle = START
        self.time, self.speed = 0.0, 0.0  # [m/s] the motor's, over the last tick
        self._stall_at = stall_at
        self._profile = MotionProfile(0.0, START)
        self._commanded, self._moving_condition = START, "moving"
        self._last_contact = math.inf  # without a client there is no timeout

    @property
    def condition(self) -> str:
        """The condition for the axis' states, one of ``CONDITIONS``."""
        if self.time >= self._stall_at:
            return "stalled"
        arrived = self.time >= self._profile.end and abs(self._profile.last - self.motor) < 1e-6
        return "idle" if arrived else self._moving_condition

    def move(self, now: float, depth: float, speed: float) -> Answer:
        """Move to ``depth`` [m] at ``speed`` [m/s]; refused, with the reason, if that is impossible."""
        reason = self._refusal(depth, speed)
        if reason:
            return Answer("move", False, reason)
        here, velocity = self._profile.at(now)
        self._follow(now, towards(here, velocity, depth, speed, LIMITS.max_acceleration), "moving")
        return Answer("move", True)

    def stop(self, now: float) -> Answer:
        """Decelerate to rest at the deceleration of a stop, from 3 mm/s within 3 ms and 4.5 um."""
        velocity = self._profile.at(now)[1]
        if velocity:
            duration = abs(velocity) / LIMITS.stop_deceleration
            self._follow(now, [(duration, velocity, -velocity / duration)], "stopping")
        return Answer("stop", True)

    def client_active(self, now: float) -> None:
        """The client sent a line or connected at ``now`` [s]."""
        self._last_contact = now

    def client_lost(self, now: float) -> None:
        """The client disconnected: stop, as no client can stop the axis any more."""
        self._last_contact = math.inf
        self.stop(now)

    def tick(self, time: float) -> None:
        """Advance to ``time`` [s]; exact if the commanded speed is constant in between."""
        if time - self._last_contact > MAX_SILENCE_S:
            self.client_lost(self._last_contact + MAX_SILENCE_S)
        length, self.time = time - self.time, time
        commanded = self._profile.at(time)[0]
        if time < self._stall_at and length > 0.0:
            before, decay = self.motor, math.exp(-length / SERVO_LAG_S)
            speed = (commanded - self._commanded) / length
            lag = (self._commanded - before) * decay + speed * SERVO_LAG_S * (1.0 - decay)
            self.motor = commanded - lag
            self.speed = (self.motor - before) / length
        elif length > 0.0:
            self.speed = 0.0
        self._commanded = commanded
        self.needle = min(max(self.needle, self.motor), self.motor + BACKLASH_M)

    def _follow(self, now: float, segments: Iterable[tuple[float, float, float]], condition: str) -> None:
        self._profile = MotionProfile(now, self._profile.at(now)[0], segments)
        self._moving_condition = condition

    def _refusal(self, depth: float, speed: float) -> str:
        if self.time >= self._stall_at:
            return "the axis is stalled"
        if not LIMITS.lowest <= depth <= LIMITS.highest:
            return f"depth {depth:g} m is outside {LIMITS.lowest:g} to {LIMITS.highest:g} m"
        if not 0.0 < speed <= LIMITS.max_speed:
            return f"speed {speed:g} m/s must be above 0 and at most {LIMITS.max_speed:g} m/s"
        return ""


class MotionProfile:
    """Depth over time from ``now`` on: ``segments`` are (duration [s], velocity [m/s], acceleration [m/s^2])."""

    def __init__(self, now: float, depth: float, segments: Iterable[tuple[float, float, float]] = ()):
        self._starts, self._knots = [], []
        for length, velocity, acceleration in (*segments, (math.inf, 0.0, 0.0)):
            self._starts.append(now)
            self._knots.append((depth, velocity, acceleration))
            if length < math.inf:
                now += length
                depth += velocity * length + 0.5 * acceleration * length**2
        self.end, self.last = now, depth

    def at(self, time: float) -> tuple[float, float]:
        """Depth [m] and velocity [m/s]; at rest before the start and after the end."""
        k = max(bisect_right(self._starts, time) - 1, 0)
        depth, velocity, acceleration = self._knots[k]
        t = max(time - self._starts[k], 0.0)
        return depth + velocity * t + 0.5 * acceleration * t * t, velocity + acceleration * t


def towards(
    depth: float, velocity: float, target: float, speed: float, acceleration: float
) -> Iterable[tuple[float, float, float]]:
    """The segments of a trapezoidal velocity profile to ``target``; an axis that moves away from it first stops."""
    travel, brake = target - depth, 0.5 * velocity**2 / acceleration
    if velocity and (velocity * travel <= 0.0 or brake > abs(travel)):
        yield abs(velocity) / acceleration, velocity, -math.copysign(acceleration, velocity)
        depth, velocity = depth + math.copysign(brake, velocity), 0.0
        travel = target - depth
    if travel:
        yield from _trapezoid(abs(travel), math.copysign(1.0, travel), abs(velocity), speed, acceleration)


def _trapezoid(
    travel: float, sign: float, before: float, speed: float, acceleration: float
) -> Iterable[tuple[float, float, float]]:
    """Three segments over ``travel`` [m] that begin at the speed ``before`` [m/s] and end at rest."""
    top = min(speed, math.sqrt(travel * acceleration + 0.5 * before**2))
    change = math.copysign(acceleration, top - before)
    cruise = travel - abs(top**2 - before**2) / (2.0 * acceleration) - 0.5 * top**2 / acceleration
    yield abs(top - before) / acceleration, sign * before, sign * change
    yield max(cruise, 0.0) / top, sign * top, 0.0
    yield top / acceleration, sign * top, -sign * acceleration


class Encoder:
    """Encoder of the axis; ``drift`` [1] is the rate error of its clock, ``offset`` [s] its time at the start."""

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
            round(depth / ENCODER_STEP_M) * ENCODER_STEP_M,
            speed,
            self._axis.condition,
        )
