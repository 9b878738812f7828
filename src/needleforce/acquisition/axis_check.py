# SPDX-License-Identifier: Apache-2.0
"""The depths that an axis reports, compared with its orders, with what it declared, and, after a stop, with rest.

No word of the axis is believed: neither its condition nor its velocity decides whether it moves, only its depth over
the time of arrival on this computer.
"""

import math
from collections import deque
from typing import NamedTuple

from ..errors import InputError
from ..wire.axis_lines import AxisRange, AxisState

POSITION_TOLERANCE_M = 0.25e-3  # lag and backlash of a spindle
MAX_DEVIATION_M = 1e-3  # outside the commanded and the declared range
REACTION_TIME_S = 0.1  # after which a stop takes effect at the latest: command, servo, and the report of it
REST_WINDOW_S = 0.25  # in which the depth of an axis at rest does not change
_MAX_REST_WINDOW_S = 5.0  # of a slow axis
_REST_SPREAD_M = 10e-6  # of the depth at rest, unless the encoder's own spread is larger
_MAX_SPREAD_AT_START_M = 200e-6
_MIN_DRIFT_M = 1e-6  # that can be seen between the halves of the window, and as a share of the spread
_MAX_DRIFT_SHARE = 0.35
_MIN_TRAVEL_M = 20e-6  # of an axis that continues, in the window
_MOVED_M = 50e-6  # after rest: it has started again
_MIN_REST_STATES, _MAX_REST_STATES = 3, 100
_MAX_DELAY_S = 0.25  # by which states may arrive late
_MAX_SPEED_RATIO = 1.05  # of the commanded speed
_VELOCITY_NOISE_M_S = 5e-3  # of a reported velocity
# what a needle axis may declare: depths [m], speed [m/s], acceleration [m/s^2]
_MAX_DEPTH, _MAX_SPEED, _ACCELERATIONS = 2.0, 2.0, (1e-3, 1e3)


class StopReport(NamedTuple):
    """What an axis did after it was ordered to stop, by its own depth.

    ``at_rest`` is whether its depth is seen at rest, ``beyond`` whether it was seen farther than ``allowed`` [m] from
    where the stop was ordered. ``distance`` [m] and ``seconds`` are from there to the last state, ``depth`` [m] and
    ``speed`` [m/s] those last seen; NaN without a state.
    """

    at_rest: bool
    beyond: bool
    allowed: float
    distance: float
    seconds: float
    depth: float
    speed: float

    @property
    def confirmed(self) -> bool:
        """Whether the axis stopped as it must."""
        return self.at_rest and not self.beyond

    def __str__(self) -> str:
        """One sentence, with depths in mm."""
        there = f"{1e3 * self.depth:.3f} mm, {1e3 * self.distance:.3f} mm and {self.seconds:.2f} s after the stop"
        if math.isnan(self.depth):
            return "ordered to stop, not seen since; switch the axis off"
        if self.confirmed:
            return f"at rest at {there}"
        allowed = f"at most {1e3 * self.allowed:.3f} mm were expected"
        if self.at_rest:
            return f"ordered to stop, did not in time: at rest at {there}; {allowed}"
        if self.beyond:
            moving = f"at {1e3 * self.speed:.3g} mm/s"
            return f"ordered to stop, did not; last seen at {there}, {moving}; {allowed}; switch the axis off"
        return f"ordered to stop, not seen at rest; last seen at {there}; switch the axis off"


def stop_distance(limits: AxisRange, speed: float) -> float:
    """The distance [m] within which an axis that was ordered to move at ``speed`` [m/s] must rest after a stop, from
    what it declares and the speed that it may have."""
    top = top_speed(limits, speed)
    return top * REACTION_TIME_S + top**2 / (2.0 * limits.deceleration) + POSITION_TOLERANCE_M


def top_speed(limits: AxisRange, speed: float) -> float:
    """The largest speed [m/s] of an axis that was ordered to move at ``speed``, at which a stop begins."""
    return min(_MAX_SPEED_RATIO * speed, limits.max_speed)


def check_declared(limits: AxisRange, place: str = "axis") -> None:
    """Raise InputError for a declared range that no needle axis has: nothing could be judged by it."""
    low, high, speed = limits[:3]
    declared = [
        ("lowest depth", low, -_MAX_DEPTH, _MAX_DEPTH, "m"),
        ("highest depth", high, -_MAX_DEPTH, _MAX_DEPTH, "m"),
        ("maximum speed", speed, 0.0, _MAX_SPEED, "m/s"),
        ("maximum acceleration", limits.max_acceleration, *_ACCELERATIONS, "m/s^2"),
        ("deceleration of a stop", limits.deceleration, *_ACCELERATIONS, "m/s^2"),
    ]
    for quantity, value, smallest, largest, unit in declared:
        if not smallest <= value <= largest:
            limit = f"a needle axis declares {smallest:g} to {largest:g} {unit}"
            advice = "Check the units of the axis: its lines are in m and s."
            raise InputError(f"declared {quantity}", f"{value:g} {unit}", limit, place, advice)


