# SPDX-License-Identifier: Apache-2.0
"""A servo axis of one degree of freedom: what it is told, where its motor is, where the needle is."""

import math

from ...wire.axis_lines import SILENCE, Answer, AxisRange
from .profile import Profile, towards

LIMITS = AxisRange(-30e-3, 70e-3, 50e-3, 10e-3)  # of the travel and the speed; 10 mm/s^2 is Motion's
START = -4e-3  # [m] where it stands when it is switched on, as in the rig simulated at once
STOP_DECELERATION = 1.0  # [m/s^2] of a stop: 3 mm/s end after 3 ms and 4.5 um
LAG = 4e-3  # [s] time constant of the servo: it follows by LAG times the speed (assumed)
PLAY = 10e-6  # [m] of the screw: how far the motor turns back before the needle follows (assumed)


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
        self._profile = Profile(0.0, START)
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
        if time - self._last_heard > SILENCE:
            self.gone(self._last_heard + SILENCE)
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
        self._profile, self._word = Profile(now, self._profile.at(now)[0], stretches), word

    def _why_not(self, depth: float, speed: float) -> str:
        if self.time >= self._stall_at:
            return "the axis is stalled"
        if not LIMITS.lowest <= depth <= LIMITS.highest:
            return f"depth {depth:g} m is outside {LIMITS.lowest:g} to {LIMITS.highest:g} m"
        if not 0.0 < speed <= LIMITS.max_speed:
            return f"speed {speed:g} m/s must be above 0 and at most {LIMITS.max_speed:g} m/s"
        return ""