class AxisCheck:
    """Checks each state of an axis with the declared ``limits``; ``fault`` is the first contradiction, in words.

    Times [s] are on this computer's clock, as of the states' arrival. Report every order with ``order_move`` and
    ``order_stop``, every state with ``add``.
    """

    def __init__(self, limits: AxisRange):
        self.fault = ""
        self.state: AxisState | None = None  # the newest one
        self.time = 0.0  # its arrival
        self._limits = limits
        self._recent: deque[tuple[float, float]] = deque()  # arrivals and depths over REST_WINDOW_S
        self.spread = 0.0  # [m] of the depth at rest before the first order
        self._spread = _REST_SPREAD_M
        self._target: float | None = None  # None until the axis was seen at rest
        self._range = (-math.inf, math.inf)
        self._speed = 0.0  # ordered
        self._excess = [0.0, 0.0]  # travel beyond it, inwards and outwards
        self._smallest_delay, self._delay = math.inf, 0.0  # of arrivals after the axis' own time
        self._rest_depth: float | None = None  # after the stop
        self._stop: tuple[float, float, float] | None = None  # time of the order, depth seen last, and its age then
        self._beyond = False

    @property
    def at_rest(self) -> bool:
        """Whether the depth stayed the same over the last ``REST_WINDOW_S``, since the stop if one was ordered."""
        spread, drift, limit = self._scatter(self._stop[0] if self._stop else 0.0)
        return spread <= self._spread and drift <= limit

    @property
    def stop_time(self) -> float:
        """The time [s] after the order of a stop until which the axis must be seen at rest."""
        return REACTION_TIME_S + self.top_speed / self._limits.deceleration + self._window + 2.0 * _MAX_DELAY_S

    @property
    def _window(self) -> float:
        """The time [s] over which rest is judged: an axis that continues at its ordered speed moves visibly in it."""
        slow = _MIN_TRAVEL_M / self._speed if self._speed else 0.0
        return min(max(REST_WINDOW_S, slow), _MAX_REST_WINDOW_S)

    @property
    def top_speed(self) -> float:
        """The largest speed [m/s] that was ordered last, and at which a stop begins."""
        return top_speed(self._limits, self._speed)

    @property
    def measured_speed(self) -> float:
        """The speed [m/s] over the last ``REST_WINDOW_S``, from depths and arrivals."""
        if len(self._recent) < 2 or self.time <= self._recent[0][0]:
            return 0.0
        return abs(self._recent[-1][1] - self._recent[0][1]) / (self.time - self._recent[0][0])

    def begin(self) -> bool:
        """Take the present depth as that of rest, and its spread as the encoder's; False while the axis still moves."""
        spread, drift, limit = self._scatter(0.0)
        if spread > _MAX_SPREAD_AT_START_M or drift > limit:
            return False
        self.spread, self._spread = spread, max(_REST_SPREAD_M, 2.0 * spread)
        self._target = self.state.depth
        self._allow(self._target, self._target)
        return True

    def order_move(self, depth: float, speed: float) -> None:
        """A move to ``depth`` [m] at ``speed`` [m/s] is ordered."""
        start = self.state.depth if self._target is None and self.state else self._target
        self._allow(depth if start is None else start, depth)
        self._target, self._speed, self._excess = depth, speed, [0.0, 0.0]

    def order_stop(self, now: float) -> None:
        """A stop is ordered at ``now`` [s]; the first one counts."""
        if self._stop is None:
            depth = self.state.depth if self.state else math.nan
            self._stop = now, depth, max(0.0, now - self.time) + self._delay

    def add(self, state: AxisState, arrival: float) -> bool:
        """Check a state that arrived at ``arrival`` [s]; False for one that is not new, which is no sign of life."""
        before, before_time = self.state, self.time
        if before and state.number == before.number:
            return False
        if before and state.number < before.number:
            self._note(f"its state counter fell from {before.number} to {state.number}: it restarted")
        self.state, self.time = state, arrival
        if not self._recent or arrival - self._recent[-1][0] >= self._window / _MAX_REST_STATES:
            self._recent.append((arrival, state.depth))
        self._smallest_delay = min(self._smallest_delay, arrival - state.time)
        self._delay = min(max(0.0, arrival - state.time - self._smallest_delay), _MAX_DELAY_S)
        while len(self._recent) > _MIN_REST_STATES and self._recent[1][0] <= arrival - self._window:
            self._recent.popleft()
        self._check_declared(state)
        if self._stop is not None:
            self._check_stop(arrival)
        elif self._target is not None:
            self._check_range(state.depth)
            if before:
                self._check_speed(state.depth - before.depth, max(0.0, arrival - before_time))
        return True

    def stop_report(self) -> StopReport:
        """What the axis did since the stop was ordered."""
        ordered, start, _ = self._stop
        late = self.time > ordered + self.stop_time and not self.at_rest
        depth = self.state.depth if self.state else math.nan
        return StopReport(
            at_rest=self.at_rest,
            beyond=self._beyond or late,
            allowed=stop_distance(self._limits, self._speed),
            distance=abs(depth - start),
            seconds=max(0.0, self.time - ordered),
            depth=depth,
            speed=self.measured_speed,
        )

    def _scatter(self, start: float) -> tuple[float, float, float]:
        """Spread [m] of the depths that arrived after ``start`` [s], their drift between the halves of the window, and
        the drift that noise of this spread explains. All infinite for less than the window."""
        recent = [each for each in self._recent if each[0] >= start]
        if len(recent) < _MIN_REST_STATES or recent[-1][0] - recent[0][0] < 0.8 * self._window:
            return math.inf, math.inf, 0.0
        depths, half = [depth for _, depth in recent], len(recent) // 2
        spread = max(depths) - min(depths)
        drift = abs(sum(depths[-half:]) - sum(depths[:half])) / half
        return spread, drift, max(_MIN_DRIFT_M, min(_MAX_DRIFT_SHARE, half**-0.5) * spread)

    def _allow(self, start: float, depth: float) -> None:
        self._range = min(start, depth) - MAX_DEVIATION_M, max(start, depth) + MAX_DEVIATION_M

    def _note(self, fault: str) -> None:
        self.fault = self.fault or fault

    def _check_declared(self, state: AxisState) -> None:
        low, high, max_speed = self._limits[:3]
        if not low - MAX_DEVIATION_M <= state.depth <= high + MAX_DEVIATION_M:
            declared = f"{1e3 * low:.3f} to {1e3 * high:.3f} mm"
            self._note(f"at {1e3 * state.depth:.3f} mm, outside the range that it declares, {declared}")
        if abs(state.velocity) > 2.0 * max_speed + _VELOCITY_NOISE_M_S:
            declared = f"{1e3 * max_speed:g} mm/s is its declared maximum: check its units"
            self._note(f"reports {1e3 * state.velocity:g} mm/s at {1e3 * state.depth:.3f} mm, {declared}")

    def _check_range(self, depth: float) -> None:
        low, high = self._range
        if not low <= depth <= high:
            commanded = f"{1e3 * low:.3f} to {1e3 * high:.3f} mm"
            self._note(f"at {1e3 * depth:.3f} mm, outside the commanded range {commanded}")
        if abs(depth - self._target) <= POSITION_TOLERANCE_M:
            self._allow(self._target, self._target)  # it has arrived, and must stay

    def _check_speed(self, travel: float, seconds: float) -> None:
        """The travel beyond the ordered speed, each way, which lateness of the states explains up to a limit."""
        allowed = _MAX_SPEED_RATIO * self._speed
        for k, sign in enumerate((1.0, -1.0)):
            self._excess[k] = max(0.0, self._excess[k] + sign * travel - allowed * seconds)
        if max(self._excess) > POSITION_TOLERANCE_M + allowed * _MAX_DELAY_S:
            measured = f"{1e3 * self.measured_speed:.3g} mm/s at {1e3 * self.state.depth:.3f} mm"
            self._note(f"moves at {measured}, {1e3 * self._speed:g} mm/s was ordered")

    def _check_stop(self, arrival: float) -> None:
        """Whether the axis is where one that brakes as declared can be."""
        ordered, start, age = self._stop
        speed, deceleration = self.top_speed, self._limits.deceleration
        braking = min(max(0.0, arrival - ordered - REACTION_TIME_S), speed / deceleration)
        allowed = speed * (age + REACTION_TIME_S + braking) - 0.5 * deceleration * braking**2
        if not abs(self.state.depth - start) <= allowed + POSITION_TOLERANCE_M:
            self._beyond = True
        if self._rest_depth is None:
            self._rest_depth = self.state.depth if self.at_rest else None
        elif abs(self.state.depth - self._rest_depth) > max(_MOVED_M, 2.0 * self._spread):
            self._beyond = True  # it rested, and moves again
